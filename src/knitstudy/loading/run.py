"""How a problem is followed: where it keeps what has converged, and what it reports to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from knitstudy.loading.progress import ReportProgress, silent


@dataclass(frozen=True)
class Run:
    """One run of a problem; by default in memory alone and silent.

    Attributes
    ----------
    restart : Path, optional
        Restart file, rewritten at every increment. If it exists, the run goes on from it.
    partial : Path, optional
        Where the history of what had converged is written, with the reason as attribute `incomplete`, if full load is
        not reached.
    progress : callable
        Called at every converged increment with the load factor and, in words, the place on the load path.
    """

    restart: Path | None = None
    partial: Path | None = None
    progress: ReportProgress = silent

    def forget(self) -> None:
        """Delete restart file and partial history: for who has written the whole history to disk, not before."""
        for path in (self.restart, self.partial):
            if path is not None:
                path.unlink(missing_ok=True)


IN_MEMORY = Run()
"""Nothing kept and nothing reported."""
