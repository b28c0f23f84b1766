"""A cell of an endless fabric: forces per width and stiffness without grips and edges (docs/theory/theory.md).

The yarns are splines that wrap around. A fabric's endless cell holds its rows of yarns and the image of the first one
above the last: the interactions of yarns lie between two rows, so that every crossing is there once. Only the
rows have elements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.spline import Centreline
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import cell_path
from knitstudy.loading.solve import Problem, Reported, settings_of
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.periodic import Lattice, PeriodicModel, Seam, condensed, seam
from knitstudy.mechanics.spline_yarn.space import Space, YarnSpace
from knitstudy.mechanics.spline_yarn.span import span_groups
from knitstudy.mesh.mesher import Grips
from knitstudy.mesh.sweep import rotation_minimising
from knitstudy.models import solids
from knitstudy.models.discretisation import Discretisation, fitted_places
from knitstudy.models.solids import SolidYarns
from knitstudy.study.scene import Scene

# The first node is held: without it all of a cell could move freely. The first that repeats itself is the first of all.
HELD = np.zeros(1, dtype=np.int64)
FIXED = np.arange(3)  # its unknowns


def problem(scene: Scene, fabric: Fabric, parts: Discretisation) -> Problem:
    """Return a scene whose fabric is endless as a problem, from its discretisation (`spline_yarns`).

    The driven side is the lattice: its displacement along x, y and in shear is the strain times the edge of the cell,
    its reaction the force on the edge.
    Raises MeshError if a crossing cannot be tied, or yarns overlap.
    """
    cell = assemble(scene, fabric, parts)
    yarns, model, load = cell.yarns, cell.model, scene.load
    motion, prescribed = cell_path(load, cell.lattice.lengths, FIXED, model.size)
    return Problem(
        scene=scene,
        model=model,
        prescribed=prescribed,
        settings=settings_of(scene, yarns.touches),
        motion=motion,
        driven=model.lattice[None],
        stations=solids.stations_of(parts.mesh),
        observer=cell,
        fields=yarns.fields if "fields" in scene.outputs else None,
        checks=(partial(require_sound, scene, yarns.model.loaded),),
        constants=yarns.ties.constants() | ({} if yarns.touches else cell.shell()),
        attributes={
            "dof": parts.nodes.size,
            "elements": yarns.elements,
            "deformation": load.deformation,
            **yarns.attributes(),
        },
    )


@dataclass(frozen=True, eq=False)
class Cell:
    """A cell put together."""

    yarns: SolidYarns  # all rows and the image of the first
    model: PeriodicModel
    spread: sp.csr_matrix  # (3 N, 3 n) displacements of all nodes from the n nodes that repeat themselves
    jumps: np.ndarray  # (3 N, 6) displacements added for each generalised strain of `mechanics.periodic`
    lattice: Lattice

    def record(self, increment: Increment) -> Reported:
        """Return strains, forces per width, of a tied cell its tangent, and the columns of solid yarns."""
        state = increment.state
        columns, points = self.yarns.record(state)
        moved, force = self.model.stretched(state.displacement.ravel()), increment.response.force
        columns["cell_strain"] = moved / self.lattice.lengths
        columns["force_per_width"] = force[self.model.lattice] * self.lattice.lengths / self.lattice.area
        if not self.yarns.touches:
            columns["tangent_per_width"] = self.stiffness(replace(state, step=None), slice(3))
        return columns, points

    def stiffness(self, state: Any, chosen: slice) -> np.ndarray:
        """Return the stiffness of a tied knit by chosen strains of `mechanics.periodic`, with all nodes in balance.

        In N/m where two strains meet, in N where a strain meets a curvature, in N m where two curvatures do.
        """
        tangent = self.yarns.model.respond(state, stiffness=True).stiffness
        return condensed(tangent, self.jumps[:, chosen], self.spread, FIXED) / self.lattice.area

    def shell(self) -> dict[str, np.ndarray]:
        """Return the parts of the stiffness at rest by their names in the history."""
        whole = self.stiffness(self.yarns.model.start(), slice(6))
        parts = {"membrane": whole[:3, :3], "coupling": whole[:3, 3:], "bending": whole[3:, 3:]}
        return {f"{name}_stiffness": part for name, part in parts.items()}


def assemble(scene: Scene, fabric: Fabric, parts: Discretisation) -> Cell:
    """Return the cell of a scene; errors as of `problem`."""
    # A yarn does not touch itself: its image would do so once more.
    meets = ~np.eye(parts.mesh.yarns, dtype=bool)
    # Elements leave out images, which ties and contact reach: an explicit identity makes room for those.
    every = sp.identity(len(parts.nodes), format="csr")
    yarns = solids.assemble(scene, fabric, parts, spread=every, meets=meets)
    rows, lattice = _wrapped(parts.space, fabric)
    spread, jumps = periodic_map(parts.space, rows, lattice)
    stretch = sp.csr_matrix(jumps[:, :3] / lattice.lengths)
    model = PeriodicModel(yarns.model, sp.csr_matrix(sp.hstack([spread, stretch])))
    return Cell(yarns, model, spread, jumps, lattice)


def wrapped_nodes(space: Space, fabric: Fabric) -> np.ndarray:
    """Return the undeformed nodes (N, 3) of all yarns of an endless fabric, the image of the first included [m]."""
    rows, lattice = _wrapped(space, fabric)
    nodes = [row.seam.nodes(row.start, lattice.vectors[0]) for row in rows]
    of_yarns = np.concatenate([nodes[one] for one in fabric.copy_of.tolist()])
    return of_yarns + space.unity[:, None] * fabric.shift[space.yarn]


def without_image(parts: Discretisation, material: Material) -> Discretisation:
    """Return yarns whose last one, the image of the first, has no elements; one node is held and none is driven."""
    rows = Space(parts.space.yarns[:-1])
    return replace(
        parts,
        groups=lambda nodes: span_groups(rows, nodes[: rows.size], material),
        volume=partial(_volume, parts.volume, rows.yarns[0].size),
        ends=Grips(HELD, HELD[:0]),
    )


def _volume(every: Callable, own: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return the volume (N,) of every node [m3], of the image as of the first yarn."""
    total = every(groups)
    total[-own:] = total[:own]
    return total


