"""Solid yarns of polynomials for ParaView: curved cells with displacement, stresses and contact pressure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.exchange.curved_cells import CELL, CurvedCells, curved_cells
from knitstudy.exchange.surface_pressure import surface_pressure
from knitstudy.exchange.unstructured_grid import write_cells
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.cauchy import cauchy_stress, principal_stresses, von_mises
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.polynomial_yarn.locate import locate
from knitstudy.mechanics.polynomial_yarn.sections import deformation_gradient, sections
from knitstudy.mechanics.polynomial_yarn.space import Space
from knitstudy.solids.polynomial_yarns import space_on, undeformed
from knitstudy.solids.yarn_spans import yarn_spans
from knitstudy.study.scene import Scene

CHUNK = 200
"""Sections evaluated at once; bounds the memory of their derivatives."""


def write_solid_yarns(scene: Scene, path: Path | str, specimen: Knit | YarnPair, history: xr.Dataset) -> None:
    """Write solid yarns as curved cells, undeformed, with what they carry at full load.

    Fields of points: ``displacement`` [m]; of the Cauchy stress ``von_mises`` and ``principal_stress`` (the largest
    first) [Pa]; where yarns touch, ``contact_pressure`` on the surface [Pa]; ``yarn`` and ``arc_length`` [m].

    Parameters
    ----------
    scene : Scene
    path : Path or str
    specimen : Knit or YarnPair
    history : Dataset
        With ``node_displacement``, the coefficients of the displacement.

    Raises
    ------
    DataFileError
        If the history is of another discretisation, or the file cannot be written.
    """
    space = space_on(scene, yarn_spans(scene, specimen))
    nodes, moved = undeformed(space, specimen), history["node_displacement"].to_numpy()
    if moved.shape != nodes.shape:
        source = history.encoding.get("source", "history")
        raise DataFileError(
            f"{source}: node_displacement has the shape {moved.shape}, but the yarns of scene {scene.name!r} have "
            f"{len(nodes)} coefficients: run the scene again"
        )
    cells = curved_cells([_breaks(yarn.spline.spans) for yarn in space.yarns])
    yarn = scene.yarn
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    places, fields, area = _fields(space, nodes, moved, cells, material)
    if "contact_pressure" in history:
        fields["contact_pressure"] = _pressure(space, nodes, cells, area, history)
    fields |= {"yarn": cells.yarn, "arc_length": cells.arc_length}
    write_cells(path, places, CELL, cells.cells, fields, {"yarn": cells.cell_yarn})


def _breaks(spans: np.ndarray) -> np.ndarray:
    return np.append(spans[:, 0], spans[-1, 1])


def _fields(
    space: Space, nodes: np.ndarray, moved: np.ndarray, cells: CurvedCells, material: Material
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Return places (P, 3), fields by name, and the surface (P,) a unit of arc length and angle, at all points."""
    turn = cells.x[:, ::-1] * [-1.0, 1.0]
    parts = []
    for number, yarn in enumerate(space.yarns):
        own = slice(*space.first_node[number : number + 2].tolist())
        stations = cells.stations[cells.of_yarn(number)]
        for low in range(0, len(stations), CHUNK):
            s = stations[low : low + CHUNK]
            place, slope = sections(yarn, nodes[own], s, cells.x)
            displacement, change = sections(yarn, moved[own], s, cells.x)
            stress = cauchy_stress(deformation_gradient(slope, change).reshape(-1, 3, 3), material)
            around = np.einsum("kqic,qc->kqi", slope[..., :2], turn)
            area = np.linalg.norm(np.cross(around, slope[..., 2]), axis=-1).ravel()
            parts.append((place, displacement, von_mises(stress), principal_stresses(stress), area))
    place, displacement, mises, principal, area = (np.concatenate(each) for each in zip(*parts, strict=True))
    fields = {"displacement": displacement.reshape(-1, 3), "von_mises": mises, "principal_stress": principal}
    return place.reshape(-1, 3), fields, area


def _pressure(
    space: Space, nodes: np.ndarray, cells: CurvedCells, area: np.ndarray, history: xr.Dataset
) -> np.ndarray:
    """Return the contact pressure (P,) at full load [Pa]."""
    last = history["contact_increment"].to_numpy() == history.sizes["increment"] - 1
    yarn, reference, pressure, share = (
        history[f"contact_{name}"].to_numpy()[last] for name in ("yarn", "reference", "pressure", "area")
    )
    x, s = locate(space, nodes, reference, yarn)
    return surface_pressure(cells, area, yarn, s, np.arctan2(x[:, 1], x[:, 0]), pressure * share)
