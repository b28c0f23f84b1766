"""What knitstudy refuses: an error of its own whose message is one line; ``refused.yaml`` holds inputs and messages."""

from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from knitstudy.errors import KnitstudyError

REFUSED = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))
"""Rows of inputs and what is said of them, by what refuses them."""


@contextmanager
def refusal(message, kind=KnitstudyError):
    """Pass where the block raises an error whose one line matches the message; the error is in `value`."""
    with pytest.raises(kind, match=message) as caught:
        yield caught
    assert "\n" not in str(caught.value)