@dataclass(frozen=True, eq=False)
class WrappedYarn:
    """A yarn that wraps around."""

    seam: Seam
    start: np.ndarray  # (p, 3) its undeformed nodes that wrap around [m]


def _wrapped(space: Space, fabric: Fabric) -> tuple[list[WrappedYarn], Lattice]:
    """Return the yarns of all rows but the image, each where the first copy of it lies, and the lattice."""
    lattice, kinds = Lattice(fabric.periods), {}
    copies = fabric.copy_of[:-1].tolist()
    for one in set(copies):
        own, curve = space.yarns[one], fabric.centrelines[one]
        around = seam(own)
        kinds[one] = WrappedYarn(around, wrapped_shape(own, around, curve, fabric.radius, lattice.vectors[0]))
    return [kinds[one] for one in copies], lattice


def periodic_map(
    space: Space,  # of all yarns, copies of a yarn share theirs
    rows: list[WrappedYarn],  # of all rows but the image, each where the first copy of it lies
    lattice: Lattice,  # its second vector is the way of all rows
) -> tuple[sp.csr_matrix, np.ndarray]:
    """Return S (3 N, 3 n) and the jumps (3 N, 6) of all yarns, the last of which is the image of the first."""
    every = sp.block_diag([row.seam.wrapped for row in rows], format="csr")
    first = rows[0].seam.wrapped
    image = sp.hstack([first, sp.csr_matrix((first.shape[0], every.shape[1] - first.shape[1]))])
    wrapped = sp.vstack([every, image], format="csr")
    spread = sp.csr_matrix(sp.kron(wrapped, sp.identity(3)))
    jumps, lowest = [], {}
    for number, (row, own) in enumerate(zip(rows, space.yarns, strict=False)):
        up = (number - lowest.setdefault(id(row), number)) / len(rows)
        here = row.start + np.multiply.outer(row.seam.unity, up * lattice.vectors[1])
        over = lattice.jumps(0, here, row.seam.unity)
        jumps.append((row.seam.beyond @ over.reshape(len(over), -1)).reshape(own.size, 3, 6))
    nodes = rows[0].seam.nodes(rows[0].start, lattice.vectors[0])
    jumps.append(jumps[0] + lattice.jumps(1, nodes, space.unity[: len(nodes)]))
    return spread, np.concatenate(jumps).reshape(3 * space.size, 6)


def wrapped_shape(
    own: YarnSpace, around: Seam, curve: Centreline, radius: float, period: np.ndarray
) -> np.ndarray:
    """Return the undeformed nodes (p, 3) of a round yarn that wrap around [m].

    Frames without twist need not meet themselves where the yarn goes on: the angle that they miss is spread over the
    yarn, which a round section does not notice.
    """
    places = fitted_places(own)
    s = places[:-1]
    position = curve.position(places)
    frames = rotation_minimising(position, curve.tangent(places))
    if position[0, 2] > position[:, 2].mean():
        frames[:, :2] *= -1  # a yarn seen from behind has the mirror image of the other's sections
    missed = np.arctan2(frames[-1, 0] @ frames[0, 1], frames[-1, 0] @ frames[0, 0])
    angle = (missed * s / places[-1])[:, None]
    d1, d2 = frames[:-1, 0], frames[:-1, 1]
    turned = np.cos(angle) * d1 + np.sin(angle) * d2, np.cos(angle) * d2 - np.sin(angle) * d1
    first = around.order == 0
    splines = own.spline.matrix(s)
    along, beyond = (
        splines @ values[own.first_node[:-1]][:, first] for values in (around.wrapped, around.beyond)
    )
    centre = curve.position(s) - np.multiply.outer(beyond @ np.ones(beyond.shape[1]), period)
    solution = splu(sp.csc_matrix(along.T @ along)).solve(along.T @ np.concatenate([centre, *turned], axis=1))
    nodes = np.zeros((len(around.order), 3))
    solution[:, 3:] *= 0.5 * radius  # centres, and the two directors
    nodes[np.flatnonzero(first)[:, None] + np.arange(3)] = solution.reshape(-1, 3, 3)
    return nodes
