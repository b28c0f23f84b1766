"""The endless knit: one cell, the limit of square knits, and its stiffness as a shell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.exchange.inp import SHELL_ENTRIES, section_matrix, shell_entries
from knitstudy.loading.load_path import DIRECTIONS
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.domain import Series, force_per_width, series_of
from knitstudy.measures.endless_knit import Moduli, between_grips, cell_of, limit, moduli
from knitstudy.measures.response import increment_at
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

# ---- Forces per width and moduli of an endless knit, from one cell that repeats itself


STRAINS = ["course strain [1]", "wale strain [1]", "angle of shear [rad]"]

FORCES = ["course force over width [N/m]", "wale force over width [N/m]", "shear force over width [N/m]"]

AXIS = {"course": 0, "wale": 1, "biaxial": 0, "shear": 2}
"""Strain and force of secant and tangent, by ``load.deformation``: of a biaxial stretch those in course direction."""

UNKNOWN = Moduli(*(5 * [np.nan]))
"""Of yarns that are not tied: at rest they do not touch."""

CONTRACTS = {"course": (1, 0), "wale": (0, 1)}
"""Strain across, and strain along, of a pull that leaves the other free."""


@TABLES.add("cell", "Forces per width of an endless knit", needs=("cells", "scenes"), order=5.8)
def tabulate_cells(cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row for every cell.

    Parameters
    ----------
    cells : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    return pd.DataFrame([_row_of_cell(scenes[name], history) for name, history in cells.items()])


def _row_of_cell(scene: Scene, history: xr.Dataset) -> dict:
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


# ---- What square knits tend to as they grow, and one cell of the endless knit between grips


OF_LIMITS = [
    "direction",
    "yarns",
    "strain [1]",
    "cells in a row [1]",
    "force over width of the largest knit [N/m]",
    "limit [N/m]",
    "uncertainty of the limit [N/m]",
    "cell",
    "force over width of the cell [N/m]",
    "between grips, over free across [1]",
    "force over width of the cell between grips [N/m]",
    "the same, over the limit [1]",
]


@TABLES.add(
    "endless_knit",
    "One cell of an endless knit beside tied square knits of rising size",
    needs=("squares", "cells", "scenes"),
    order=5.85,
)
def tabulate_limits(
    squares: Mapping[str, xr.Dataset], cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return a row for the first and the last strain that all knits of a tied series and its cell were pulled to.

    Parameters
    ----------
    squares, cells : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    tied = [cell for name, cell in scenes.items() if name in cells and not cell.kind.interaction.touches]
    rows = []
    for series in series_of(scenes[name] for name in squares):
        if cell := cell_of(series, tied):
            rows += _rows_of_limits(series, squares, cell, cells[cell.name])
    return pd.DataFrame(rows, columns=OF_LIMITS)


def _rows_of_limits(
    series: Series, histories: Mapping[str, xr.Dataset], cell: Scene, history: xr.Dataset
) -> Iterator[tuple]:
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
        yield (
            cell.load.deformation,
            series.model,
            strain,
            ", ".join(map(str, series.cells)),
            forces[-1],
            tends_to,
            uncertain,
            cell.name,
            free,
            grips,
            grips * free,
            grips * free / tends_to,
        )


# ---- An endless knit as a shell: membrane, coupling and bending stiffness


UNITS_OF_ENTRIES = {0: "N/m", 1: "N", 2: "N m"}
"""By how many of an entry's row and column are of bending."""

AT_REST = ("knit", "pattern", "yarn", "mesh", "tie")
"""What the stiffness at rest depends on: cells that share it have the same."""


@TABLES.add("shell", "An endless knit as a shell", needs=("cells", "scenes"), order=5.9)
def tabulate_shells(cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row for every cell that differs at rest: the symmetric stiffness in the order of Abaqus.

    Rows and columns 1 to 3 are the strains in the plane, course, wale and shear, 4 to 6 the curvatures; the plane of
    reference is z = 0 of the loop.

    Parameters
    ----------
    cells : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    first: dict[str, str] = {}
    for name, scene in scenes.items():
        if scene.kind.interaction.touches:
            continue  # before its yarns touch a knit is no shell
        first.setdefault(str(scene.read(AT_REST)), name)
    rows = []
    for name in first.values():
        matrix = section_matrix(cells[name])
        rows.append(
            {
                "scene": name,
                "cells": f"{scenes[name].pattern.loops} x {scenes[name].pattern.rows}",
                "yarns": made_of(scenes[name]),
            }
            | {
                f"{entry} [{_unit(entry)}]": value
                for entry, value in zip(SHELL_ENTRIES, shell_entries(matrix), strict=True)
            }
            | {"least eigenvalue over largest, diagonal scaled to 1 [1]": _definite(matrix)}
        )
    return pd.DataFrame(rows)


def _unit(entry: str) -> str:
    return UNITS_OF_ENTRIES[sum(int(index) > 3 for index in entry[1:])]


def _definite(matrix: np.ndarray) -> float:
    """Return the least eigenvalue over the largest one, each strain measured so that the diagonal is 1."""
    scale = np.sqrt(np.diag(matrix))
    values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    return float(values[0] / values[-1])
