"""Table 5: what the three models cost, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.scene import Scene
from knitstudy.tables.reference import number, printed
from knitstudy.tables.response import NAMES

MEGABYTE = 1e6

CASES = {"dns": "dns-tie 3x3", "rom2d": "rom2d 3x3", "rom3d": "rom3d 3x3"}
"""Cases of the paper's table by fidelity, in its order."""

SOLIDS = {
    "one_point": "hexahedron, 8 nodes, 1 point",
    "incompatible_modes": "hexahedron, 8 nodes, 8 points, incompatible modes",
}
BEAM = "beam, 2 nodes, 1 point"


def build(
    dns: xr.Dataset, rom3d: xr.Dataset, rom2d: xr.Dataset, paper: pd.DataFrame, scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return size, memory and time of each model.

    Memory growth is the largest resident memory above that of the process just before the simulation. The
    degrees of freedom are counted as the paper does, before ties and joints are eliminated.

    Parameters
    ----------
    dns, rom3d, rom2d : Dataset
        Histories (see docs/architecture.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    scenes : mapping of str to Scene
        The scenes of the histories by fidelity.
    """
    histories = {"dns": dns, "rom2d": rom2d, "rom3d": rom3d}
    return pd.DataFrame([_row(f, histories[f], paper, scenes[f]) for f in CASES])


def _row(fidelity: str, history: xr.Dataset, paper: pd.DataFrame, scene: Scene) -> dict:
    case, cost = CASES[fidelity], history.attrs
    growth = cost["memory_growth"] / MEGABYTE
    memory = number(paper, "5", case, "memory")
    dof = number(paper, "5", case, "degrees of freedom")
    return {
        "model": NAMES[fidelity],
        "scene": scene.name,
        "element": SOLIDS[scene.mesh.element] if fidelity == "dns" else BEAM,
        "element, paper": printed(paper, "5", case, "mesh size")["note"],
        "mesh size [m]": scene.mesh.size if fidelity == "dns" else element_length(history),
        "mesh size, paper [m]": number(paper, "5", case, "mesh size"),
        "degrees of freedom [1]": int(cost["dof"]),
        "degrees of freedom, paper [1]": int(dof),
        "degrees of freedom over paper's [1]": cost["dof"] / dof,
        "memory growth [MB]": growth,
        "memory peak [MB]": cost["memory_peak"] / MEGABYTE,
        "memory, paper [MB]": memory,
        "memory growth over paper's [1]": growth / memory,
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
        "time [s]": cost["wall_seconds"],
    }


def element_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())
