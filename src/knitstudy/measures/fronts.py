"""What fronts of error and price say: sentences, and rungs."""

from __future__ import annotations

from collections.abc import Sequence

from knitstudy.study.choice import digits

ACCURACIES = (0.20, 0.10, 0.05, 0.02)
"""Errors that sentences are about [1]."""


def sentence(words: str, accuracy: float, name: str, seconds: float, memory: float, error: float) -> str:
    """Return the sentence that a reader wants.

    >>> sentence("force", 0.05, "3D ROM, patch joints", 1.04, 14.9, 0.011)
    'For 5 % in force take 3D ROM, patch joints: 1 s, 15 MB (error at most 1.1 %).'
    """
    return (
        f"For {100 * accuracy:g} % in {words} take {name}: {digits(seconds)} s, {digits(memory)} MB "
        f"(error at most {digits(100 * error)} %)."
    )


def nothing(words: str, accuracy: float, name: str, error: float) -> str:
    """Return the sentence of an accuracy that nothing reaches, with what comes nearest."""
    return (
        f"Nothing measured gives {words} within {100 * accuracy:g} %: {name} comes nearest with "
        f"{digits(100 * error)} %."
    )


def rungs(seconds: Sequence[float], errors: Sequence[float]) -> dict[str, bool]:
    """Return which rungs a front has: under 1 s, under 30 s, within 2 %."""
    return {
        "under 1 s": any(value < 1 for value in seconds),
        "under 30 s": any(value < 30 for value in seconds),
        "within 2 %": any(value <= 0.02 for value in errors),
    }
