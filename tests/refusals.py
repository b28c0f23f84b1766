"""What knitstudy refuses: an error of its own whose message is one line."""

from contextlib import contextmanager

import pytest

from knitstudy.errors import KnitstudyError


@contextmanager
def refusal(message, kind=KnitstudyError):
    """Pass where the block raises an error whose one line matches the message; the error is in `value`."""
    with pytest.raises(kind, match=message) as caught:
        yield caught
    assert "\n" not in str(caught.value)
