"""Points C1 to C4 of the three-dimensional model, Fig. 5 and section 2.5 of the paper.

P1 and P2 are the centroids of the two contacts on one side of an interlock, the lower and the upper one,
where the same two yarns touch one after the other. The line P1 P2 and the contact normal at P1 span the
contact normal plane of P1, which cuts the centrelines of the two yarns near P1 in C1 and C3; the normal at
P2 gives C2 and C4 in the same way.

The paper takes one normal for both points; here each has its own, for the two differ by some 90
degrees on a loop with the angles of Table 4. Where centroid and normal come from the closest points of the
centrelines, these are the points C. The left and the right contact of one level would be the other reading
of Fig. 5; their plane grazes the yarn that turns into a sinker or a head (14 degrees, against 37 and 48
here), and misses it for centroids a little off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.optimize import elementwise

from knitstudy.errors import GeometryError
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.spline import Centreline

SAMPLES = 40
"""Intervals of the search for the cut, over a diameter to either side of the crossing."""


@dataclass(frozen=True)
class JointPoints:
    """Where two yarns touch and where their centrelines belong to that touch, for K crossings.

    Attributes
    ----------
    yarn : ndarray of int, shape (K, 2)
        The lower row's yarn and the upper row's yarn.
    arc_length : ndarray, shape (K, 2)
        Of the points C on their centrelines [m].
    point : ndarray, shape (K, 2, 3)
        The points C [m].
    centroid : ndarray, shape (K, 3)
        The points P [m].
    """

    yarn: np.ndarray
    arc_length: np.ndarray
    point: np.ndarray
    centroid: np.ndarray


def joint_points(knit: Knit, contacts: xr.Dataset) -> JointPoints:
    """Return points P and C of all crossings.

    Parameters
    ----------
    knit : Knit
        Centrelines and yarn radius.
    contacts : Dataset
        Contacts in the format of docs/architecture.md.

    Raises
    ------
    GeometryError
        If a contact has no partner on its side of the interlock, the normal lies along the line P1 P2, or a
        centreline does not cut the plane within a diameter of its crossing.
    """
    yarn = contacts["yarn"].to_numpy().astype(int)
    centroid = contacts["centroid"].to_numpy()
    plane = contact_normal_planes(contacts)
    arc_length = np.empty(yarn.shape)
    point = np.empty((*yarn.shape, 3))
    for number, centreline in enumerate(knit.centrelines):
        on_yarn = yarn == number
        crossing = np.nonzero(on_yarn)[0]
        arc_length[on_yarn] = _cut(
            centreline,
            contacts["arc_length"].to_numpy()[on_yarn],
            plane[crossing],
            centroid[crossing],
            2 * knit.loop.radius,
            lambda k, crossing=crossing, number=number: _name(contacts, crossing[k], number),
        )
        point[on_yarn] = centreline.position(arc_length[on_yarn])
    return JointPoints(yarn, arc_length, point, centroid)


def contact_normal_planes(contacts: xr.Dataset) -> np.ndarray:
    """Return the unit normals (K, 3) of the contact normal planes, which hold P1, P2 and the contact normal.

    Raises
    ------
    GeometryError
        If a contact has no partner on its side of the interlock, or its normal lies along the line P1 P2.
    """
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    place = {key: k for k, key in enumerate(zip(row, column, zone, strict=True))}
    # Zones 0 and 1 are left and right below, 2 and 3 left and right above.
    partner = np.array(
        [place.get((r, c, (z + 2) % 4), -1) for r, c, z in zip(row, column, zone, strict=True)]
    )
    if np.any(partner < 0):
        k = int(np.argmin(partner))
        raise GeometryError(
            f"contacts: row {row[k]}, column {column[k]} has zone {zone[k]} but not zone {(zone[k] + 2) % 4} on "
            "the same side of the interlock; the contact normal plane needs both"
        )
    centroid, normal = contacts["centroid"].to_numpy(), contacts["normal"].to_numpy()
    line = centroid[partner] - centroid
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    across = np.cross(line, normal)
    sine = np.linalg.norm(across, axis=1)
    if np.any(~(sine > 1e-3)):
        k = int(np.argmin(np.nan_to_num(sine)))
        raise GeometryError(
            f"contacts: the normal {normal[k]} at row {row[k]}, column {column[k]}, zone {zone[k]} lies "
            "along the line between the two contacts of its side; together they must span a plane"
        )
    return across / sine[:, None]


def _cut(
    centreline: Centreline,
    start: np.ndarray,
    plane: np.ndarray,
    centroid: np.ndarray,
    reach: float,
    name: Callable[[int], str],
) -> np.ndarray:
    """Arc lengths (k,) nearest to `start` where a centreline cuts planes (k, 3) through centroids (k, 3)."""
    curve = centreline.curve

    def height(u, *plane_and_level):
        *across, level = plane_and_level
        return np.einsum("ki,ki->k", curve.value(u), np.column_stack(across)) - level

    level = np.einsum("ki,ki->k", plane, centroid)
    # In the curve's own parameter u, whose unit is a segment: arc lengths would be inverted at every point.
    limits = np.clip(start + np.array([[-reach], [reach]]), 0.0, centreline.length)
    u = np.linspace(*centreline.parameter(limits), SAMPLES + 1, axis=1)
    above = np.einsum("kqi,ki->kq", curve.value(u), plane) > level[:, None]
    changes = above[:, 1:] != above[:, :-1]
    if not changes.any(axis=1).all():
        k = int(np.argmin(changes.any(axis=1)))
        raise GeometryError(
            f"{name(k)}: the centreline does not cut the contact normal plane within a yarn diameter "
            f"({reach:.3g} m) of the crossing; contact and centreline do not belong together"
        )
    middle = centreline.arc_length(0.5 * (u[:, 1:] + u[:, :-1]))
    nearest = np.argmin(np.where(changes, np.abs(middle - start[:, None]), np.inf), axis=1)
    each = np.arange(len(u))
    bracket = (u[each, nearest], u[each, nearest + 1])
    cut = elementwise.find_root(height, bracket, args=(*plane.T, level), tolerances={"xatol": 1e-12})
    return centreline.arc_length(cut.x)


def _name(contacts: xr.Dataset, k: int, yarn: int) -> str:
    row, column, zone = (int(contacts[name][k]) for name in ("row", "column", "zone"))
    return f"contact of row {row}, column {column}, zone {zone} on yarn {yarn}"
