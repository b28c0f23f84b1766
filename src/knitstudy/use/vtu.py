"""Files for ParaView: grids (``.vtu``), and time series of all increments of a history (``.pvd``).

Hexahedra are written as they were simulated, spline yarns as curved hexahedra of 27 nodes. Fields have their unit in
the name, for instance ``displacement [m]``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from knitstudy.errors import ConfigurationError, DataFileError, MeshError
from knitstudy.files import replacing, replacing_together, write_text
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.mesh.quadratic import FACE_CENTRE, QuadraticMesh, QuadraticSection, quadratic_mesh
from knitstudy.knit.mesh.quality import scaled_jacobian
from knitstudy.knit.mesh.section import SectionMesh
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import HexahedralScene
from knitstudy.knit.models.spline_yarns import SplineScene
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.stress import hexahedral_cell_stress, stressed_points, undeformed_splines
from knitstudy.mechanics.contact.solid import principal_axes, von_mises
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.materials import Material, material_of
from knitstudy.mechanics.solids.elements import ELEMENTS
from knitstudy.mechanics.solids.elements.hexahedron import NODES
from knitstudy.mechanics.solids.spline_yarn.space import Space, locate
from knitstudy.registry import naming_extra

if TYPE_CHECKING:
    from meshio import Mesh

SHIFTED = "displacement [m]"

# Cells by their number of nodes, as meshio calls them
CELLS = {1: "vertex", 2: "line", 8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}

Fields = Mapping[str, NDArray[Any]]
NONE: Fields = MappingProxyType({})


def grid(points: Floats, cells: Ints, point_fields: Fields, cell_fields: Fields = NONE) -> Mesh:
    """Return cells (C, n), in the order of VTK, at points (P, 3) with fields (P, ...) and (C, ...)."""
    with naming_extra():
        import meshio  # here: no other job needs it, and it takes a twentieth of the imports of all

    fields = {name: [values] for name, values in cell_fields.items()}
    return meshio.Mesh(
        points, [(CELLS[cells.shape[1]], cells)], point_data=dict(point_fields), cell_data=fields
    )


def _write(what: Mesh, path: Path | str) -> None:
    """Write a grid, whole or not at all."""
    with replacing(path) as temporary:
        what.write(temporary)


def grid_of(mesh: SweptMesh | QuadraticMesh, point_fields: Fields = NONE, cell_fields: Fields = NONE) -> Mesh:
    """Return a mesh of hexahedra as a grid of meshio, which `meshio.Mesh.write` writes.

    Parameters
    ----------
    mesh : SweptMesh or QuadraticMesh
        Linear or quadratic hexahedra. The grid has their yarns, the arc lengths of nodes, and scaled Jacobians.
    point_fields : mapping of str to (N,) or (N, 3)
        Further fields of the nodes, such as ``{"displacement [m]": u}``.
    cell_fields : mapping of str to (E, ...)
        Further fields of the hexahedra.

    Raises
    ------
    MeshError
        When a field has not one row a node.
    """
    if isinstance(mesh, QuadraticMesh):
        hexahedra, yarn = mesh.elements, mesh.yarn
        arc_length = np.concatenate(mesh.arc_lengths)[mesh.station]
    else:
        hexahedra = mesh.hexahedra
        yarn = np.repeat(mesh.yarn_of_slice, mesh.section.size)
        arc_length = np.repeat(mesh.arc_length, mesh.section.size)
    points = {"yarn": yarn, "arc_length [m]": arc_length, **point_fields}
    for name, values in points.items():
        if len(values) != len(mesh.nodes):
            raise MeshError(f"field {name!r} has {len(values)} rows; the mesh has {len(mesh.nodes)} nodes")
    cells = {"yarn": yarn[hexahedra[:, 0]], "scaled_jacobian": scaled_jacobian(mesh.nodes, hexahedra[:, :8])}
    # The centres of quadratic surface faces, which contact uses, belong to no element.
    used, number = np.unique(hexahedra, return_inverse=True)
    shown = {name: values[used] for name, values in points.items()}
    return grid(mesh.nodes[used], number.reshape(hexahedra.shape), shown, cells | dict(cell_fields))


def write_mesh(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the mesh of a scene."""
    swept = SweptMesh.from_dataset(mesh)
    fabric = fabric_of(geometry)
    _write(grid_of(_elements(swept, fabric, scene.value("mesh.element"))), path)


