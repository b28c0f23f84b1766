"""How messages put one quantity over another."""

from __future__ import annotations


def times(part: float, whole: float) -> str:
    """Return "12.3% of", or "1.2e+04 times" where it is many times as much."""
    if part < 10 * whole:
        return f"{part / whole:.1%} of"
    return f"{part / whole:.2g} times" if whole > 0 else "any number of times"
