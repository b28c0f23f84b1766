"""An endless knit as a shell: membrane, coupling and bending stiffness."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.exchange.inp import SHELL_ENTRIES, section_matrix, shell_entries
from knitstudy.measures.discretisation import made_of
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

UNITS = {0: "N/m", 1: "N", 2: "N m"}
"""By how many of an entry's row and column are of bending."""

AT_REST = ("knit", "pattern", "yarn", "mesh", "tie")
"""What the stiffness at rest depends on: cells that share it have the same."""


@TABLES.add("shell", "An endless knit as a shell", needs=("cells", "scenes"), order=5.9)
def tabulate(cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
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
    return UNITS[sum(int(index) > 3 for index in entry[1:])]


def _definite(matrix: np.ndarray) -> float:
    """Return the least eigenvalue over the largest one, each strain measured so that the diagonal is 1."""
    scale = np.sqrt(np.diag(matrix))
    values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    return float(values[0] / values[-1])
