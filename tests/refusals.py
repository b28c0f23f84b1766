"""What knitstudy refuses, by an error of its own whose message is one line, and tables of what it refuses and reads."""

from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from knitstudy.errors import KnitstudyError

HERE = Path(__file__).parent
REFUSED = yaml.safe_load((HERE / "refused.yaml").read_text(encoding="utf-8"))
"""Rows of inputs and what is said of them, by what refuses them."""

READ = yaml.safe_load((HERE / "read.yaml").read_text(encoding="utf-8"))
"""Rows of inputs and what is read of them, by what reads them."""


@contextmanager
def refusal(message, kind=KnitstudyError):
    """Pass where the block raises an error whose one line matches the message; the error is in `value`."""
    with pytest.raises(kind, match=message) as caught:
        yield caught
    assert "\n" not in str(caught.value)
