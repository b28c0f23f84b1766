"""Meshes and fields for ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.errors import MeshError
from knitstudy.exchange.solid_yarns import write_solid_yarns
from knitstudy.exchange.unstructured_grid import write_cells
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.quality import scaled_jacobian
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.discretisation import discretised
from knitstudy.solids.tie import tie_of
from knitstudy.study.scene import Scene


def write_vtu(
    mesh: SweptMesh,
    path: Path | str,
    point_fields: Mapping[str, np.ndarray] | None = None,
    cell_fields: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write a mesh as VTU, whole or not at all.

    The yarn of every node and element, the arc length of every node (m) and the scaled Jacobian of every
    element are always among the fields.

    Parameters
    ----------
    mesh : SweptMesh
    path : Path or str
    point_fields : mapping of str to ndarray (N,) or (N, 3), optional
        For instance ``{"displacement": u}`` in m.
    cell_fields : mapping of str to ndarray (E,) or (E, c), optional

    Raises
    ------
    MeshError
        If a field has not one row a node, or an element.
    DataFileError
        If the file cannot be written.
    """
    layer = mesh.slice_of_element
    points = {
        "yarn": np.repeat(mesh.yarn_of_slice, mesh.section.size),
        "arc_length": np.repeat(mesh.arc_length, mesh.section.size),
        **_with_rows(point_fields or {}, mesh.nodes.shape[0], "nodes"),
    }
    cells = {
        "yarn": mesh.yarn_of_slice[layer],
        "scaled_jacobian": scaled_jacobian(mesh.nodes, mesh.hexahedra),
        **_with_rows(cell_fields or {}, mesh.hexahedra.shape[0], "elements"),
    }
    write_cells(path, mesh.nodes, "hexahedron", mesh.hexahedra, points, cells)


def _with_rows(fields: Mapping[str, np.ndarray], rows: int, what: str) -> dict[str, np.ndarray]:
    """Fields as arrays, refused where the number of rows is wrong."""
    arrays = {name: np.asarray(values) for name, values in fields.items()}
    for name, values in arrays.items():
        if values.ndim == 0 or values.shape[0] != rows:
            raise MeshError(f"field {name!r} has the shape {values.shape}; the {rows} {what} need a row each")
    return arrays


def write_mesh(scene: Scene, path: Path | str, mesh: xr.Dataset) -> None:
    """Write the mesh of a scene."""
    write_vtu(SweptMesh.from_dataset(mesh), path)


def write_deformed(
    scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset, history: xr.Dataset
) -> None:
    """Write the yarns of a scene and what became of them at full load.

    Of hexahedra the mesh, with tied nodes in place, and its displacement; of solid yarns what
    `knitstudy.exchange.solid_yarns.write_solid_yarns` says.
    """
    specimen = read_specimen(geometry)
    if scene.fidelity == "solid_yarns":
        write_solid_yarns(scene, path, specimen, history)
        return
    swept = SweptMesh.from_dataset(mesh)
    tie = tie_of(scene, discretised(scene, swept, specimen), specimen)
    fields = {"displacement": history["node_displacement"].to_numpy()}
    write_vtu(replace(swept, nodes=tie.nodes), path, fields)
