"""What a computation costs: time, and how far the memory of this process has grown since a moment."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

_CLEAR = Path("/proc/self/clear_refs")
_STATUS = Path("/proc/self/status")


@dataclass(frozen=True)
class Cost:
    """Wall time [s], largest growth of memory and peak of the process [bytes]."""

    seconds: float
    memory_growth: int
    memory_peak: int


class Meter:
    """Measures from its making on.

    On Linux memory is watched with a peak of its own; elsewhere a peak before it may hide growth.
    """

    def __init__(self) -> None:
        self._before = psutil.Process().memory_info().rss
        self.has_own_peak = _begin_new_peak()
        self._started = time.perf_counter()
        self._paused = 0.0

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave out the time that a block takes."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self._paused += time.perf_counter() - started

    def read(self) -> Cost:
        """Return the cost so far."""
        seconds = time.perf_counter() - self._started - self._paused
        peak = _peak_since() if self.has_own_peak else peak_memory()
        return Cost(seconds, max(0, peak - self._before), peak_memory())


def peak_memory() -> int:
    """Return the largest resident memory that this process has had [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def _begin_new_peak() -> bool:
    """Let the kernel forget the peak of /proc/self/status (not that of getrusage); return whether it could."""
    try:
        _CLEAR.write_text("5")
        return _peak_since() > 0
    except OSError:
        return False


def _peak_since() -> int:
    for line in _STATUS.read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    return 0
