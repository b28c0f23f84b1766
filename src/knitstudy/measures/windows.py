"""How far the contacts in a window are from those of the same knit of solid yarns in full."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import nan

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures.discretisation import is_direct, made_of, problem_of
from knitstudy.study.scene import Scene


def is_window(scene: Scene) -> bool:
    """Whether a scene is a window of solid yarns in a knit of beams."""
    return scene.value("window") is not None


def in_full(window: Scene, scenes: Iterable[Scene]) -> Scene | None:
    """Return the direct simulation of the same knit by the same solid yarns, if there is one."""
    for scene in scenes:
        if is_direct(scene) and made_of(scene) == made_of(window) and problem_of(scene) == problem_of(window):
            if scene.load.strain == window.load.strain:
                return scene
    return None


def windows(scenes: Iterable[Scene]) -> list[Scene]:
    """Return all windows and what each is held against, which comes first; none without it."""
    scenes = list(scenes)
    pairs = [(in_full(scene, scenes), scene) for scene in scenes if is_window(scene)]
    found = [scene for full, window in pairs if full is not None for scene in (full, window)]
    return list({scene.name: scene for scene in found}.values())


@dataclass(frozen=True)
class Distance:
    """What the window says at full load against the full simulation: the largest of its crossings' [1].

    Attributes
    ----------
    force : float
        Length of the difference of the forces, over the force.
    pressure : float
        Difference of the largest pressures, over the pressure; nan where yarns are tied.
    """

    force: float
    pressure: float


def distance(window: xr.Dataset, full: xr.Dataset) -> Distance:
    """Return the distance of the contacts of a window to those of all crossings, both at their last increments.

    Raises
    ------
    DataFileError
        If a crossing of the window is not among the others.
    """
    names = {key: k for k, key in enumerate(_keys(full))}
    missing = [key for key in _keys(window) if key not in names]
    if missing:
        raise DataFileError(
            f"the full simulation has no crossing of row {missing[0][0]}, column {missing[0][1]}, zone {missing[0][2]}"
        )
    chosen = [names[key] for key in _keys(window)]
    ours, theirs = (each["force"].to_numpy()[-1] for each in (window, full))
    theirs = theirs[chosen]
    force = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    pressure, reference = (each["largest_pressure"].to_numpy()[-1] for each in (window, full))
    reference = reference[chosen]
    known = np.isfinite(reference) & (reference > 0)
    relative = np.abs(pressure[known] / reference[known] - 1)
    return Distance(float(force.max()), float(relative.max()) if known.any() else nan)


def _keys(contacts: xr.Dataset) -> list[tuple[int, int, int]]:
    columns = (contacts[name].to_numpy().astype(int).tolist() for name in ("row", "column", "zone"))
    return list(zip(*columns, strict=True))
