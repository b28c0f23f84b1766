"""Pareto fronts: what nothing else beats in error and in price at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isnan
from typing import TypeVar

Each = TypeVar("Each")

ALIKE = 0.01
"""Relative difference of two errors that are the same."""


def front(
    points: Iterable[Each], price: Callable[[Each], float], error: Callable[[Each], float]
) -> list[Each]:
    """Return the points that no other is at most as dear as and as accurate, from the cheapest on.

    Errors that differ by less than `ALIKE` are alike: what is left of a tolerance buys no place on a front.

    Parameters
    ----------
    points : iterable
    price, error : callable
        Numbers of a point; the less the better.
    """
    found: list[Each] = []
    for point in sorted(points, key=lambda each: (price(each), error(each))):
        if not found or error(point) < (1 - ALIKE) * error(found[-1]):
            found.append(point)
    return found


def cheapest(
    points: Iterable[Each], accuracy: float, price: Callable[[Each], float], error: Callable[[Each], float]
) -> Each | None:
    """Return the cheapest point whose error is at most an accuracy, if there is one."""
    good = [point for point in points if error(point) <= accuracy]
    return min(good, key=lambda point: (price(point), error(point)), default=None)


def nearest(points: Iterable[Each], error: Callable[[Each], float]) -> Each | None:
    """Return the most accurate point, if there is any."""
    return min(points, key=error, default=None)


def digits(value: float) -> str:
    """Return a number with two digits that count, whole from ten on; a dash where there is none."""
    if isnan(value):
        return "-"
    return f"{value:.0f}" if value >= 10 else f"{float(f'{value:.2g}'):g}"
