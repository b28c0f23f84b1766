"""The stiffness of a cell as a shell section of Abaqus."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.exchange.dialects.dialect import NUMBER
from knitstudy.files import code_version, replacing
from knitstudy.study.scene import Scene

ENTRIES_PER_LINE = 8

NAMES = tuple(f"D{row + 1}{column + 1}" for column in range(6) for row in range(column + 1))
"""The 21 numbers of a symmetric section in their order: column by column, each down to the diagonal."""


def section_matrix(history: xr.Dataset) -> np.ndarray:
    """Return the stiffness (6, 6) of a cell at rest [N/m, N, N m], by e_x, e_y, g_xy, k_x, k_y, k_xy."""
    membrane, coupling, bending = (
        history[f"{name}_stiffness"].to_numpy() for name in ("membrane", "coupling", "bending")
    )
    return np.block([[membrane, coupling], [coupling.T, bending]])


def entries(matrix: np.ndarray) -> np.ndarray:
    """Return the 21 numbers of a symmetric section (6, 6) in the order of `NAMES`."""
    return np.concatenate([matrix[: column + 1, column] for column in range(6)])


def write_deck(scene: Scene, path: Path | str, history: xr.Dataset) -> None:
    """Write one square shell element with the section of a cell: a model to take the section from.

    Parameters
    ----------
    scene : Scene
    path : Path or str
    history : Dataset
        Of the cell.
    """
    numbers = entries(section_matrix(history))
    lines = [numbers[i : i + ENTRIES_PER_LINE] for i in range(0, len(numbers), ENTRIES_PER_LINE)]
    data = "".join(", ".join(NUMBER % value for value in line) + "\n" for line in lines)
    corners = "1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n"
    with replacing(path) as temporary:
        Path(temporary).write_text(
            f"*HEADING\n{scene.name}: an endless knit as a shell\n** knitstudy {code_version()}; m, N\n"
            "** Local 1 is the course direction, 2 the wale direction; the plane of reference is z = 0 of the loop.\n"
            "** Strains e1, e2, g12 and curvatures k1, k2, k12 = 2 x twist; tension at z > 0 goes with k > 0.\n"
            "** A Kirchhoff section: what shear across a shear-flexible element yields is Abaqus's own estimate.\n"
            f"*NODE, NSET=ALL\n{corners}*ELEMENT, TYPE=S4R, ELSET=KNIT\n1, 1, 2, 3, 4\n"
            "*ORIENTATION, NAME=COURSE\n1, 0, 0, 0, 1, 0\n3, 0\n"
            f"** {', '.join(NAMES)}\n"
            f"*SHELL GENERAL SECTION, ELSET=KNIT, ORIENTATION=COURSE\n{data}",
            encoding="ascii",
        )
