"""Batches: matrices with closed-form determinants, points of which some are chosen, scratch arrays, and threads."""

from __future__ import annotations

import ctypes
import math
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, suppress
from functools import lru_cache
from typing import Any, Self, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from knitstudy.errors import ConfigurationError
from knitstudy.interruption import uninterrupted
from knitstudy.mechanics.core.arrays import Floats, Ints

# Determinants and inverses of batches of 3 x 3 matrices in closed form: LAPACK's are made for large ones


def determinant(matrix: Floats) -> Floats:
    """Return the determinants (e,) of matrices (e, 3, 3).

    Examples
    --------
    >>> determinant(2 * np.eye(3)[None]).tolist()
    [8.0]
    """
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(matrix, 0, -1)
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def inverse(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the inverses (e, 3, 3) of matrices (e, 3, 3), by their cofactors, and the determinants (e,).

    Examples
    --------
    >>> inverse(2 * np.eye(3)[None])[1].tolist()
    [8.0]
    """
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(matrix, 0, -1)
    cofactors = (
        (e * i - f * h, c * h - b * i, b * f - c * e),
        (f * g - d * i, a * i - c * g, c * d - a * f),
        (d * h - e * g, b * g - a * h, a * e - b * d),
    )
    size = a * cofactors[0][0] + b * cofactors[1][0] + c * cofactors[2][0]
    result = np.empty_like(matrix)
    for row in range(3):
        for column in range(3):
            np.divide(cofactors[row][column], size, out=result[:, row, column])
    return result, size


class Chosen:
    """Arrays over the same points, of which some can be chosen, or groups of them; other attributes hold for all."""

    def __getitem__(self, chosen: np.ndarray | slice) -> Self:
        return type(self)(*(_chosen(value, chosen) for value in vars(self).values()))

    def joined(self, *others: Self, chosen: Ints | slice = slice(None)) -> Self:
        """Return these points and then the points of others, or the chosen ones of all, an array at a time."""
        together = zip(*(vars(points).values() for points in (self, *others)), strict=True)
        return type(self)(*(_chosen(_joined(arrays), chosen) for arrays in together))


def _is_over_points(value: Any) -> bool:
    return isinstance(value, Chosen) or np.ndim(value) > 0


def _chosen(value: Any, chosen: np.ndarray | slice) -> Any:
    return value[chosen] if _is_over_points(value) else value


def _joined(parts: Sequence[Any]) -> Any:
    if isinstance(parts[0], Chosen):
        return parts[0].joined(*parts[1:])
    return np.concatenate(parts) if _is_over_points(parts[0]) else parts[0]


# Arrays that a thread uses again and again


class Scratch(threading.local):
    """Arrays of one thread by name; their content lasts until the next use of the name.

    In fresh memory the system clears every page when it is first touched, which costs several times as much as the
    computation, and threads wait for each other there.
    """

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray] = {}

    def array(self, name: str, *shape: int) -> Floats:
        """Return an array whose content is arbitrary."""
        size = math.prod(shape)
        flat = self._arrays.get(name)
        if flat is None or flat.size < size:
            flat = self._arrays[name] = np.empty(size)
        return flat[:size].reshape(shape)


SCRATCH = Scratch()


class Reserve:
    """Memory of arrays that are the largest ones while they last: it stays for the next ones until it is given back."""

    def __init__(self) -> None:
        self._flat = np.empty(0)

    def arrays(self, *shapes: tuple[int, ...]) -> list[np.ndarray]:
        """Return arrays of arbitrary content, in the memory of earlier arrays if nothing refers to them any more.

        Examples
        --------
        >>> reserve = Reserve()
        >>> first = reserve.arrays((2, 3), (4,))[0].ctypes.data
        >>> reserve.arrays((5, 2))[0].ctypes.data == first
        True
        """
        ends = np.cumsum([math.prod(shape) for shape in shapes])
        # Arrays refer to the memory that they are parts of; the attribute and the call do as well.
        if self._flat.size < ends[-1] or sys.getrefcount(self._flat) > 2:
            self._flat = np.empty(ends[-1])
        return [part.reshape(shape) for part, shape in zip(np.split(self._flat, ends), shapes, strict=False)]

    @property
    def size(self) -> int:
        """How many numbers there is memory for."""
        return self._flat.size

    def give_back(self) -> None:
        """Leave the memory to others, as soon as nothing else refers to it."""
        self._flat = np.empty(0)


# Options of `mallopt` in glibc, with bytes: arrays of the first are mapped, and leave no holes when they go; that much
# of the heap's end is kept for a load path to use again (docs/notes/performance.md, Memory in contact)
MMAP_THRESHOLD, TRIM_THRESHOLD = (-3, 8 << 20), (-1, 256 << 20)


def reuse_memory() -> None:
    """Have glibc give back the memory of large arrays alone, unless the user has settings of glibc's."""
    if any(name.startswith("MALLOC_") for name in os.environ):
        return
    with suppress(AttributeError, OSError, TypeError):
        mallopt = ctypes.CDLL(None).mallopt
        for option in (MMAP_THRESHOLD, TRIM_THRESHOLD):
            mallopt(*option)


# Threads: which work they share, batches of elements, yarns and ranges of rows, and how many there are
# NumPy, SciPy's sparse products and SuperLU leave the interpreter's lock while they compute; SciPy's wrappers of LAPACK
# do not (docs/notes/performance.md). Results must not depend on how many threads there are: every piece of work writes
# to a place of its own, and sums are formed in the order of the pieces.

Result = TypeVar("Result")

VARIABLE = "OMP_NUM_THREADS"


def threads() -> int:
    """Return the number of threads that OMP_NUM_THREADS allows, all cores if it is unset.

    Of a list, one number for each level of nesting, the first counts.

    Raises ConfigurationError if it is not a whole number of at least 1.
    """
    value = os.environ.get(VARIABLE, "").strip()
    if not value:
        return os.cpu_count() or 1
    first = value.split(",")[0].strip()
    if not (first.isascii() and first.isdigit() and int(first) >= 1):
        raise ConfigurationError(
            f"the environment variable {VARIABLE} is {value!r}; allowed is a whole number of at least 1"
        )
    return int(first)


_SHARING = threading.Lock()


def share(work: Callable[[int], Result], count: int) -> list[Result]:
    """Return ``work(0)`` to ``work(count - 1)``; threads take the next number whenever they are free.

    The first exception ends it. Work that is shared from within shared work stays on its thread.

    Examples
    --------
    >>> share(lambda number: number**2, 4)
    [0, 1, 4, 9]
    """
    results: list[Any] = [None] * count
    numbers: Iterator[int] = iter(range(count))  # taking the next one cannot be interrupted

    def take() -> None:
        for number in numbers:
            results[number] = work(number)

    outermost = _SHARING.acquire(blocking=False)
    helpers = min(threads(), count) - 1 if outermost else 0
    others: list[Future[None]] = []
    try:
        with uninterrupted():
            others += [_pool(threads()).submit(take) for _ in range(helpers)]
        take()
    finally:
        for _ in numbers:  # after an exception nothing is left to take
            pass
        wait(others)
        if outermost:
            _SHARING.release()
    for other in others:
        other.result()
    return results


def parts(count: int, size: int) -> list[slice]:
    """Return slices of `size` items each that cover all items; at least one slice.

    Examples
    --------
    >>> parts(5, size=2)
    [slice(0, 2, None), slice(2, 4, None), slice(4, 6, None)]
    """
    return [slice(first, first + size) for first in range(0, max(count, 1), size)]


def by_parts(
    work: Callable[[slice], np.ndarray | Chosen | tuple[np.ndarray | Chosen, ...]], count: int, size: int
) -> Any:
    """Return the arrays of ``work(part)`` over all items, `size` items at a time: this bounds the memory.

    Examples
    --------
    >>> by_parts(lambda part: np.arange(5)[part] ** 2, count=5, size=2).tolist()
    [0, 1, 4, 9, 16]
    """
    slices = parts(count, size)
    results = share(lambda number: work(slices[number]), len(slices))
    if isinstance(results[0], tuple):
        return tuple(map(_joined, zip(*results, strict=True)))
    return _joined(results)


@lru_cache(maxsize=1)
def _pool(count: int) -> ThreadPoolExecutor:
    """Return the threads that help the calling one, made once: a new one costs as much as a small batch."""
    return ThreadPoolExecutor(count - 1, thread_name_prefix="knitstudy")


def serial_blas() -> AbstractContextManager[Any]:
    """Return a context in which BLAS stays on the calling thread.

    Its matrices are small here, and its threads would wait in a busy loop for the threads that share the batches.
    """
    return threadpool_limits(limits=1, user_api="blas")
