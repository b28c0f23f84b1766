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
        Restart file, rewritten at every increment and removed at the end. If it exists, the run goes on from it.
    partial : Path, optional
        Where the history of what had converged is written, with the reason as attribute `incomplete`, if full load is
        not reached; removed when it is.
    progress : callable
        Called at every converged increment with the load factor and, in words, the place on the load path.
    """

    restart: Path | None = None
    partial: Path | None = None
    progress: ReportProgress = silent


IN_MEMORY = Run()
"""Nothing kept and nothing reported."""
