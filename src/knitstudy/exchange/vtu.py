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
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.elements.quadratic import NODES
from knitstudy.mesh.quadratic import QuadraticMesh, quadratic_mesh
from knitstudy.mesh.quality import scaled_jacobian
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.hexahedra import divide
from knitstudy.solids.tie import tie_of
from knitstudy.study.scene import Scene

CELLS = {8: "hexahedron", 20: "hexahedron20"}
"""Cells by their number of nodes, as meshio has them."""


def write_vtu(
    mesh: SweptMesh | QuadraticMesh,
    path: Path | str,
    point_fields: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write a mesh of linear or quadratic hexahedra as VTU, whole or not at all.

    The yarn of every node and element, the arc length of every node (m) and the scaled Jacobian of every
    element are always among the fields.

    Parameters
    ----------
    mesh : SweptMesh or QuadraticMesh
    path : Path or str
    point_fields : mapping of str to ndarray (N,) or (N, 3), optional
        For instance ``{"displacement": u}`` in m.

    Raises
    ------
    MeshError
        If a field has not one row a node.
    DataFileError
        If the file cannot be written.
    """
    if isinstance(mesh, QuadraticMesh):
        hexahedra, yarn = mesh.elements, mesh.yarn
        arc_length = np.concatenate(mesh.arc_lengths)[mesh.station]
    else:
        hexahedra, yarn = mesh.hexahedra, np.repeat(mesh.yarn_of_slice, mesh.section.size)
        arc_length = np.repeat(mesh.arc_length, mesh.section.size)
    points = {
        "yarn": yarn,
        "arc_length": arc_length,
        **_with_rows(point_fields or {}, len(mesh.nodes)),
    }
    cells = {
        "yarn": yarn[hexahedra[:, 0]],
        "scaled_jacobian": scaled_jacobian(mesh.nodes, hexahedra[:, :8]),
    }
    # Nodes that depend on others for the sake of contact belong to no element.
    used, number = np.unique(hexahedra, return_inverse=True)
    shown = {name: values[used] for name, values in points.items()}
    kind = CELLS[hexahedra.shape[1]]
    write_cells(path, mesh.nodes[used], kind, number.reshape(hexahedra.shape), shown, cells)


def _with_rows(fields: Mapping[str, np.ndarray], rows: int) -> dict[str, np.ndarray]:
    """Fields as arrays, refused where the number of rows is wrong."""
    arrays = {name: np.asarray(values) for name, values in fields.items()}
    for name, values in arrays.items():
        if values.ndim == 0 or values.shape[0] != rows:
            raise MeshError(f"field {name!r} has the shape {values.shape}; the {rows} nodes need a row each")
    return arrays


def write_mesh(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the mesh of a scene."""
    write_vtu(_mesh_of(scene, SweptMesh.from_dataset(mesh), read_specimen(geometry)), path)


def _mesh_of(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> SweptMesh | QuadraticMesh:
    """Return the mesh that the elements of a scene make of a swept one."""
    element = scene.value("mesh.element")
    quadratic = element is not None and ELEMENTS.find(element).nodes == NODES
    return quadratic_mesh(mesh, specimen.centrelines) if quadratic else mesh


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
    tie = tie_of(scene, divide(scene, swept, specimen), specimen)
    fields = {"displacement": history["node_displacement"].to_numpy()}
    write_vtu(replace(_mesh_of(scene, swept, specimen), nodes=tie.nodes), path, fields)
