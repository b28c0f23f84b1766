"""The endless knit: forces and moduli of a cell, and its stiffness as a shell."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.reference import made_of
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.columns import Simulation, cells_of, rows_of
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several
from knitstudy.use.decks.fabric import SHELL_ENTRIES, section_matrix, shell_entries

# Force per width over strain, free of force in all other components, and Poisson's ratios of both pulls.
MODULI = (
    "course modulus at rest [N/m]",
    "wale modulus at rest [N/m]",
    "shear modulus at rest [N/m]",
    "Poisson's ratio of course tension at rest [1]",
    "Poisson's ratio of wale tension at rest [1]",
)
STRAINS = ("course strain [1]", "wale strain [1]", "angle of shear [rad]")
FORCES = ("course force over width [N/m]", "wale force over width [N/m]", "shear force over width [N/m]")
# Strain and force of secant and tangent, by ``load.deformation``: of a biaxial stretch the course's.
AXIS = {"course": 0, "wale": 1, "biaxial": 0, "shear": 2}
AT_REST = ("knit", "pattern", "yarn", "mesh", "tie")  # Keys that the stiffness at rest depends on
UNITS = {0: "N/m", 1: "N", 2: "N m"}  # By how many of row and column are bending
CELLS = {"cells": several("simulation", "cell-*")}


@TABLES.add("cell", "Forces per width of an endless knit", results=CELLS, order=5.8)
def tabulate_cells(cells: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every cell: forces per width at full load, and moduli at rest."""
    return pd.DataFrame(map(_cell, rows_of(scenes, cells).values()))


def _cell(row: Simulation) -> dict[str, Any]:
    scene, history = row.scene, row.history
    kind = scene.value("load.deformation")
    free = scene.value("load.lateral") == "free"
    strain, force = (history[name].to_numpy()[-1] for name in ("cell_strain", "force_per_width"))
    axis = AXIS[kind]
    pulled = free and kind in ("course", "wale")
    rest = dict.fromkeys(MODULI, np.nan)  # of yarns that are not tied and do not touch
    if "membrane_stiffness" in history:
        rest = moduli(history["membrane_stiffness"].to_numpy())
    return {
        "scene": scene.name,
        "deformation": kind,
        "other strains": scene.load.lateral,
        "interaction": scene.interaction,
        "cells": cells_of(scene.value("pattern")),
        "yarns": made_of(scene),
        **dict(zip(STRAINS, strain, strict=True)),
        **dict(zip(FORCES, force, strict=True)),
        "secant modulus [N/m]": force[axis] / strain[axis],
        "tangent modulus [N/m]": _slope(history, kind, free),
        "Poisson's ratio, secant [1]": -strain[1 - axis] / strain[axis] if pulled else np.nan,
        **rest,
    }


def _slope(history: xr.Dataset, kind: str, free: bool) -> float:
    """Return the slope of the force along the path of a deformation [N/m]; nan without a tangent."""
    if "tangent_per_width" not in history:
        return np.nan
    tangent = history["tangent_per_width"].to_numpy()[-1]
    axis = AXIS[kind]
    # Both strains of a biaxial stretch grow alike.
    way = np.array([1.0, 1.0, 0.0]) if kind == "biaxial" else np.eye(3)[axis]
    driven = way > 0 if free else np.ones(3, dtype=bool)
    # Stiffness by the prescribed strains, with the others free of force.
    stiffness = np.linalg.inv(np.linalg.inv(tangent)[np.ix_(driven, driven)])
    return float((stiffness @ way[driven])[np.flatnonzero(driven).tolist().index(axis)])


def moduli(membrane: Floats) -> dict[str, float]:
    """Return `MODULI` from forces per width by strains in the plane (3, 3) [N/m]."""
    compliance = np.linalg.inv(membrane)
    along = np.diag(compliance)
    contractions = (-compliance[1, 0] / along[0], -compliance[0, 1] / along[1])
    return dict(zip(MODULI, (*(1 / along), *contractions), strict=True))


@TABLES.add("shell", "An endless knit as a shell", results=CELLS, order=5.9)
def tabulate_shells(cells: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every cell that differs at rest: the symmetric stiffness in the order of Abaqus.

    Rows and columns 1 to 3 are the strains in the plane, course, wale and shear, 4 to 6 the curvatures; the plane of
    reference is z = 0 of the loop. Knits in contact, whose yarns do not touch at rest, are no shells.
    """
    first: dict[str, str] = {}
    for name in cells:
        if not scenes[name].kind.interaction.touches:
            first.setdefault(str(scenes[name].read(AT_REST)), name)
    rows = []
    for name in first.values():
        matrix = section_matrix(cells[name])
        scale = np.sqrt(np.diag(matrix))
        least, *_, most = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        row = {
            "scene": name,
            "cells": cells_of(scenes[name].value("pattern")),
            "yarns": made_of(scenes[name]),
        }
        for entry, value in zip(SHELL_ENTRIES, shell_entries(matrix), strict=True):
            row[f"{entry} [{UNITS[sum(int(index) > 3 for index in entry[1:])]}]"] = value
        rows.append(row | {"least eigenvalue over largest, diagonal scaled to 1 [1]": float(least / most)})
    return pd.DataFrame(rows)
