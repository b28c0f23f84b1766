"""Mean stress of cells, pieces and segments of solid yarns at full load (section 3.4 of the paper).

The Cauchy stress is averaged over deformed volume. A segment is all of the yarns between the crossings at its two ends,
both yarns where two share a segment. The maximum principal stress is the largest by value, and its direction an axis in
space; `segment_rotation`, the rotation of the affine motion that fits the segment best, takes it back to the undeformed
knit (docs/theory/theory.md).

In hexahedra with nodes x_a and internal forces f_a, sum_a f_a (x) x_a is the integral of P F^T over the undeformed
element, that is, of the Cauchy stress over the deformed one, whatever the quadrature and the inner modes. Hourglass
control adds a term of second order in the displacements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from knitstudy.errors import DataFileError
from knitstudy.knit.contacts.segments import KINDS, NO_SEGMENT, Segments, segments
from knitstudy.knit.geometry.columns import STRESSES
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.mesh.section import SectionMesh
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import HexahedralScene
from knitstudy.knit.models.hexahedra.build import divide
from knitstudy.knit.models.spline_yarns import SplineScene
from knitstudy.knit.models.spline_yarns.build import undeformed_yarns
from knitstudy.mechanics.contact.solid import cauchy_stress, principal_axes
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import VOIGT, Material, axes_along, material_of
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.spline_yarn.space import Space, YarnSpace, deformation_gradient, sections


@dataclass(frozen=True, eq=False)
class CellStress:
    """Stress in the hexahedra of the mesh of a scene, in its order, for any discretisation."""

    integral: Floats  # (E, 3, 3) of the Cauchy stress over the deformed cell [N m]
    volume: Floats  # (E,) of the deformed cell [m3]
    reference: Floats  # (E, 3) middle of the undeformed cell [m]
    place: Floats  # (E, 3) middle of the deformed cell [m]

    @property
    def mean(self) -> Floats:
        """Mean Cauchy stress (E, 3, 3) [Pa]."""
        return self.integral / self.volume[:, None, None]


CHUNK = 4096  # elements that answer at once; bounds the memory
LAYERS = 100  # layers of cells of splines evaluated at once; bounds the memory of their derivatives
CORNERS = 8  # nodes of an element whose mean is its middle; those at the middles of edges follow them
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3)  # places on (-1, 1) of two points, each of weight 1
EXTENTS = {
    "whole": 1.0,
    "middle": 0.5,
}  # share of every piece of yarn, about its middle, that is averaged over


def hexahedral_cell_stress(
    scene: HexahedralScene, mesh: SweptMesh, specimen: Fabric, displacement: Floats
) -> CellStress:
    """Return the stress in every element from the displacement (N, 3) of the nodes [m]."""
    parts = divide(scene, mesh, specimen)
    nodes = parts.nodes
    moved = nodes + displacement
    (group,), (after,) = parts.groups(nodes), parts.groups(moved)
    corners = group.connectivity[:, :CORNERS]
    return CellStress(
        integral=_stress_integral(group, nodes, displacement),
        volume=after.elements.volume,
        reference=nodes[corners].mean(axis=1),
        place=moved[corners].mean(axis=1),
    )


def _stress_integral(group: ElementGroup, nodes: Floats, displacement: Floats) -> Floats:
    """Return the integrals (E, 3, 3) of the Cauchy stress over deformed elements [N m], from nodes (N, 3) [m]."""
    count = len(group.connectivity)
    integral = np.empty((count, 3, 3))
    for first in range(0, count, CHUNK):
        batch = slice(first, min(first + CHUNK, count))
        own = group.connectivity[batch]
        force = group.elements.respond(batch, displacement[own], False).force
        integral[batch] = np.swapaxes(force, 1, 2) @ (nodes + displacement)[own]
    return 0.5 * (integral + np.swapaxes(integral, 1, 2))  # symmetric but for rounding


def undeformed_splines(scene: SplineScene, specimen: Fabric, displacement: Floats) -> tuple[Space, Floats]:
    """Return the space of a scene's spline yarns and their undeformed nodes (N, 3) [m].

    Raises DataFileError if coefficients of a displacement belong to another discretisation.
    """
    space, nodes, _ = undeformed_yarns(scene, specimen)
    if displacement.shape != nodes.shape:
        raise DataFileError(
            f"node_displacement has the shape {displacement.shape}, but the yarns of scene {scene.name!r} have "
            f"{len(nodes)} coefficients: run the scene again"
        )
    return space, nodes


def stressed_points(
    yarn: YarnSpace,
    nodes: tuple[Floats, Floats],  # undeformed, and their displacement (n, 3) [m]
    s: Floats,  # (k,) arc lengths of sections [m]
    x: Floats,  # (q, 2) points of a section, over the radius
    material: Material,
) -> tuple[Floats, ...]:
    """Return places, displacements (k, q, 3), slopes of places, gradients and Cauchy stresses (k, q, 3, 3)."""
    (place, slope), (displacement, change) = (sections(yarn, node, s, x) for node in nodes)
    gradient = deformation_gradient(slope, change)
    axes = axes_along(slope[..., 2].reshape(-1, 3))
    stress = cauchy_stress(gradient.reshape(-1, 3, 3), material, axes).reshape(gradient.shape)
    return place, displacement, slope, gradient, stress


def spline_cell_stress(
    scene: SplineScene, mesh: SweptMesh, specimen: Fabric, displacement: Floats
) -> CellStress:
    """Return the stress in every cell from the coefficients (N, 3) of the displacement [m].

    Raises DataFileError if the displacement is of another discretisation.
    """
    space, nodes = undeformed_splines(scene, specimen, displacement)
    material = material_of(scene.yarn)
    parts = []
    for number, (own, stations) in enumerate(zip(space.yarns, mesh.stations, strict=True)):
        here = slice(*space.first_node[number : number + 2].tolist())
        for low in range(0, len(stations) - 1, LAYERS):
            breaks = stations[low : low + LAYERS + 1]
            parts.append(_layers(own, (nodes[here], displacement[here]), breaks, mesh.section, material))
    return CellStress(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _layers(
    yarn: YarnSpace,
    nodes: tuple[Floats, Floats],
    breaks: Floats,
    section: SectionMesh,
    material: Material,
) -> tuple[Floats, ...]:
    """Return integral (k e, 3, 3), volume (k e,), middle and deformed middle (k e, 3) of the cells of k layers."""
    x, area = _section_points(section)
    rise = np.diff(breaks)
    s = (breaks[:-1, None] + 0.5 * rise[:, None] * (1 + GAUSS)).ravel()
    place, moved, slope, gradient, stress = stressed_points(yarn, nodes, s, x, material)
    weight = np.repeat(0.5 * rise, len(GAUSS))[:, None] * area * np.linalg.det(slope)
    after = weight * np.linalg.det(gradient)

    def summed(values: Floats) -> Floats:
        """Sum over the points of every cell: two along, four across."""
        split = values.reshape(len(rise), len(GAUSS), len(section.quads), len(GAUSS) ** 2, *values.shape[2:])
        return split.sum(axis=(1, 3)).reshape(-1, *values.shape[2:])

    before, volume = summed(weight), summed(after)
    middle = summed(weight[..., None] * place) / before[:, None]
    now = summed(after[..., None] * (place + moved)) / volume[:, None]
    return summed(after[..., None, None] * stress), volume, middle, now


def _section_points(section: SectionMesh) -> tuple[Floats, Floats]:
    """Return four points (4 e, 2) in every quad of a section, quad by quad, and their areas (4 e,), over the radius."""
    u, v = (grid.ravel() for grid in np.meshgrid(GAUSS, GAUSS, indexing="ij"))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    one, other = 1 + signs[:, :1] * u, 1 + signs[:, 1:] * v  # (4 corners, 4 points)
    corner = section.points[section.quads]  # (e, 4, 2)
    by_u, by_v = (
        np.einsum("eni,np->epi", corner, slope)
        for slope in (0.25 * signs[:, :1] * other, 0.25 * one * signs[:, 1:])
    )
    area = by_u[..., 0] * by_v[..., 1] - by_u[..., 1] * by_v[..., 0]
    return np.einsum("eni,np->epi", corner, 0.25 * one * other).reshape(-1, 2), area.ravel()


def stress(
    scene: HexahedralScene | SplineScene, geometry: xr.Dataset, mesh: xr.Dataset, history: xr.Dataset
) -> xr.Dataset:
    """Return the stresses of a scene, in the format of docs/reference/files.md.

    Raises DataFileError if the history holds no displacement of nodes, or that of another discretisation.
    """
    if "node_displacement" not in history:
        raise DataFileError(
            "the history holds no node_displacement, which stresses come from: the scene's outputs must hold 'fields'"
        )
    fabric = fabric_of(geometry)
    swept = SweptMesh.from_dataset(mesh)
    moved = history["node_displacement"].to_numpy()
    if isinstance(scene, HexahedralScene):
        cells = hexahedral_cell_stress(scene, swept, fabric, moved)
    else:
        cells = spline_cell_stress(scene, swept, fabric, moved)
    parts = segments(fabric.crossings, np.array([centreline.length for centreline in fabric.centrelines]))
    values = {
        "cell_stress": cells.mean[:, VOIGT[:, 0], VOIGT[:, 1]],
        "cell_volume": cells.volume,
        "cell_place": cells.place,
        "cell_yarn": swept.yarn_of_slice[swept.slice_of_element].astype(np.int32),
        "piece_yarn": parts.yarn,
        "piece_arc_length": parts.arc_length,
        "piece_segment": parts.of_piece,
        "segment_kind": parts.kind,
        "segment_row": parts.row,
        "segment_column": parts.column,
        "segment_central": parts.central.astype(np.int8),
        **averages(parts, swept, cells),
    }
    return xr.Dataset(
        STRESSES.variables(values),
        coords={"extent": list(EXTENTS), "xyz": list("xyz"), "kind_of_segment": list(KINDS)},
        attrs={
            "strain": float(history["strain"][-1]),
            "force": float(history["force"][-1]),
            "direction": scene.value("load.direction"),
        },
    )


def averages(parts: Segments, mesh: SweptMesh, cells: CellStress) -> dict[str, Floats]:
    """Return stresses, principal values, axes, volumes and rotations of pieces and segments, by name."""
    volume, integral, moments = _of_pieces(parts, mesh, cells)
    inside = np.flatnonzero(parts.of_piece != NO_SEGMENT)

    def of_segments(values: Floats) -> Floats:
        total = np.zeros((len(parts.kind), *values.shape[1:]))
        np.add.at(total, parts.of_piece[inside], values[inside])
        return total

    segment_volume = of_segments(volume)
    mean = of_segments(integral) / segment_volume[..., None, None]
    value, axis = principal_axes(mean)
    return {
        "piece_stress": integral / volume[..., None, None],
        "piece_volume": volume,
        "segment_stress": mean,
        "segment_volume": segment_volume,
        "segment_principal": value,
        "segment_axis": axis,
        "segment_rotation": _rotations(of_segments(moments)),
    }


def _of_pieces(parts: Segments, mesh: SweptMesh, cells: CellStress) -> tuple[Floats, Floats, Floats]:
    """Return volume (P, x), integral of the stress (P, x, 3, 3) and moments (P, 4, 7) of pieces, for extents x.

    A piece takes its share of the layer of cells that it ends in. Moments are sums over cells of [1, X] (x) [1, X, x]
    by volume, for the best affine motion of a whole piece.
    """
    one = np.ones((len(cells.volume), 1))
    before = np.concatenate([one, cells.reference], axis=1)
    both = np.concatenate([before, cells.place], axis=1)
    moments = cells.volume[:, None, None] * before[:, :, None] * both[:, None]
    flat = np.concatenate(
        [cells.volume[:, None], cells.integral.reshape(-1, 9), moments.reshape(-1, 28)], axis=1
    )
    layers = flat.reshape(-1, len(mesh.section.quads), flat.shape[1]).sum(axis=1)
    means = np.empty((len(parts.yarn), len(EXTENTS), flat.shape[1]))
    last = np.cumsum(np.diff(mesh.first_slice) - 1)
    for yarn, (stations, end) in enumerate(zip(mesh.stations, last, strict=True)):
        own = layers[end - len(stations) + 1 : end]
        sums = np.concatenate([np.zeros((1, own.shape[1])), own.cumsum(axis=0)])
        upto = make_interp_spline(stations, sums, k=1)
        here = parts.yarn == yarn
        low, high = parts.arc_length[here].T
        for i, share in enumerate(EXTENTS.values()):
            half = 0.5 * share * (high - low)
            middle = 0.5 * (low + high)
            means[here, i] = upto(middle + half) - upto(middle - half)
    return means[..., 0], means[..., 1:10].reshape(*means.shape[:2], 3, 3), means[:, 0, 10:].reshape(-1, 4, 7)


def _rotations(moments: Floats) -> Floats:
    """Return the rotations (Q, 3, 3) of the affine motions that fit places best, from their moments (Q, 4, 7)."""
    volume = moments[:, :1, :1]
    first = moments[:, 0, 1:4] / volume[:, 0]
    now = moments[:, 0, 4:] / volume[:, 0]
    spread = moments[:, 1:, 1:4] / volume - first[:, :, None] * first[:, None]
    across = moments[:, 1:, 4:] / volume - first[:, :, None] * now[:, None]
    gradient = np.swapaxes(np.linalg.solve(spread, across), 1, 2)
    left, _, right = np.linalg.svd(gradient)
    return left @ right
