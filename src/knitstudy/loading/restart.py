"""Where a long computation keeps what it needs to go on after it was killed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from knitstudy.study.scene import Scene

DIGITS = 16
"""Length of the digest in a restart file's name."""


def restart_path(folder: Path | str, scene: Scene, inputs: Iterable[Path | str]) -> Path:
    """Return the name of a restart file that belongs to a scene and to the content of all its inputs.

    A run goes on only from its own restart file: when the scene, the mesh or the code has changed, the name
    is another one and the run starts anew. The workflow engine deletes the outputs of a rule before it runs
    it again, therefore restart files lie outside of them.

    Parameters
    ----------
    folder
        Where restart files are kept.
    scene
        The scene that is computed.
    inputs
        Data files and code that the result depends on.
    """
    digest = hashlib.sha256(scene.hash.encode())
    for path in sorted(map(str, inputs)):
        digest.update(Path(path).read_bytes())
    return Path(folder) / f"{scene.name}-{digest.hexdigest()[:DIGITS]}.npz"


def forget_others(restart: Path) -> None:
    """Delete the restart files of the same scene with other inputs, and the logs and histories beside them."""
    name = restart.stem[: -DIGITS - 1]
    for path in restart.parent.glob(f"{name}-{DIGITS * '[0-9a-f]'}.*"):
        if path.stem != restart.stem:
            path.unlink()
