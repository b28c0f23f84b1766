"""Where a long computation keeps what it needs to go on after it was killed."""

from __future__ import annotations

from pathlib import Path

from knitstudy.loading.progress import ReportProgress, silent
from knitstudy.loading.run import Run

DIGITS = 16
"""Length of the digest in a restart file's name."""


def restart_of(folder: Path | str, name: str, digest: str) -> Path:
    """Return the restart file of a scene; those of the same scene with another digest are of no use any more.

    A run goes on only from its own restart file: when the scene, the mesh or the code has changed, the digest is
    another one and the run starts anew. The workflow engine deletes the outputs of a rule before it runs it again,
    therefore restart files lie outside of them.

    Parameters
    ----------
    folder : Path or str
        Where restart files are kept.
    name : str
        Of the scene.
    digest : str
        Of all that the result depends on.
    """
    restart = Path(folder) / f"{name}-{digest[:DIGITS]}.npz"
    for path in restart.parent.glob(f"{name}-{DIGITS * '[0-9a-f]'}.*"):
        if path.stem != restart.stem:
            path.unlink(missing_ok=True)  # another run of the scene may have been first
    return restart


def run_with(restart: Path | None, progress: ReportProgress = silent) -> Run:
    """Return a run with that restart file, and the history of what had converged beside it; without one, in memory."""
    return Run(restart, restart.with_suffix(".nc"), progress) if restart else Run(progress=progress)
