"""Gates that a mesh must pass before anything is computed on it, and a summary of its quality."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mesh.sweep import Curve, SweptMesh

OVERLAP_TOLERANCE = 0.01
"""Share of the diameter by which yarns may overlap; the optimised geometry is twenty times as exact."""

SAMPLES_PER_DIAMETER = 50
"""Points along a diameter of yarn in the search for overlaps: distances are then exact to 1e-4."""

AT_ONCE = 16_384
"""Elements, or points whose neighbours are held, at a time."""

# Per corner of a VTK hexahedron, the corners at the other ends of its three edges, right-handed.
_EDGES = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])


class BendingCurve(Curve, Protocol):
    """A centreline that also knows its curvature."""

    def curvature(self, s: np.ndarray) -> np.ndarray:
        """Curvatures (k,) in 1/m at arc lengths (k,) in m."""


def scaled_jacobian(nodes: np.ndarray, hexahedra: np.ndarray) -> np.ndarray:
    """Smallest scaled Jacobian of every hexahedron: 1 with right angles at all corners, 0 or less if folded.

    At each corner it is the triple product of the edge vectors over the product of their lengths (Knupp 2000,
    "Achieving finite element mesh quality via optimization of the Jacobian matrix norm and associated
    quantities", part II, International Journal for Numerical Methods in Engineering 48).

    Parameters
    ----------
    nodes : ndarray (N, 3)
        Coordinates.
    hexahedra : ndarray (E, 8) of int
        Corner nodes in VTK order.

    Returns
    -------
    ndarray (E,)
    """
    return np.concatenate([_scaled_jacobian(edges) for edges in _edges(nodes, hexahedra)])


def edge_ratio(mesh: SweptMesh) -> np.ndarray:
    """Longest edge over shortest edge of every hexahedron (E,)."""
    return np.concatenate([_edge_ratio(edges) for edges in _edges(mesh.nodes, mesh.hexahedra)])


def check(mesh: SweptMesh, curves: Sequence[BendingCurve], overlap: float = OVERLAP_TOLERANCE) -> None:
    """Pass the mesh through all gates: bending, folding, overlap.

    Parameters
    ----------
    mesh : SweptMesh
    curves : sequence of BendingCurve
        The centrelines that were swept.
    overlap : float
        Share of the diameter by which yarns may overlap.

    Raises
    ------
    MeshError
        Naming the yarn, the arc length, the value and what is allowed.
    """
    check_bending(curves, mesh.radius)
    check_folding(mesh)
    check_overlap(curves, mesh.radius, overlap)


def check_folding(mesh: SweptMesh) -> None:
    """Refuse elements whose scaled Jacobian is not positive.

    Raises
    ------
    MeshError
        Naming the worst element.
    """
    quality = scaled_jacobian(mesh.nodes, mesh.hexahedra)
    worst = int(np.argmin(quality))
    if not quality[worst] > 0:
        layer = mesh.slice_of_element[worst]
        raise MeshError(
            f"hexahedron {worst} of yarn {mesh.yarn_of_slice[layer]} at s = {mesh.arc_length[layer]:.6g} m "
            f"is folded: its scaled Jacobian is {quality[worst]:.3g}, and must be positive"
        )


def check_bending(curves: Sequence[BendingCurve], radius: float) -> None:
    """Refuse centrelines that bend tighter than the radius of the yarn.

    Raises
    ------
    MeshError
        Naming the tightest place.
    """
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


def check_overlap(curves: Sequence[Curve], radius: float, tolerance: float = OVERLAP_TOLERANCE) -> None:
    """Refuse centrelines that come nearer than ``2 radius (1 - tolerance)``.

    Pieces of one yarn that are at most pi radius apart along it are neighbours and left out: a half turn that
    is as tight as the yarn allows ends just one diameter away.

    Raises
    ------
    MeshError
        Naming the nearest pair.
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
        first, second = low + near["i"], near["j"]
        apart = (yarn[first] != yarn[second]) | (np.abs(s[first] - s[second]) > np.pi * radius)
        if apart.any():
            at = np.flatnonzero(apart)[np.argmin(near["v"][apart])]
            nearest = min(nearest, (near["v"][at], first[at], second[at]))
    distance, first, second = nearest
    if first >= 0:
        raise MeshError(
            f"yarn {yarn[first]} at s = {s[first]:.6g} m and yarn {yarn[second]} at s = {s[second]:.6g} m "
            f"overlap: their centrelines are {distance:.4g} m apart, less than {allowed:.4g} m: use a smaller "
            "yarn.diameter or a larger clearance"
        )


def summary(mesh: SweptMesh, bins: int = 20) -> xr.Dataset:
    """Size and quality of a mesh: counts, extremes, and the histogram of the scaled Jacobian.

    Returns
    -------
    Dataset
        ``scaled_jacobian_edge`` (bins + 1,) and ``elements_in_bin`` (bins,), and scalars: ``nodes``,
        ``elements``, ``unknowns``, ``slices``, ``scaled_jacobian_min``, ``scaled_jacobian_mean``,
        ``edge_ratio_max``, ``spacing_min`` and ``spacing_max`` (m).
    """
    quality = scaled_jacobian(mesh.nodes, mesh.hexahedra)
    spacing = np.concatenate([np.diff(mesh.arc_length[a:b]) for a, b in pairwise(mesh.first_slice)])
    counts, edges = np.histogram(quality, bins=bins, range=(min(0.0, quality.min()), 1.0))
    scalars = {
        "nodes": (mesh.nodes.shape[0], "1"),
        "elements": (mesh.hexahedra.shape[0], "1"),
        "unknowns": (mesh.nodes.size, "1"),
        "slices": (mesh.slices, "1"),
        "scaled_jacobian_min": (quality.min(), "1"),
        "scaled_jacobian_mean": (quality.mean(), "1"),
        "edge_ratio_max": (edge_ratio(mesh).max(), "1"),
        "spacing_min": (spacing.min(), "m"),
        "spacing_max": (spacing.max(), "m"),
    }
    variables = {name: ((), value, {"units": unit}) for name, (value, unit) in scalars.items()}
    variables["scaled_jacobian_edge"] = (("bin_edge",), edges, {"units": "1"})
    variables["elements_in_bin"] = (("bin",), counts, {"units": "1"})
    return xr.Dataset(variables)


def _edges(nodes: np.ndarray, hexahedra: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the three edges at every corner of some elements at a time (e, 8, 3, 3), right-handed [m]."""
    for low in range(0, len(hexahedra), AT_ONCE):
        corners = nodes[hexahedra[low : low + AT_ONCE]]
        yield corners[:, _EDGES] - corners[:, :, None]


def _scaled_jacobian(edges: np.ndarray) -> np.ndarray:
    triple = np.einsum("eci,eci->ec", edges[:, :, 0], np.cross(edges[:, :, 1], edges[:, :, 2]))
    return (triple / np.linalg.norm(edges, axis=-1).prod(axis=-1)).min(axis=1)


def _edge_ratio(edges: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(edges, axis=-1).reshape(-1, 24)
    return lengths.max(axis=1) / lengths.min(axis=1)


def _stations(curve: Curve, radius: float) -> np.ndarray:
    """Arc lengths in m that are close together compared with the diameter."""
    return np.linspace(
        0.0, curve.length, 1 + int(np.ceil(curve.length * SAMPLES_PER_DIAMETER / (2 * radius)))
    )
