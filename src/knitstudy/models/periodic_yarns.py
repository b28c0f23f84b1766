"""Solid yarns of a cell that repeats itself: polynomials over the section times splines that wrap around.

The code of knits lays out the rows of the cell and the image of the first one above the last: what yarns do to each
other lies between two rows, so that every crossing is there once. Elements are those of the rows alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.spline import Centreline
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.materials import Material, material_of
from knitstudy.mechanics.patch_compliance import missing
from knitstudy.mechanics.periodic import Lattice
from knitstudy.mechanics.spline_yarn.seam import Seam, seam
from knitstudy.mechanics.spline_yarn.space import Sampling, Space, YarnSpace, locate
from knitstudy.mechanics.spline_yarn.span import span_groups
from knitstudy.mesh.mesher import ACROSS, Grips, sampled_sections
from knitstudy.mesh.sweep import rotation_minimising
from knitstudy.models.discretisation import Discretisation, contact_surfaces
from knitstudy.models.spline_yarns import PLACES, space_on, yarn_spans
from knitstudy.study.scene import Scene

NOTHING = np.empty(0, dtype=np.int64)

HELD = np.zeros(1, dtype=np.int64)
"""The first node: without it all of a cell could move for nothing."""

DIRECTORS = slice(3, 6), slice(6, 9)


@dataclass(frozen=True, eq=False)
class PeriodicYarns:
    """The yarns of a cell.

    Attributes
    ----------
    parts : Discretisation
        Of all rows and of the image of the first; nothing is driven.
    spread : csr matrix, shape (3 N, 3 n)
        Displacements of all nodes from the n nodes that repeat themselves.
    jumps : ndarray, shape (3 N, 6)
        What is added to them for each generalised strain of `mechanics.periodic`.
    lattice : Lattice
    """

    parts: Discretisation
    spread: sp.csr_matrix
    jumps: np.ndarray
    lattice: Lattice


def periodic_yarns(scene: Scene, knit: Fabric) -> PeriodicYarns:
    """Return the yarns of a cell of so many loops and rows.

    Raises
    ------
    MeshError
        If yarns overlap, bend too tightly, or have too few spans.
    """
    space = space_on(scene, yarn_spans(scene, knit))
    own = space.yarns[0]
    around = seam(own)
    lattice = Lattice(knit.periods)
    start = wrapped_shape(own, around, knit.centrelines[0], knit.radius, lattice.vectors[0])
    return PeriodicYarns(
        discretise(scene, knit, space, around.nodes(start, lattice.vectors[0])),
        *periodic_map(space, around, start, lattice),
        lattice,
    )


def discretise(scene: Scene, knit: Fabric, space: Space, first: np.ndarray) -> Discretisation:
    """Return the rows and the image of the first, from the undeformed nodes (n, 3) of the first row's yarn."""
    rise = space.unity[:, None] * knit.shift[space.yarn]
    nodes = np.tile(first, (len(space.yarns), 1)) + rise
    radius = knit.radius
    surfaces, rings = contact_surfaces(scene, space, knit)
    material = material_of(scene.yarn)
    mesh = sampled_sections(knit)
    return Discretisation(
        mesh=mesh,
        nodes=nodes,
        unity=space.unity,
        yarn=space.yarn,
        station=space.station,
        bandwidth=space.yarns[0].bandwidth,
        groups=partial(_groups, Space(space.yarns[:-1]), material),
        volume=partial(_volume, len(space.yarns), space.yarns[0].size),
        surfaces=surfaces,
        rings=rings,
        ends=Grips(HELD, NOTHING),
        locate=lambda points, number: space.weights(number, *locate(space, nodes, points, number)),
        size=2 * radius / ACROSS,
        missing=partial(missing, space, radius, *material.across),
        sampling=Sampling(space, mesh.yarn_of_slice, mesh.arc_length, mesh.section.points),
    )


def periodic_map(
    space: Space, around: Seam, start: np.ndarray, lattice: Lattice
) -> tuple[sp.csr_matrix, np.ndarray]:
    """Return S (3 N, 3 n) and the jumps (3 N, 6) of all yarns, the last of which is the image of the first.

    Parameters
    ----------
    space : Space
        Of all yarns, which share theirs.
    around : Seam
        Of that.
    start : ndarray, shape (p, 3)
        Undeformed nodes of the first yarn that wrap around [m].
    lattice : Lattice
        Its second vector is the way of all rows.
    """
    rows = len(space.yarns) - 1
    row_of = sp.csr_matrix((np.ones(rows + 1), (np.arange(rows + 1), np.arange(rows + 1) % rows)))
    spread = sp.csr_matrix(sp.kron(sp.kron(row_of, around.wrapped), sp.identity(3)))
    jumps = np.zeros((rows + 1, space.yarns[0].size, 3, 6))
    for row in range(rows):
        here = start + np.multiply.outer(around.unity, row / rows * lattice.vectors[1])
        over = lattice.jumps(0, here, around.unity)
        jumps[row] = (around.beyond @ over.reshape(len(over), -1)).reshape(jumps[row].shape)
    first = around.nodes(start, lattice.vectors[0])
    jumps[-1] = jumps[0] + lattice.jumps(1, first, space.unity[: len(first)])
    return spread, jumps.reshape(3 * space.size, 6)


def wrapped_shape(
    own: YarnSpace, around: Seam, curve: Centreline, radius: float, period: np.ndarray
) -> np.ndarray:
    """Return the undeformed nodes (p, 3) of a round yarn that wrap around [m].

    Frames without twist need not meet themselves where the yarn goes on: what they miss is spread over the yarn. A
    round section does not notice.
    """
    low, high = own.spline.spans.T
    share = np.arange(PLACES) / PLACES
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    places = np.append(s, high[-1])
    frames = rotation_minimising(curve.position(places), curve.tangent(places))
    missed = np.arctan2(frames[-1, 0] @ frames[0, 1], frames[-1, 0] @ frames[0, 0])
    angle = (missed * s / high[-1])[:, None]
    d1, d2 = frames[:-1, 0], frames[:-1, 1]
    turned = np.cos(angle) * d1 + np.sin(angle) * d2, np.cos(angle) * d2 - np.sin(angle) * d1
    at = own.first_node[:-1]
    first = around.order == 0
    along, beyond = (own.spline.matrix(s) @ each[at][:, first] for each in (around.wrapped, around.beyond))
    centre = curve.position(s) - np.multiply.outer(beyond @ np.ones(beyond.shape[1]), period)
    found = splu(sp.csc_matrix(along.T @ along)).solve(along.T @ np.concatenate([centre, *turned], axis=1))
    nodes = np.zeros((len(around.order), 3))
    at = np.flatnonzero(first)
    nodes[at], nodes[at + 1], nodes[at + 2] = found[:, :3], *(0.5 * radius * found[:, d] for d in DIRECTORS)
    return nodes


def _groups(space: Space, material: Material, nodes: np.ndarray) -> tuple[ElementGroup, ...]:
    return span_groups(space, nodes[: space.size], material)


def _volume(yarns: int, own: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return what stands for the volume (N,) of every node [m3], of the image as of the first yarn."""
    total = np.zeros(yarns * own)
    for group in groups:
        total += np.bincount(group.connectivity.ravel(), group.elements.node_volume().ravel(), len(total))
    total[-own:] = total[:own]
    return total
