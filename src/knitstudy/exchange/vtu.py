"""VTU files for ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import meshio
import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError, MeshError
from knitstudy.files import replacing
from knitstudy.geometry.lay_out import read_specimen
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.elements.quadratic import NODES
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.solid import cauchy_stress, principal_stresses, von_mises
from knitstudy.mechanics.spline_yarn.sampling import locate
from knitstudy.mechanics.spline_yarn.space import Space, deformation_gradient, sections
from knitstudy.mesh.quadratic import FACE_CENTRE, QuadraticMesh, QuadraticSection, quadratic_mesh
from knitstudy.mesh.quality import scaled_jacobian
from knitstudy.mesh.section import Section
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.hexahedra import divide
from knitstudy.models.spline_yarns import space_on, undeformed, yarn_spans
from knitstudy.models.ties import tie_of
from knitstudy.study.scene import Scene

# ---- Cells with fields, in the XML format of VTK that ParaView opens


def write_cells(
    path: Path | str,
    points: np.ndarray,
    kind: str,
    cells: np.ndarray,
    point_fields: Mapping[str, np.ndarray],
    cell_fields: Mapping[str, np.ndarray],
) -> None:
    """Write cells of one kind as VTU, whole or not at all.

    Parameters
    ----------
    path : Path or str
    points : ndarray, shape (P, 3)
        Undeformed [m].
    kind : str
        As meshio has it: hexahedron, hexahedron20, hexahedron27.
    cells : ndarray of int, shape (C, n)
        Points of every cell, in the order of VTK.
    point_fields, cell_fields : mapping of str to ndarray (P, ...), (C, ...)

    Raises
    ------
    DataFileError
        If the file cannot be written.
    """
    fields = {name: [values] for name, values in cell_fields.items()}
    grid = meshio.Mesh(points, [(kind, cells)], point_data=dict(point_fields), cell_data=fields)
    with replacing(path) as temporary:
        grid.write(temporary)


# ---- Pressure of contact on the surface points of yarns, from the points at which contact was computed


def surface_pressure(
    cells: CurvedCells,
    area: np.ndarray,
    yarn: np.ndarray,
    s: np.ndarray,
    angle: np.ndarray,
    force: np.ndarray,
) -> np.ndarray:
    """Return the pressure (P,) [Pa] at all points of cells, 0 within yarns.

    Between neighbours on the surface it is bilinear, and every point of contact is shared out among the four around it:
    what the surface carries is what was computed, on a patch that is at least as wide as the drawn points are apart.

    Parameters
    ----------
    cells : CurvedCells
    area : ndarray, shape (P,)
        Undeformed surface a unit of arc length and of angle [m/rad]; read on the surface alone.
    yarn : ndarray of int, shape (k,)
        That every point of contact lies on.
    s, angle : ndarray, shape (k,)
        Its arc length [m], and its angle in the section [rad].
    force : ndarray, shape (k,)
        Pressure times the undeformed area that it stands for [N].
    """
    pressure = np.zeros(len(cells.stations) * len(cells.x))
    step = 0.5 * (np.roll(cells.angle, -1) - np.roll(cells.angle, 1)) % np.pi
    turned = cells.angle[0] + np.mod(angle - cells.angle[0], 2 * np.pi)
    closed = np.append(cells.angle, cells.angle[0] + 2 * np.pi)
    for number in np.unique(yarn):
        here = np.flatnonzero(yarn == number)
        grid = cells.surface(number)
        stations = cells.stations[cells.of_yarn(number)]
        row, up = _between(stations, s[here])
        column, round_ = _between(closed, turned[here])
        total = np.zeros(grid.shape)
        for i, along in ((0, 1 - up), (1, up)):
            for j, around in ((0, 1 - round_), (1, round_)):
                np.add.at(total, (row + i, (column + j) % grid.shape[1]), along * around * force[here])
        length = np.gradient(stations) * np.where(np.isin(stations, stations[[0, -1]]), 0.5, 1.0)
        pressure[grid] = total / (area[grid] * length[:, None] * step)
    return pressure


def _between(knots: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the number (k,) of the knot before every value, and the share (k,) of the way to the next one."""
    before = np.clip(np.searchsorted(knots, value, side="right") - 1, 0, len(knots) - 2)
    share = (value - knots[before]) / (knots[before + 1] - knots[before])
    return before, np.clip(share, 0.0, 1.0)


# ---- Round yarns as curved cells: hexahedra of 27 nodes, the surface ones on the true circle
# A section is an O-grid with the middles of its edges and faces, repeated at the ends and in the middle of every span.
# With 12 angles a quadratic arc of 30 degrees leaves the circle by 2e-4 of the radius at most: what is drawn is smooth,
# and not a mesh that anything was computed on.


CORE, RINGS = 3, 1
"""Of the section; see `knitstudy.mesh.section.Section.butterfly`."""

