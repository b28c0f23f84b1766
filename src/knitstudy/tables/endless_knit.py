"""The endless knit: one cell, the limit of square knits beside it, and its stiffness as a shell."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.exchange.inp import SHELL_ENTRIES, section_matrix, shell_entries
from knitstudy.loading.history import DIRECTIONS
from knitstudy.measures.catalogue import Datasets, Scenes, several
from knitstudy.measures.cost import SERIES, Series, force_per_width, series_of
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.endless_knit import CELLS, MODULI, between_grips, limit, moduli
from knitstudy.measures.response import increment_at
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

STRAINS = ["course strain [1]", "wale strain [1]", "angle of shear [rad]"]

FORCES = ["course force over width [N/m]", "wale force over width [N/m]", "shear force over width [N/m]"]
# Strain and force of secant and tangent, by ``load.deformation``: of a biaxial stretch the course's.
AXIS = {"course": 0, "wale": 1, "biaxial": 0, "shear": 2}
CONTRACTS = {"course": (1, 0), "wale": (0, 1)}  # Strain across and along, of a pull
AT_REST = ("knit", "pattern", "yarn", "mesh", "tie")  # What the stiffness at rest hangs on
UNITS = {0: "N/m", 1: "N", 2: "N m"}  # By how many of row and column are bending
# Names of the square knits that have a cell of the endless knit.
SQUARES = [f"{stem}-*" for stem in CELLS] + [SERIES[stem] for stem in CELLS if SERIES[stem]]


@TABLES.add(
    "cell",
    "Forces per width of an endless knit",
    results={"cells": several("simulation", "cell-*")},
    order=5.8,
)
def tabulate_cells(cells: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every cell: forces per width at full load, and moduli at rest."""
    return pd.DataFrame([_row(scenes[name], history) for name, history in cells.items()])


def _row(scene: Scene, history: xr.Dataset) -> dict:
    kind, free = scene.load.deformation, scene.load.lateral == "free"
    strain = history["cell_strain"].to_numpy()[-1]
    force = history["force_per_width"].to_numpy()[-1]
    axis = AXIS[kind]
    across = CONTRACTS.get(kind) if free else None
    rest = dict.fromkeys(MODULI, np.nan)  # of yarns that are not tied and do not touch
    if "membrane_stiffness" in history:
        rest = moduli(history["membrane_stiffness"].to_numpy())
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
        **rest,
    }


def _slope(history: xr.Dataset, kind: str, free: bool) -> float:
    """Return the slope of the force along the path of a deformation [N/m]; nan without a tangent."""
    if "tangent_per_width" not in history:
        return np.nan
    tangent, axis = history["tangent_per_width"].to_numpy()[-1], AXIS[kind]
    # Both strains of a biaxial stretch grow alike.
    way = np.array([1.0, 1.0, 0.0]) if kind == "biaxial" else np.eye(3)[axis]
    driven = way > 0 if free else np.ones(3, dtype=bool)
    # Stiffness by the prescribed strains, with the others free of force.
    stiffness = np.linalg.inv(np.linalg.inv(tangent)[np.ix_(driven, driven)])
    return float((stiffness @ way[driven])[np.flatnonzero(driven).tolist().index(axis)])


@TABLES.add(
    "endless_knit",
    "One cell of an endless knit beside tied square knits of rising size",
    results={
        "squares": several("simulation", *SQUARES, fewest=3),
        "cells": several("simulation", *CELLS.values()),
    },
    order=5.85,
)
def tabulate_limits(squares: Datasets, cells: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return a row for the first and the last strain that all knits of a tied series and its cell reach."""
    rows = []
    for series in series_of(scenes[name] for name in squares):
        name = CELLS.get(series.stem)
        if name in cells:
            rows += _limits(series, squares, scenes[name], cells[name])
    return pd.DataFrame(rows)


def _limits(series: Series, histories: Datasets, cell: Scene, history: xr.Dataset) -> Iterator[dict]:
    paths = [histories[scene.name] for scene in series.scenes]
    shared = [
        strain
        for strain in history["strain"].to_numpy()[1:]
        if all(increment_at(path, strain) is not None for path in paths)
    ]
    axis = DIRECTIONS.index(cell.load.deformation)
    for strain in dict.fromkeys([*shared[:1], *shared[-1:]]):
        forces = [
            force_per_width(path, scene, increment_at(path, strain))
            for scene, path in zip(series.scenes, paths, strict=True)
        ]
        tends_to, uncertain = limit(series.cells, forces)
        increment = increment_at(history, strain)
        free = float(history["force_per_width"][increment, axis])
        grips = between_grips(history, cell, increment)
        yield {
            "direction": cell.load.deformation,
            "yarns": series.model,
            "strain [1]": strain,
            "cells in a row [1]": ", ".join(map(str, series.cells)),
            "force over width of the largest knit [N/m]": forces[-1],
            "limit [N/m]": tends_to,
            "uncertainty of the limit [N/m]": uncertain,
            "cell": cell.name,
            "force over width of the cell [N/m]": free,
            "between grips, over free across [1]": grips,
            "force over width of the cell between grips [N/m]": grips * free,
            "the same, over the limit [1]": grips * free / tends_to,
        }


@TABLES.add(
    "shell", "An endless knit as a shell", results={"cells": several("simulation", "cell-*")}, order=5.9
)
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
        matrix, pattern = section_matrix(cells[name]), scenes[name].pattern
        scale = np.sqrt(np.diag(matrix))
        least, *_, most = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        row = {"scene": name, "cells": f"{pattern.loops} x {pattern.rows}", "yarns": made_of(scenes[name])}
        for entry, value in zip(SHELL_ENTRIES, shell_entries(matrix), strict=True):
            row[f"{entry} [{UNITS[sum(int(index) > 3 for index in entry[1:])]}]"] = value
        rows.append(row | {"least eigenvalue over largest, diagonal scaled to 1 [1]": float(least / most)})
    return pd.DataFrame(rows)
