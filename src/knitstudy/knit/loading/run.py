"""A run of a problem: its progress, with the time left, and its restart file."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

ReportProgress = Callable[[float, str], None]
"""Called with the share done, from 0 to 1, and a short note."""


def silent(done: float, note: str = "") -> None:
    """Report nothing: the default of library functions."""


def clock(seconds: float) -> str:
    """Return a time such as 01:10 or 2:01:10.

    Examples
    --------
    >>> clock(70.2)
    '01:10'
    """
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes:02}:{seconds:02}"


class Progress:
    """Lines such as ``dns plain3x3  40% [01:10<01:45] strain 0.020``, on a terminal as well as in a log.

    The last line, at 1, is always written.
    """

    def __init__(
        self,
        label: str,  # begins every line
        streams: tuple[TextIO, ...] = (),  # by default standard error
        every: float = 5.0,  # least time between two lines [s]
    ) -> None:
        self.label = label
        self.streams = streams or (sys.stderr,)
        self.every = every
        self._started: float | None = None
        self._initial = 0.0
        self._written = float("-inf")

    def __call__(self, done: float, note: str = "") -> None:
        """Report the share that is done, from 0 to 1; the share of the first call was done before this run."""
        now = time.monotonic()
        if self._started is None:
            self._started, self._initial = now, done
        if now - self._written < self.every and done < 1:
            return
        self._written = now
        elapsed = now - self._started
        share = (done - self._initial) / (1 - self._initial or 1)
        left = clock(elapsed * (1 / share - 1)) if share > 0 else "?"
        line = f"{100 * done:3.0f}% [{clock(elapsed)}<{left}]"
        for stream in self.streams:
            print(f"{self.label}  {line} {note}".rstrip(), file=stream, flush=True)


@dataclass(frozen=True)
class Run:
    """Files and progress of one run of a problem; by default in memory alone and silent."""

    # Restart file, rewritten at every increment. If it exists, the run goes on from it
    restart: Path | None = None
    # Called at every converged increment with the load factor and, in words, the place on the load path
    progress: ReportProgress = silent

    def forget(self) -> None:
        """Delete the restart file, once the history is on disk."""
        if self.restart is not None:
            self.restart.unlink(missing_ok=True)


IN_MEMORY = Run()  # nothing kept and nothing reported

DIGITS = 16  # length of the digest in a restart file's name


def restart_of(folder: Path | str, name: str, digest: str) -> Path:
    """Return the restart file of a scene in a folder, and delete files of the same scene with another digest.

    When the scene, the mesh or the code has changed, the digest is another one and the run starts again. The workflow
    engine deletes the outputs of a rule before it runs it again, therefore restart files lie outside of them.
    """
    restart = Path(folder) / f"{name}-{digest[:DIGITS]}.npz"
    for path in restart.parent.glob(f"{name}-{DIGITS * '[0-9a-f]'}.*"):
        if path.stem != restart.stem:
            path.unlink(missing_ok=True)  # another run of the scene may have been first
    return restart