CELL = "hexahedron27"
"""What meshio calls it; VTK_TRIQUADRATIC_HEXAHEDRON."""

CURVED_NODES = 27


@dataclass(frozen=True, eq=False)
class CurvedCells:
    """Cells of yarns, and the material points that their nodes are; numbered yarn by yarn, section by section.

    Attributes
    ----------
    x : ndarray, shape (q, 2)
        Points of every section, over the radius.
    cells : ndarray of int32, shape (C, 27)
        In the order of VTK.
    first : ndarray of int, shape (Y + 1,)
        First section of every yarn, then their number.
    stations : ndarray, shape (T,)
        Arc lengths of the sections [m].
    rim : ndarray of int, shape (2 a,)
        Points of a section that lie on its circle, counter-clockwise from angle[0].
    angle : ndarray, shape (2 a,)
        Their angles, increasing [rad].
    """

    x: np.ndarray
    cells: np.ndarray
    first: np.ndarray
    stations: np.ndarray
    rim: np.ndarray
    angle: np.ndarray

    @property
    def yarn(self) -> np.ndarray:
        """Yarn (P,) of every point."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first) * len(self.x))

    @property
    def arc_length(self) -> np.ndarray:
        """Arc length (P,) of every point's section [m]."""
        return np.repeat(self.stations, len(self.x))

    @property
    def cell_yarn(self) -> np.ndarray:
        """Yarn (C,) of every cell."""
        return self.yarn[self.cells[:, 0]]

    def of_yarn(self, yarn: int) -> slice:
        """Return the sections of a yarn."""
        return slice(*self.first[yarn : yarn + 2].tolist())

    def surface(self, yarn: int) -> np.ndarray:
        """Return the points (t, 2 a) on the surface of a yarn, section by section."""
        return np.arange(len(self.stations))[self.of_yarn(yarn), None] * len(self.x) + self.rim


def curved_cells(breaks: list[np.ndarray]) -> CurvedCells:
    """Return the cells of yarns of whose spans the ends are breaks (b,) [m], one array a yarn."""
    shape = QuadraticSection.of(Section.butterfly(CORE, RINGS))
    x, quads = _nine_nodes(shape)
    stations = [np.insert(b, np.arange(1, b.size), 0.5 * (b[1:] + b[:-1])) for b in breaks]
    first = np.concatenate([[0], np.cumsum([s.size for s in stations])])
    lower = np.concatenate(
        [low + 2 * np.arange(b.size - 1) for low, b in zip(first[:-1], breaks, strict=True)]
    )
    bottom, middle, top = ((lower + up)[:, None, None] * len(x) + quads for up in range(3))  # (spans, e, 9)
    # Corners below and above; middles of edges below, above and between; faces x, x, y, y, below, above; the centre.
    sides = middle[..., [7, 5, 4, 6]]
    parts = [bottom[..., :4], top[..., :4], bottom[..., 4:8], top[..., 4:8], middle[..., :4], sides]
    cells = np.concatenate([*parts, bottom[..., 8:], top[..., 8:], middle[..., 8:]], axis=-1)
    rim = np.stack([shape.section.ring, shape.section.size + shape.ring_edges], axis=-1).ravel()
    return CurvedCells(
        x=x,
        cells=cells.reshape(-1, CURVED_NODES).astype(np.int32),
        first=first,
        stations=np.concatenate(stations),
        rim=rim,
        angle=np.unwrap(np.arctan2(*x[rim].T[::-1])),
    )


def _nine_nodes(shape: QuadraticSection) -> tuple[np.ndarray, np.ndarray]:
    """Points (q + m + e, 2) of a section, and its quads (e, 9): corners, middles of edges, centre."""
    section = shape.section
    q, m = section.size, len(shape.middles)
    eight = np.concatenate([section.quads, q + shape.quad_edges], axis=1)
    points = np.vstack([section.points, shape.middles])
    centres = np.einsum("n,eni->ei", FACE_CENTRE, points[eight])
    number = q + m + np.arange(len(eight))
    return np.vstack([points, centres]), np.concatenate([eight, number[:, None]], axis=1)


# ---- Solid yarns of polynomials for ParaView: curved cells with displacement, stresses and contact pressure


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


# ---- Meshes and fields for ParaView


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
    `knitstudy.exchange.vtu.write_solid_yarns` says.
    """
    specimen = read_specimen(geometry)
    if scene.fidelity == "spline_yarns":
        write_solid_yarns(scene, path, specimen, history)
        return
    swept = SweptMesh.from_dataset(mesh)
    tie = tie_of(scene, divide(scene, swept, specimen), specimen)
    fields = {"displacement": history["node_displacement"].to_numpy()}
    write_vtu(replace(_mesh_of(scene, swept, specimen), nodes=tie.nodes), path, fields)