def _elements(mesh: SweptMesh, fabric: Fabric, element: str | None) -> SweptMesh | QuadraticMesh:
    """Return the mesh that elements of a kind, a value of ``mesh.element``, make of a swept one."""
    kind: Any = ELEMENTS.find(element) if element else None
    return quadratic_mesh(mesh, fabric.centrelines) if kind and kind.nodes == NODES else mesh


def solids(scene: Scene, geometry: xr.Dataset, mesh: xr.Dataset | None, history: xr.Dataset) -> Mesh:
    """Return the undeformed yarns of a scene with their fields at full load; hexahedra take their mesh.

    Raises ConfigurationError if the history holds no displacement of nodes, and DataFileError if the displacement is
    of another discretisation.
    """
    if "node_displacement" not in history:
        raise ConfigurationError(
            "the history holds no fields of solids: run a scene of spline yarns or hexahedra with "
            "--set outputs=[fields]"
        )
    fabric = fabric_of(geometry)
    if isinstance(scene, SplineScene):
        return spline_grid(scene, fabric, history)
    assert isinstance(scene, HexahedralScene), "solids are divided in one of two ways"
    assert mesh is not None, "hexahedra have a mesh"
    swept = SweptMesh.from_dataset(mesh)
    moved = history["node_displacement"].to_numpy()
    stress = hexahedral_cell_stress(scene, swept, fabric, moved).mean
    cells = {"von_mises [Pa]": von_mises(stress), "principal_stress [Pa]": principal_axes(stress)[0]}
    return grid_of(_elements(swept, fabric, scene.mesh.element), {SHIFTED: moved}, cells)


# Spline yarns. A section is an O-grid with the middles of its edges and faces, repeated at the ends and in the middle
# of every span. A quadratic arc of 30 degrees leaves the circle by 2e-4 of the radius at most.

CORE, RINGS = 3, 1  # elements along a side of the section's core, and rings of elements around it
CHUNK = 200  # sections evaluated at once; bounds the memory of their derivatives

# Nodes of a cell in the order of VTK, of three sections of nine nodes: corners below and above; middles of edges below,
# above and between; middles of faces x, x, y, y, below, above; the centre
ORDER = [*range(4), *range(18, 22), *range(4, 8), *range(22, 26), *range(9, 13), 16, 14, 13, 15, 8, 26, 17]


