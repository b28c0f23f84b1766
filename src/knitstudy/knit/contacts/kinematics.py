"""How the cross-sections of solid yarns move and deform where yarns cross (Fig. 10 of the paper).

Linear hexahedra have no rotations. That of a section is the rotation in the affine map that comes closest to the
displacements of all nodes around it; motion beyond the map, such as the dent of a contact, averages out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.rotation import log

# Layers of elements that a section is: the one that the crossing lies in, and its neighbours on either side. Where the
# mesh is refined there are as many more, and nodes count by the area that they stand for.
LAYERS = 3


@dataclass(frozen=True)
class SectionMotion:
    """Affine maps of the sections at K crossings, on both sides."""

    gradient: Floats  # (K, 2, 3, 3) deformation gradient: the last axis is of the undeformed section
    displacement: Floats  # (K, 2, 3) of the centreline's point at the crossing [m]


def section_motion(
    crossings: Crossings, mesh: SweptMesh, nodes: Floats, displacement: Floats
) -> SectionMotion:
    """Fit the affine maps of the sections at all crossings, by least squares.

    Exact for a rigid motion and for a homogeneous deformation. The nodes (N, 3) [m] are where the mesh or ties have put
    them, the displacements (N, 3) [m] are theirs.
    """
    around = _nodes_around(crossings, mesh)
    weight = mesh.shrinkage.ravel()[around] ** 2
    weight /= weight.sum(axis=2, keepdims=True)
    place, moved = nodes[around], displacement[around]
    middle, mean = (np.einsum("ksn,ksni->ksi", weight, values) for values in (place, moved))
    place, moved = place - middle[:, :, None], moved - mean[:, :, None]
    weighted = weight[..., None] * place
    spread = np.einsum("ksni,ksnj->ksij", weighted, place)
    slope = np.linalg.solve(spread, np.einsum("ksni,ksnj->ksij", weighted, moved)).swapaxes(-1, -2)
    offset = np.einsum("ksij,ksj->ksi", slope, crossings.point - middle)
    return SectionMotion(np.eye(3) + slope, mean + offset)


def _nodes_around(crossings: Crossings, mesh: SweptMesh) -> Ints:
    """Nodes (K, 2, n) of the slices around every crossing; no slices lie beyond the end of a yarn."""
    pull = np.linalg.norm(mesh.pull, axis=1).max()
    layers = LAYERS + 2 * round(0.5 * LAYERS * ((1 + pull) / (1 - pull) - 1))
    begin, end = (mesh.first_slice[crossings.yarn + i] for i in (0, 1))
    below = mesh.slice_below(crossings.yarn, crossings.arc_length)
    first = np.clip(below - layers // 2, begin, end - layers - 1)
    nodes = mesh.slice_nodes(first[..., None] + np.arange(layers + 1))
    return nodes.reshape(*first.shape, -1)


# ---- Local kinematics of yarns where they cross: rotation, contraction, and how contact areas move (Fig. 10)
# On either side of a crossing stand three axes of the undeformed yarn: its tangent t, towards the other yarn n, and
# across both t x n. All angles about the yarn are positive about the tangent.
#
# The paper shows a yarn that contracts, without a measure. Yarns hardly shorten along their axes, they bend: what
# contracts are the chords between neighbouring contacts of a yarn, `segment_contraction`. `section_contraction` is the
# loss of a section's area. `sliding` is how far the facets that face each other at the crossing have moved past each
# other since the yarns first touched there. The mean length that points of contact have slipped, `slip`, is smaller,
# since points come into contact on the way. The contact area moves further, where yarns roll on each other or bend
# around each other: `contact_travel` and `contact_spin`, on the undeformed yarn.


@dataclass(frozen=True)
class CrossingAxes:
    """Axes of the undeformed yarns at K crossings, on both sides: orthogonal unit vectors."""

    tangent: Floats  # (K, 2, 3) t
    towards: Floats  # (K, 2, 3) n, to the other yarn
    across: Floats  # (K, 2, 3) t x n

    @classmethod
    def of(cls, fabric: Fabric) -> CrossingAxes:
        """Return the axes; the line of the closest points is normal to both yarns."""
        crossings = fabric.crossings
        tangent = np.empty_like(crossings.point)
        for yarn, curve in enumerate(fabric.centrelines):
            here = crossings.yarn == yarn
            tangent[here] = curve.tangent(crossings.arc_length[here])
        towards = np.stack([crossings.normal, -crossings.normal], axis=1)
        return cls(tangent, towards, np.cross(tangent, towards))


def kinematics(
    fabric: Fabric,
    gradient: Floats,
    displacement: Floats,
    relative: Floats,
    contact: Floats,
) -> dict[str, Floats]:
    """Return the derived quantities, by names of `knit.geometry.columns.CONTACTS`.

    At I increments: deformation gradients (I, K, 2, 3, 3) of the sections and displacements (I, K, 2, 3) [m] of the
    centrelines' points at the crossings (`section_motion`); the displacement (I, K, 3) [m] of the surface of side 1
    relative to that of side 0; centroids (I, K, 2, 3) [m] of the contact areas on the undeformed yarns, nan where open.
    """
    axes = CrossingAxes.of(fabric)
    left, _, right = np.linalg.svd(gradient)
    rotation = left @ right  # R of F = R U
    fibres = [
        np.einsum("iksmn,ksn->iksm", gradient, axis) for axis in (axes.tangent, axes.towards, axes.across)
    ]
    tangent, towards, across = fibres
    stretch = [np.linalg.norm(fibre, axis=-1) for fibre in fibres]
    area = np.linalg.norm(np.cross(towards, across), axis=-1)
    along, around = place_on_yarn(fabric, axes, contact)
    touching = np.asarray(np.isfinite(contact).any(axis=(2, 3)))[..., None]
    slid = since_first(np.where(touching, relative, np.nan))
    return {
        "section_rotation": log(rotation),
        "relative_rotation": log(rotation[:, :, 1] @ rotation[:, :, 0].swapaxes(-1, -2)),
        "tilt": angle_between(axes.tangent, tangent),
        "spin": twist(rotation, axes.tangent),
        "segment_contraction": segment_contraction(fabric.crossings, displacement),
        "section_contraction": 1 - area,
        "axial_stretch": stretch[0],
        "normal_stretch": stretch[1],
        "across_stretch": stretch[2],
        "centreline_relative_displacement": displacement[:, :, 1] - displacement[:, :, 0],
        "sliding": np.einsum("ikm,iksm->iks", slid, tangent / stretch[0][..., None]),
        "contact_travel": since_first(along),
        "contact_spin": since_first(around),
    }


def twist(rotation: Floats, axis: Floats) -> Floats:
    """Return the angles (...) about unit axes (..., 3) by which rotations (..., 3, 3) turn, in (-pi, pi] [rad].

    A rotation is a turn about the axis, and then the shortest way to where it takes the axis (swing and twist). With
    a unit quaternion (w, v) the angle is 2 atan(v . axis / w).

    Examples
    --------
    >>> from knitstudy.mechanics.core.rotation import exp
    >>> turn = exp(np.array([[0.0, 0.0, 0.3]]))
    >>> twist(turn, np.array([[0.0, 0.0, 1.0]])).round(6).tolist()
    [0.3]
    """
    skew = rotation - rotation.swapaxes(-1, -2)
    vector = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)  # 4 w v
    scalar = 1 + np.trace(rotation, axis1=-2, axis2=-1)  # 4 w^2
    return 2 * np.arctan2(np.sum(vector * axis, axis=-1), scalar)


def angle_between(first: Floats, second: Floats) -> Floats:
    """Return the angles (...) between vectors (..., 3) [rad], accurate for small ones too.

    Examples
    --------
    >>> angle_between(np.array([1.0, 0.0, 0.0]), np.array([0.0, 2.0, 0.0])).round(6).tolist()
    1.570796
    """
    sine = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.arctan2(sine, np.sum(first * second, axis=-1))


def segment_contraction(crossings: Crossings, displacement: Floats) -> Floats:
    """Return by how much the chords from each crossing to its neighbours on the yarn shrink, (I, K, 2, 2).

    The last axis is the neighbour before it and the one after it; nan where there is none. The displacement
    (I, K, 2, 3) is that of the centrelines' points at the crossings [m].
    """
    yarn = crossings.yarn.ravel()
    order = np.lexsort((crossings.arc_length.ravel(), yarn))
    place = crossings.point.reshape(-1, 3)[order]
    moved = place + displacement.reshape(len(displacement), -1, 3)[:, order]
    before, now = (np.linalg.norm(np.diff(line, axis=-2), axis=-1) for line in (place, moved))
    shrunk = np.where(np.diff(yarn[order]) == 0, 1 - now / before, np.nan)
    contraction = np.full((len(displacement), len(order), 2), np.nan)
    contraction[:, order[1:], 0] = shrunk
    contraction[:, order[:-1], 1] = shrunk
    return contraction.reshape(*displacement.shape[:-1], 2)


def place_on_yarn(fabric: Fabric, axes: CrossingAxes, place: Floats) -> tuple[Floats, Floats]:
    """Return where places near crossings lie on their undeformed yarns: along [m] and around them [rad].

    Both (I, K, 2) count from the crossing and the line of its closest points. Along the yarn the axes turn with the
    tangent, the shortest way. Places (I, K, 2, 3) [m] that are nan stay nan.
    """
    crossings = fabric.crossings
    along, around = np.full((2, *place.shape[:-1]), np.nan)
    for yarn, curve in enumerate(fabric.centrelines):
        at = _, crossing, side = np.nonzero((crossings.yarn == yarn) & np.isfinite(place[..., 0]))
        start = crossings.arc_length[crossing, side]
        s = foot(curve, place[at], start)
        tangent = curve.tangent(s)
        axis = axes.tangent[crossing, side]
        arm = place[at] - curve.position(s)
        back = np.sum(arm * axis, axis=1) / (1 + np.sum(tangent * axis, axis=1))
        arm = arm - back[:, None] * (tangent + axis)
        up, aside = (np.sum(arm * axis[crossing, side], axis=1) for axis in (axes.towards, axes.across))
        along[at] = s - start
        around[at] = np.arctan2(aside, up)
    return along, around


FOOT_STEPS = 40  # each leaves of the error the distance over the radius of curvature


def foot(curve: Centreline, place: Floats, start: Floats) -> Floats:
    """Return the arc lengths (k,) of the points of a curve nearest to places (k, 3), from a start (k,) [m].

    The places must be nearer to the curve than its radius of curvature.
    """
    s = start
    for _ in range(FOOT_STEPS):
        step = np.sum((place - curve.position(s)) * curve.tangent(s), axis=1)
        s = np.clip(s + step, 0, curve.length)
        if np.abs(step).max(initial=0.0) <= 1e-9 * curve.length:
            break
    return s


def since_first(values: Floats) -> Floats:
    """Return values (I, ...) minus the first along I that is not nan.

    Examples
    --------
    >>> since_first(np.array([[np.nan], [1.0], [3.0]])).tolist()
    [[nan], [0.0], [2.0]]
    """
    known = np.isfinite(values)
    first = np.take_along_axis(values, np.argmax(known, axis=0)[None], axis=0)
    return values - first
