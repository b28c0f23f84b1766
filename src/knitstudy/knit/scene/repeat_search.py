"""The largest part of a grid that repeats itself: the fabric of a piece, without its borders and edges.

What a part leaves out on any side is at most half as wide as the part. Every such part therefore holds the middle
third of the grid, and the middle alone says which repeats are possible: the other cells are compared with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from knitstudy.errors import ConfigurationError

Size = tuple[int, int]  # rows and columns
Part = tuple[slice, slice]

MOST_COMPARED = 10_000_000_000  # Cells that are compared in one search: some seconds


def numbered(cells: Sequence[bytes] | Sequence[str]) -> np.ndarray:
    """Return a number for each of some texts, equal where the texts are (n,)."""
    number: dict[bytes | str, int] = {}
    numbers = [number.setdefault(cell, len(number)) for cell in cells]
    return np.array(numbers, dtype=np.min_scalar_type(max(len(number), 1)))


def largest_repeat(grid: np.ndarray) -> tuple[Part, Size] | None:
    """Return the largest part of a grid of numbers that repeats itself, and the size of its smallest repeat.

    Two repeats or more lie above each other and side by side, or else one is as wide as the grid. None where no part
    is like that. Raises ConfigurationError where a grid is made so that the search would take minutes.
    """
    if found := _Search(grid, 2).largest():
        return found
    whole_rows = numbered([row.tobytes() for row in np.ascontiguousarray(grid)])
    if found := _Search(whole_rows[:, None], 1).largest():
        (rows, _), (high, _) = found
        return (rows, slice(0, grid.shape[1])), (high, grid.shape[1])
    return None


class _Search:
    """A search for parts with two repeats or more above each other, and `fewest` or more side by side."""

    def __init__(self, grid: np.ndarray, fewest: int) -> None:
        self.grid = grid.astype(np.min_scalar_type(grid.max(initial=0)))
        self.fewest = (2, fewest)
        self.compared = 0

    def largest(self) -> tuple[Part, Size] | None:
        """Return the largest part that repeats itself, and the size of its repeat."""
        most = 0
        found: tuple[Part, Size] | None = None
        for size in sorted(product(self._periods(0), self._periods(1)), key=lambda size: size[0] * size[1]):
            if found and not any(count % part for count, part in zip(size, found[1], strict=True)):
                continue  # the same repeat, several times
            middle = self._middle(0, size[0]), self._middle(1, size[1])
            if not self._repeats(middle, size) or self._repeats_smaller(middle, size):
                continue
            part = self._grown(middle, size)
            area = np.prod([along.stop - along.start for along in part]) if part else 0
            if part and area > most:
                most = int(area)
                found = (part, size)
        return found

    def _middle(self, axis: int, period: int) -> slice:
        """Return the rows, or columns, that every part with this period holds: at least one period."""
        whole = self.grid.shape[axis]
        margin = min(whole // 3, whole - self.fewest[axis] * period)
        return slice(margin, whole - margin)

    def _periods(self, axis: int) -> list[int]:
        """Return the periods of rows, or columns, that a part may have, by the middle third of the grid across."""
        whole = self.grid.shape[axis]
        across = self.grid.shape[1 - axis]
        third = across // 3
        lines = np.moveaxis(self.grid, axis, 0)[:, third : across - third]
        line = numbered([each.tobytes() for each in np.ascontiguousarray(lines)])
        periods = []
        for period in range(1, whole // self.fewest[axis] + 1):
            middle = self._middle(axis, period)
            self._count(2 * whole)
            alike = line[period:] == line[:-period]
            if not alike[middle.start : middle.stop - period].all():
                continue
            start = middle.start - int(_run(alike[None, : middle.start][:, ::-1])[0])
            stop = middle.stop + int(_run(alike[None, middle.stop - period :])[0])
            extent = stop - start
            if extent >= self.fewest[axis] * period and 2 * max(start, whole - stop) <= extent:
                periods.append(period)
        return periods

    def _count(self, cells: int) -> None:
        self.compared += cells
        if self.compared > MOST_COMPARED:
            raise ConfigurationError(
                "the search for the part that repeats itself takes too long: name the rows of one"
            )

    def _repeats(self, part: Part, size: Size) -> bool:
        """Whether a part of a grid is periodic with these numbers of rows and of columns."""
        (high, wide) = size
        cells = self.grid[part]
        self._count(2 * cells.size)
        return bool((cells[high:] == cells[:-high]).all() and (cells[:, wide:] == cells[:, :-wide]).all())

    def _repeats_smaller(self, part: Part, size: Size) -> bool:
        """Whether a part is one of a smaller repeat, of which this one is several."""
        high, wide = size
        smaller = [(high // by, wide) for by in _prime_factors(high)]
        smaller += [(high, wide // by) for by in _prime_factors(wide)]
        return any(self._repeats(part, each) for each in smaller)

    def _grown(self, middle: Part, size: Size) -> Part | None:
        """Return the largest part around the middle that repeats as it does, or None where it leaves out too much."""
        rows, columns = (
            along.start + (np.arange(whole) - along.start) % period
            for along, whole, period in zip(middle, self.grid.shape, size, strict=True)
        )
        self._count(3 * self.grid.size)
        alike = self.grid == self.grid[np.ix_(rows, columns)]
        least = self.fewest[0] * size[0], self.fewest[1] * size[1]
        if alike.shape[0] <= alike.shape[1]:
            return _largest_part(alike, middle, least)
        turned = _largest_part(alike.T, middle[::-1], least[::-1])
        return turned and turned[::-1]


def _run(true: np.ndarray) -> np.ndarray:
    """Return how many values of every row are true before the first one that is not (n,)."""
    length = np.where(true.all(axis=1), true.shape[1], 0)
    return length if not true.shape[1] else np.where(length, length, true.argmin(axis=1))


def _prime_factors(number: int) -> list[int]:
    """Return the prime numbers that divide a number."""
    factors = []
    divisor = 2
    while divisor * divisor <= number:
        if number % divisor == 0:
            factors.append(divisor)
            while number % divisor == 0:
                number //= divisor
        divisor += 1
    return factors + [number] * (number > 1)


def _largest_part(alike: np.ndarray, middle: Part, least: Size) -> Part | None:
    """Return the largest part around the middle in which all cells are alike.

    It has the least size or more, and leaves out at most half as much as it has on any side; None where there is none.
    """
    (up, along) = middle
    (height, width) = alike.shape
    left = along.start - _run(alike[:, : along.start][:, ::-1])
    right = along.stop + _run(alike[:, along.stop :])
    whole: np.ndarray = np.all(alike[:, along], axis=1)
    below = int(_run(whole[None, : up.start][:, ::-1])[0])
    above = int(_run(whole[None, up.stop :])[0])
    bottom = up.start - np.arange(below + 1)[:, None]
    top = up.stop + np.arange(above + 1)
    # Of all rows from the middle down to a bottom, and up to a top
    down = slice(up.start - below, up.stop)
    rise = slice(up.start, up.stop + above)
    count = up.stop - up.start - 1
    left_down, left_up = (np.maximum.accumulate(of)[count:] for of in (left[down][::-1], left[rise]))
    right_down, right_up = (np.minimum.accumulate(of)[count:] for of in (right[down][::-1], right[rise]))
    start, stop = np.maximum(left_down[:, None], left_up), np.minimum(right_down[:, None], right_up)
    high, wide = top - bottom, stop - start
    fits = (high >= least[0]) & (wide >= least[1]) & (2 * bottom <= high) & (2 * (height - top) <= high)
    fits &= (2 * start <= wide) & (2 * (width - stop) <= wide)
    if not fits.any():
        return None
    one, other = np.unravel_index(np.where(fits, high * wide, 0).argmax(), fits.shape)
    rows = slice(int(bottom[one, 0]), int(top[other]))
    return rows, slice(int(start[one, other]), int(stop[one, other]))
