"""Forces per width and moduli of an endless knit, from one cell that repeats itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.discretisation import made_of
from knitstudy.measures.endless_knit import Moduli, moduli
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

STRAINS = ["course strain [1]", "wale strain [1]", "angle of shear [rad]"]

FORCES = ["course force over width [N/m]", "wale force over width [N/m]", "shear force over width [N/m]"]

AXIS = {"course": 0, "wale": 1, "biaxial": 0, "shear": 2}
"""Strain and force of secant and tangent, by ``load.deformation``: of a biaxial stretch those in course direction."""

UNKNOWN = Moduli(*(5 * [np.nan]))
"""Of yarns that are not tied: at rest they do not touch."""

CONTRACTS = {"course": (1, 0), "wale": (0, 1)}
"""Strain across, and strain along, of a pull that leaves the other free."""


@TABLES.add("cell", "Forces per width of an endless knit", needs=("cells", "scenes"), order=5.8)
def tabulate(cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row for every cell.

    Parameters
    ----------
    cells : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    return pd.DataFrame([_row(scenes[name], history) for name, history in cells.items()])


def _row(scene: Scene, history: xr.Dataset) -> dict:
    """Return what one cell shows at full load, and its moduli at rest."""
    kind, free = scene.load.deformation, scene.load.lateral == "free"
    strain = history["cell_strain"].to_numpy()[-1]
    force = history["force_per_width"].to_numpy()[-1]
    axis = AXIS[kind]
    across = CONTRACTS.get(kind) if free else None
    rest = moduli(history["membrane_stiffness"].to_numpy()) if "membrane_stiffness" in history else UNKNOWN
    return {
        "scene": scene.name,
        "deformation": kind,
        "other strains": scene.load.lateral,
        "interaction": scene.interaction,
        "cells": f"{scene.pattern.loops} x {scene.pattern.rows}",
        "yarns": made_of(scene),
        **dict(zip(STRAINS, strain, strict=True)),
        **dict(zip(FORCES, force, strict=True)),
        "secant modulus [N/m]": force[axis] / strain[axis],
        "tangent modulus [N/m]": _slope(history, kind, free),
        "Poisson's ratio, secant [1]": -strain[across[0]] / strain[across[1]] if across else np.nan,
        "course modulus at rest [N/m]": rest.course,
        "wale modulus at rest [N/m]": rest.wale,
        "shear modulus at rest [N/m]": rest.shear,
        "Poisson's ratio of course tension at rest [1]": rest.contraction_of_course,
        "Poisson's ratio of wale tension at rest [1]": rest.contraction_of_wale,
    }


def _slope(history: xr.Dataset, kind: str, free: bool) -> float:
    """Return the slope of the force along the way of a deformation [N/m]; nan where contact leaves more than one."""
    if "tangent_per_width" not in history:
        return np.nan
    tangent, axis = history["tangent_per_width"].to_numpy()[-1], AXIS[kind]
    # Along the way of a biaxial stretch both strains grow alike.
    way = np.array([1.0, 1.0, 0.0]) if kind == "biaxial" else np.eye(3)[axis]
    driven = way > 0 if free else np.ones(3, dtype=bool)
    # By the strains that are prescribed, the others being free of force.
    stiffness = np.linalg.inv(np.linalg.inv(tangent)[np.ix_(driven, driven)])
    return float((stiffness @ way[driven])[np.flatnonzero(driven).tolist().index(axis)])
