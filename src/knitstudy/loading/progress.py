"""Progress of a long computation as plain lines with the time left."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from tqdm import tqdm

ReportProgress = Callable[[float, str], None]
"""What a stage calls with the share done, from 0 to 1, and a short note."""


def silent(done: float, note: str = "") -> None:
    """Report nothing: the default of library functions."""


class Progress:
    """Lines such as ``dns plain3x3  40% [01:10<01:45] strain 0.020``, on a terminal as well as in a log.

    Parameters
    ----------
    label
        What is computed; begins every line.
    streams
        Where the lines go; standard error by default.
    every
        Least time between two lines in seconds. The last line, at 1, is always written.
    """

    def __init__(self, label: str, streams: tuple[TextIO, ...] = (), every: float = 5.0):
        self.label = label
        self.streams = streams or (sys.stderr,)
        self.every = every
        self._started: float | None = None
        self._initial = 0.0
        self._written = float("-inf")

    def __call__(self, done: float, note: str = "") -> None:
        """Report the share that is done, from 0 to 1.

        The share of the first call counts as there before: after a restart the time left is judged by the
        new part.
        """
        now = time.monotonic()
        if self._started is None:
            self._started, self._initial = now, done
        if now - self._written < self.every and done < 1:
            return
        self._written = now
        line = tqdm.format_meter(
            n=round(100 * done, 1),
            total=100,
            initial=round(100 * self._initial, 1),
            elapsed=now - self._started,
            bar_format="{percentage:3.0f}% [{elapsed}<{remaining}]",
        )
        for stream in self.streams:
            print(f"{self.label}  {line} {note}".rstrip(), file=stream, flush=True)