@dataclass(frozen=True, eq=False)
class CurvedCells:
    """Hexahedra of 27 nodes in round yarns; nodes are numbered yarn by yarn, section by section."""

    section: SectionMesh  # corners of every section, which are the first of its points
    x: np.ndarray  # (q, 2) points of every section, over the radius
    rim: np.ndarray  # (a,) points of a section on its circle, counter-clockwise
    stations: tuple[np.ndarray, ...]  # (t,) of every yarn: arc lengths of ends and middles of its spans [m]
    cells: np.ndarray  # (C, 27) in the order of VTK

    @classmethod
    def of(cls, breaks: list[np.ndarray]) -> CurvedCells:
        """Return the cells of yarns of whose spans the ends are breaks (b,) [m], one array a yarn."""
        shape = QuadraticSection.of(SectionMesh.butterfly(CORE, RINGS))
        section = shape.section
        size = shape.section.size
        points = np.vstack([section.points, shape.middles])
        quads = np.concatenate([section.quads, size + shape.quad_edges], axis=1)
        centres = np.einsum("n,eni->ei", FACE_CENTRE, points[quads])
        quads = np.column_stack([quads, len(points) + np.arange(len(quads))])  # (e, 9)
        x = np.vstack([points, centres])
        stations = tuple(np.insert(b, np.arange(1, b.size), 0.5 * (b[1:] + b[:-1])) for b in breaks)
        first = np.cumsum([0, *(s.size for s in stations)])
        lower = np.concatenate(
            [low + np.arange(0, s.size - 1, 2) for low, s in zip(first, stations, strict=False)]
        )
        sections = lower[:, None, None, None] + np.arange(3)[:, None]
        nodes = sections * len(x) + quads[:, None]  # (spans, e, 3, 9)
        rim = np.stack([section.ring, size + shape.ring_edges], axis=-1).ravel()
        return cls(section, x, rim, stations, nodes.reshape(-1, 27)[:, ORDER])

    @cached_property
    def yarn(self) -> np.ndarray:
        """Yarn (P,) of every node."""
        return np.repeat(np.arange(len(self.stations)), [s.size * len(self.x) for s in self.stations])

    def sections(self, yarn: int) -> np.ndarray:
        """Return the nodes (t, q) of a yarn, section by section."""
        return np.flatnonzero(self.yarn == yarn).reshape(-1, len(self.x))

    def surface(self, yarn: int) -> np.ndarray:
        """Return the nodes (t, a) on the surface of a yarn, section by section."""
        return self.sections(yarn)[:, self.rim]


def spline_grid(scene: SplineScene, fabric: Fabric, history: xr.Dataset) -> Mesh:
    """Return undeformed spline yarns with their fields at full load.

    Fields of nodes: displacement; von Mises and principal values (the largest first) of the Cauchy stress; where
    yarns touch, the contact pressure on the surface; yarn and arc length.
    Raises DataFileError if the history is of another discretisation.
    """
    moved = history["node_displacement"].to_numpy()
    space, nodes = undeformed_splines(scene, fabric, moved)
    spans = (yarn.spline.spans[yarn.own] for yarn in space.yarns)
    cells = CurvedCells.of([np.append(own[:, 0], own[-1, 1]) for own in spans])
    places, fields, area = _fields(space, nodes, moved, cells, material_of(scene.yarn))
    if "contact_pressure" in history:
        fields["contact_pressure [Pa]"] = _pressure(space, nodes, cells, area, history)
    arc_length = np.repeat(np.concatenate(cells.stations), len(cells.x))
    fields |= {"yarn": cells.yarn, "arc_length [m]": arc_length}
    return grid(places, cells.cells, fields, {"yarn": cells.yarn[cells.cells[:, 0]]})


