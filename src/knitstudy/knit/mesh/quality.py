"""Gates that a mesh must pass: memory before it is made, bending, folding and overlap before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import psutil
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.mesh.section import nodes_for_size
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.core.arrays import Floats

OVERLAP_TOLERANCE = 0.01  # share of the diameter; the optimised geometry is twenty times as exact
SAMPLES_PER_DIAMETER = 50  # along yarn in the search for overlaps: distances are then exact to 1e-4
AT_ONCE = 16_384  # elements, or points whose neighbours are held, at a time

# Per corner of a VTK hexahedron, the corners at the other ends of its three edges, right-handed.
_EDGES = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])


def scaled_jacobian(nodes: Floats, hexahedra: NDArray[np.integer]) -> Floats:
    """Smallest scaled Jacobian (E,) of hexahedra (E, 8) in VTK order: 1 with right angles, 0 or less if folded.

    At each corner it is the triple product of the edge vectors over the product of their lengths (Knupp 2000,
    "Achieving finite element mesh quality via optimization of the Jacobian matrix norm and associated
    quantities", part II, International Journal for Numerical Methods in Engineering 48).

    Examples
    --------
    >>> cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
    >>> scaled_jacobian(cube, np.arange(8)[None]).tolist()
    [1.0]
    """
    quality = np.empty(len(hexahedra))
    for low in range(0, len(hexahedra), AT_ONCE):
        corners = nodes[hexahedra[low : low + AT_ONCE]]
        edges = corners[:, _EDGES] - corners[:, :, None]  # (e, 8, 3, 3)
        triple = np.einsum("eci,eci->ec", edges[:, :, 0], np.cross(edges[:, :, 1], edges[:, :, 2]))
        scaled = triple / np.linalg.norm(edges, axis=-1).prod(axis=-1)
        quality[low : low + AT_ONCE] = scaled.min(axis=1)
    return quality


def check_folding(mesh: SweptMesh) -> None:
    """Refuse elements whose scaled Jacobian is not positive; MeshError naming the worst element."""
    refuse_folded(mesh, scaled_jacobian(mesh.nodes, mesh.hexahedra), "hexahedron", "its scaled Jacobian")


def refuse_folded(mesh: SweptMesh, quality: Floats, what: str, measure: str) -> None:
    """Refuse elements (E,) of which a measure of quality is not positive; MeshError naming the worst element."""
    worst = int(np.argmin(quality))
    if not quality[worst] > 0:
        layer = mesh.slice_of_element[worst]
        raise MeshError(
            f"{what} {worst} of yarn {mesh.yarn_of_slice[layer]} at s = {mesh.arc_length[layer]:.6g} m is folded: "
            f"{measure} is {quality[worst]:.3g}, and must be positive; use a smaller mesh.size"
        )


def check_bending(curves: Sequence[Centreline], radius: float) -> None:
    """Refuse centrelines that bend tighter than the radius of the yarn; MeshError naming the tightest place."""
    for yarn, curve in enumerate(curves):
        s = _stations(curve, radius)
        curvature = curve.curvature(s)
        worst = int(np.argmax(curvature))
        if not curvature[worst] * radius < 1:
            raise MeshError(
                f"yarn {yarn} bends at s = {s[worst]:.6g} m to a radius of {1 / curvature[worst]:.4g} m; "
                f"it must be larger than the yarn's own radius, {radius:.4g} m: use a smaller yarn.diameter or other "
                "pattern.control_points"
            )


def check_overlap(curves: Sequence[Centreline], radius: float, tolerance: float = OVERLAP_TOLERANCE) -> None:
    """Refuse centrelines that come nearer than ``2 radius (1 - tolerance)``.

    Pieces of one yarn that are at most pi radius apart along it are neighbours and left out: a half turn that
    is as tight as the yarn allows ends just one diameter away.
    Raises MeshError naming the nearest pair.
    """
    stations = [_stations(curve, radius) for curve in curves]
    yarn = np.repeat(np.arange(len(curves)), [s.size for s in stations])
    points = np.concatenate([curve.position(s) for curve, s in zip(curves, stations, strict=True)])
    s = np.concatenate(stations)
    allowed = 2 * radius * (1 - tolerance)
    tree = cKDTree(points)
    nearest = allowed, -1, -1
    for low in range(0, len(points), AT_ONCE):
        part = slice(low, low + AT_ONCE)
        near = cKDTree(points[part]).sparse_distance_matrix(tree, allowed, output_type="ndarray")
        first = low + near["i"]
        second = near["j"]
        apart = (yarn[first] != yarn[second]) | (np.abs(s[first] - s[second]) > np.pi * radius)
        if apart.any():
            at = np.flatnonzero(apart)[np.argmin(near["v"][apart])]
            nearest = min(nearest, (float(near["v"][at]), int(first[at]), int(second[at])))
    distance, one, other = nearest
    if one >= 0:
        raise MeshError(
            f"yarn {yarn[one]} at s = {s[one]:.6g} m and yarn {yarn[other]} at s = {s[other]:.6g} m "
            f"overlap: their centrelines are {distance:.4g} m apart, less than {allowed:.4g} m: use a smaller "
            "yarn.diameter or a larger clearance"
        )


def _stations(curve: Centreline, radius: float) -> Floats:
    """Arc lengths in m that are close together compared with the diameter."""
    parts = int(np.ceil(curve.length * SAMPLES_PER_DIAMETER / (2 * radius)))
    return np.linspace(0.0, curve.length, 1 + parts)


# ---- Memory

GIBIBYTE = 2**30


def require_memory(need: float, key: str, size: float, what: str, power: int) -> None:
    """Refuse a discretisation that takes more memory than is free: MeshError names the size that would fit.

    `need` are the bytes that `what` is estimated to take; they go with the size [yarn radii], the value of a key, to
    the minus some power.
    """
    free = psutil.virtual_memory().available
    if need <= free:
        return
    fits = 1.05 * size * (need / free) ** (1 / power)
    raise MeshError(
        f"{key} is {size:g} yarn radii: {what} would take about {need / GIBIBYTE:.3g} GiB of memory, and "
        f"{free / GIBIBYTE:.3g} GiB are free; use about {fits:.2g} or more"
    )


# Of a mesh that is made and checked, beside some 100 MB of a batch; measured were 165 to 215, of 0.07 and 0.1 mm.
BYTES_A_NODE = 250
# Of a simulation of tied yarns without their factors, by the nodes of an element; with contact up to twice as much.
BYTES_AN_UNKNOWN = {8: 2000, 20: 3000}
BYTES_AN_ENTRY = 4  # of those factors, in single precision


def require_memory_to_mesh(curves: Sequence[Centreline], radius: float, size: float, growth: float) -> None:
    """Refuse a mesh of yarns of a radius [m] that does not fit into memory; raises MeshError."""
    slices = sum(curve.length for curve in curves) / (growth * size * radius)
    nodes = slices * nodes_for_size(2, size)
    require_memory(nodes * BYTES_A_NODE, "mesh.size", size, f"a mesh of {nodes:.2g} nodes", power=3)


def require_memory_to_simulate(unknowns: int, bandwidth: int, size: float, nodes: int = 8) -> None:
    """Refuse a direct simulation that does not fit into memory: MeshError names the ``mesh.size`` that would fit.

    Factors of single yarns are bands; `bandwidth` is the largest difference of node numbers in an element.
    """
    need = unknowns * (BYTES_AN_UNKNOWN[nodes] + 3.0 * bandwidth * BYTES_AN_ENTRY)
    require_memory(need, "mesh.size", size, f"a simulation of {unknowns:.2g} unknowns", power=4)
