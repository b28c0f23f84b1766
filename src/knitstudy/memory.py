"""Memory of this process: its peak, and how far it has grown since a moment."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

import psutil

_CLEAR = Path("/proc/self/clear_refs")
_STATUS = Path("/proc/self/status")


class Memory:
    """Begins to watch the resident memory of this process.

    On Linux the watch begins with a peak of its own; elsewhere a peak before it may hide growth.
    """

    def __init__(self) -> None:
        self._before = psutil.Process().memory_info().rss
        self._own_peak = _begin_new_peak()

    def measure(self) -> tuple[int, int]:
        """Return growth since the watch began, at its highest, and the peak of the process [bytes]."""
        peak = _peak_since() if self._own_peak else peak_memory()
        return max(0, peak - self._before), peak_memory()


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