def _fields(
    space: Space, nodes: np.ndarray, moved: np.ndarray, cells: CurvedCells, material: Material
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Return places (P, 3), fields by name, and undeformed surface (P,) per arc length and angle [m/rad]."""
    turn = cells.x[:, ::-1] * [-1.0, 1.0]
    parts = []
    for number, (yarn, stations) in enumerate(zip(space.yarns, cells.stations, strict=True)):
        own = slice(*space.first_node[number : number + 2].tolist())
        for low in range(0, len(stations), CHUNK):
            s = stations[low : low + CHUNK]
            parts_of_yarn = stressed_points(yarn, (nodes[own], moved[own]), s, cells.x, material)
            slope = parts_of_yarn[2]
            stress = parts_of_yarn[4].reshape(-1, 3, 3)
            around = np.einsum("kqic,qc->kqi", slope[..., :2], turn)
            area = np.linalg.norm(np.cross(around, slope[..., 2]), axis=-1).ravel()
            places = (place.reshape(-1, 3) for place in parts_of_yarn[:2])
            parts.append((*places, von_mises(stress), principal_axes(stress)[0], area))
    place, displacement, mises, principal, area = (np.concatenate(part) for part in zip(*parts, strict=True))
    fields = {SHIFTED: displacement, "von_mises [Pa]": mises, "principal_stress [Pa]": principal}
    return place, fields, area


def _pressure(
    space: Space, nodes: np.ndarray, cells: CurvedCells, area: np.ndarray, history: xr.Dataset
) -> np.ndarray:
    """Return the contact pressure (P,) at full load [Pa], 0 within yarns.

    The force of every point of contact is shared out, bilinearly, among the four surface nodes around it.
    """
    last = history["contact_increment"].to_numpy() == history.sizes["increment"] - 1
    names = ("yarn", "reference", "pressure", "area")
    yarn, reference, pressure, share = (history[f"contact_{name}"].to_numpy()[last] for name in names)
    x, s = locate(space, nodes, reference, yarn)
    angles = np.unwrap(np.arctan2(*cells.x[cells.rim].T[::-1]))
    angle = angles[0] + np.mod(np.arctan2(x[:, 1], x[:, 0]) - angles[0], 2 * np.pi)
    width = 0.5 * (np.roll(angles, -1) - np.roll(angles, 1)) % np.pi
    closed = np.append(angles, angles[0] + 2 * np.pi)
    pressures = np.zeros(len(cells.yarn))
    for number in np.unique(yarn):
        here = yarn == number
        stations = cells.stations[number]
        surface = cells.surface(number)
        rows = _hats(stations, s[here])
        columns = _hats(closed, angle[here]).toarray()
        columns[:, 0] += columns[:, -1]
        total = rows.T @ ((pressure * share)[here, None] * columns[:, :-1])
        length = np.gradient(stations)
        length[[0, -1]] *= 0.5
        pressures[surface] = total / (area.take(surface) * length[:, None] * width)
    return pressures


def _hats(nodes: Floats, x: Floats) -> Any:
    """Return the sparse matrix (k, n) that interpolates linearly between nodes (n,) to x (k,)."""
    knots = np.concatenate([nodes[:1], nodes, nodes[-1:]])
    return BSpline.design_matrix(np.clip(x, nodes[0], nodes[-1]), knots, 1)


# Time series: yarns as lines, crossings with their forces, points in contact, and solids at full load. Points are
# undeformed and carry `SHIFTED`, for the filter Warp By Vector.

OWN = re.compile(r"(yarns|crossings|contact)-\d{4,}\.vtu")  # names of grids
NO_FIELDS = ("increment", "position", "reference", "cell", "displacement", "tied")
"""Variables of points in contact, ``contact_...``, and crossings, ``crossing_...``, that are no fields."""


def write_series(
    scene: Scene, path: Path | str, geometry: xr.Dataset, history: xr.Dataset, mesh: xr.Dataset | None = None
) -> None:
    """Write a history as ``NAME.pvd``, with its grids in the folder ``NAME``, and solids as ``NAME.vtu``.

    ``NAME.vtm`` has the grids of the last increment as blocks with names.
    Its times are strains, or load factors where strain does not increase all the way. Solids are there where the
    history holds the displacement of their nodes: with output ``fields``, at the last increment.
    Raises DataFileError if the name has another ending, or a file cannot be written.
    """
    if (path := Path(path)).suffix != ".pvd":
        raise DataFileError(f"{path}: must end with .pvd")
    earlier = [file.name for file in path.with_suffix("").glob("*.vtu") if OWN.fullmatch(file.name)]
    with replacing_together(path.parent, stale=[f"{path.stem}/{name}" for name in earlier]) as beside:
        _write_files(scene, beside / path.name, geometry, history, mesh)


def _write_files(
    scene: Scene, path: Path, geometry: xr.Dataset, history: xr.Dataset, mesh: xr.Dataset | None
) -> None:
    """Write all files of `write_series` into an empty folder."""
    crossings = fabric_of(geometry).crossings.point.mean(axis=1)
    times, meaning = times_of(history)
    entries = []
    for number, time in enumerate(times.tolist()):
        now = _yarns(history, scene.radius, number), *_points(crossings, history, number)
        for part, points, cells, fields in now:
            file = f"{path.stem}/{part}-{number:04}.vtu"
            _write(grid(points, cells, fields), path.parent / file)
            entries.append((time, part, file))
    if "node_displacement" in history and (mesh is not None or isinstance(scene, SplineScene)):
        _write(solids(scene, geometry, mesh, history), path.with_suffix(".vtu"))
        entries.append((float(times[-1]), "solids", f"{path.stem}.vtu"))
    order = {part: number for number, part in enumerate(dict.fromkeys(part for _, part, _ in entries))}
    lines = [
        f'    <DataSet timestep="{time!r}" part="{order[part]}" name="{part}" file={quoteattr(file)}/>'
        for time, part, file in entries
    ]
    comment = f"  <!-- {scene.name.replace('--', '- ')}; timestep: {meaning} -->"
    _write_list("Collection", [comment, *lines], path)
    last = {part: file for time, part, file in entries if time == entries[-1][0]}
    blocks = enumerate(last.items())
    lines = [f'    <DataSet index="{k}" name="{part}" file={quoteattr(file)}/>' for k, (part, file) in blocks]
    _write_list("vtkMultiBlockDataSet", lines, path.with_suffix(".vtm"))


def _write_list(kind: str, lines: Iterable[str], path: Path) -> None:
    """Write a file of VTK that lists other files."""
    head = f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian">'
    write_text("\n".join([head, f"  <{kind}>", *lines, f"  </{kind}>", "</VTKFile>", ""]), path)


def times_of(history: xr.Dataset) -> tuple[np.ndarray, str]:
    """Return the times (increment,) of a history, which increase, and their meaning."""
    strain = history["strain"].to_numpy()
    rises = (np.diff(strain) > 0).all()
    return (strain, "strain [1]") if rises else (history["load"].to_numpy(), "load factor [1]")


# Name, points (P, 3), cells (C, 1 or 2), fields (P, ...)
Part = tuple[str, Floats, Ints, Fields]


def _yarns(history: xr.Dataset, radius: Floats | float, number: int) -> Part:
    """Return yarns of one radius, or of their own (Y,), [m] at an increment, as lines from station to station."""
    yarn, arc_length = (history[name].to_numpy() for name in ("yarn", "arc_length"))
    order = np.lexsort((arc_length, yarn))
    first = np.flatnonzero(yarn[order][1:] == yarn[order][:-1])
    fields = {
        SHIFTED: history["centreline_displacement"].to_numpy()[number],
        "yarn": yarn,
        "arc_length [m]": arc_length,
        "radius [m]": np.broadcast_to(radius, yarn.max() + 1)[yarn],
    }
    cells = np.column_stack([order[first], order[first + 1]])
    return "yarns", history["centreline"].to_numpy(), cells, fields


def _points(crossings: Floats, history: xr.Dataset, number: int) -> Iterator[Part]:
    """Yield crossings at places (c, 3) and points in contact at an increment, where the history has them."""
    if "crossing_force" in history and history.sizes["crossing"] == len(crossings):
        now = history.isel(increment=number)
        moved = now["crossing_displacement"].to_numpy().mean(axis=1)
        yield _vertices("crossings", "crossing", crossings, moved, now)
    if "contact_position" in history:
        now = history.isel(point=history["contact_increment"].to_numpy() == number)
        place = now["contact_reference"].to_numpy()
        yield _vertices("contact", "contact", place, now["contact_position"].to_numpy() - place, now)


def _vertices(part: str, kind: str, place: Floats, moved: Floats, now: xr.Dataset) -> Part:
    """Return places (k, 3) that moved (k, 3) [m] with the variables ``kind_...``, with units in their names."""
    fields = {SHIFTED: moved}
    for name in map(str, now.data_vars):
        short = name.removeprefix(f"{kind}_")
        if short != name and short not in NO_FIELDS:
            unit = now[name].attrs.get("units", "1")
            fields[f"{short} [{unit}]".removesuffix(" [1]")] = now[name].to_numpy()
    return part, place, np.arange(len(place))[:, None], fields
