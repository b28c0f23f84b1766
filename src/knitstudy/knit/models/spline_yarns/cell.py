"""A cell of an endless fabric: forces per width and stiffness without grips and edges (docs/theory/theory.md).

The yarns are splines that wrap around. A fabric's endless cell holds its rows of yarns and the image of the first one
above the last, so that every crossing is there once. Only the rows have elements. Where yarns touch, there are the
images of all rows that can reach down to them, and every yarn goes on as its own image at both ends. Every pair of
places that may touch is then there once: both on rows, or one on a row and one on an image above.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.loading.history import cell_path
from knitstudy.knit.loading.overlap import Repeats
from knitstudy.knit.loading.solve import Problem, Reported, settings_of
from knitstudy.knit.mesh.mesher import Grips
from knitstudy.knit.mesh.sweep import rotation_minimising
from knitstudy.knit.models.spline_yarns import CellOfSplineYarns, TiedCellOfSplineYarns
from knitstudy.knit.yarns import solids
from knitstudy.knit.yarns.discretisation import Discretisation, fitted_places
from knitstudy.knit.yarns.solids import SolidYarns
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.cells.solids import PeriodicModel, Seam, condensed, seam
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.spline_yarn.space import Space, YarnSpace
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

# The first node is held: without it all of a cell could move freely. The first that repeats itself is the first of all.
HELD = np.zeros(1, dtype=np.int64)
FIXED: Ints = np.arange(3)  # its unknowns

FARTHEST = 3  # periods up to which images of rows are looked for
SAMPLES = 200  # places along a yarn at which its extent is taken


def problem(
    scene: TiedCellOfSplineYarns | CellOfSplineYarns, fabric: Fabric, parts: Discretisation
) -> Problem:
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
        settings=settings_of(scene.solver, yarns.touches, yarns.stride),
        motion=motion,
        driven=model.lattice[None],
        stations=solids.stations_of(parts.mesh),
        observer=cell,
        repeats=Repeats(
            np.array([line.length for line in fabric.centrelines[: rows_of(fabric)]]), fabric.periods
        ),
        fields=yarns.fields if "fields" in scene.outputs else None,
        checks=(solids.sound(scene, yarns.model),),
        constants=yarns.ties.constants() | ({} if yarns.touches else cell.shell()),
        attributes={
            "dof": model.size,
            "elements": yarns.elements,
            "deformation": load.deformation,
            **yarns.attributes(),
        },
    )


@dataclass(frozen=True, eq=False)
class CellProblem:
    """A cell put together."""

    yarns: SolidYarns  # all rows and the image of the first
    model: PeriodicModel
    spread: sp.csr_matrix  # (3 N, 3 n) displacements of all nodes from the n nodes that repeat themselves
    jumps: Floats  # (3 N, 6) displacements added for each generalised strain of `cells.lattice`
    lattice: Lattice

    def record(self, increment: Increment) -> Reported:
        """Return strains, forces per width, of a tied cell its tangent, and the columns of solid yarns."""
        state = increment.state
        columns, points = self.yarns.columns(state)
        moved = self.model.stretched(state.displacement.ravel())
        force = increment.response.force
        columns["cell_strain"] = moved / self.lattice.lengths
        columns["force_per_width"] = force[self.model.lattice] * self.lattice.lengths / self.lattice.area
        if not self.yarns.touches:
            columns["tangent_per_width"] = self.stiffness(replace(state, step=None), slice(3))
        return columns, points

    def stiffness(self, state: Any, chosen: slice) -> Floats:
        """Return the stiffness of a tied knit by chosen strains of `cells.lattice`, with all nodes in balance.

        In N/m where two strains meet, in N where a strain meets a curvature, in N m where two curvatures do.
        """
        tangent = self.yarns.model.respond(state, stiffness=True).stiffness
        assert isinstance(tangent, sp.spmatrix)  # as asked for
        return condensed(tangent, self.jumps[:, chosen], self.spread, FIXED) / self.lattice.area

    def shell(self) -> dict[str, Floats]:
        """Return the parts of the stiffness at rest by their names in the history."""
        whole = self.stiffness(self.yarns.model.start(), slice(6))
        parts = {"membrane": whole[:3, :3], "coupling": whole[:3, 3:], "bending": whole[3:, 3:]}
        return {f"{name}_stiffness": part for name, part in parts.items()}


def assemble(
    scene: TiedCellOfSplineYarns | CellOfSplineYarns, fabric: Fabric, parts: Discretisation
) -> CellProblem:
    """Return the cell of a scene; errors as of `problem`."""
    # Two images touch as the yarns do that they are images of.
    row = np.arange(len(parts.splines.yarns)) < rows_of(fabric)
    # Elements leave out images, which ties and contact reach: an explicit identity makes room for those.
    every = sp.identity(len(parts.nodes), format="csr")
    yarns = solids.assemble(scene, scene.tie, fabric, parts, spread=every, meets=row[:, None] | row)
    rows, lattice = _wrapped(parts.splines, fabric)
    spread, jumps = periodic_map(parts.splines, rows, lattice, parts.nodes)
    stretch = sp.csr_matrix(jumps[:, :3] / lattice.lengths)
    model = PeriodicModel(yarns.model, sp.csr_matrix(sp.hstack([spread, stretch])))
    return CellProblem(yarns, model, spread, jumps, lattice)


def rows_of(fabric: Fabric) -> int:
    """Return the number of yarns of an endless fabric that are not images."""
    return len(fabric.centrelines) - 1


def rows_and_images(fabric: Fabric, touches: bool) -> Ints:
    """Return the row (Y,) that every yarn is or is an image of: all rows, then the images above them.

    Where yarns touch there are images of all rows that come nearer to the rows than half a row when nothing is
    deformed, else of the first row alone.
    """
    rows = rows_of(fabric)
    up = fabric.periods[1, 1]
    y = [line.curve.value(np.linspace(*line.span, SAMPLES))[:, 1] for line in fabric.centrelines[:rows]]
    lowest = np.array([values.min() for values in y]) + up * np.arange(1, FARTHEST + 1)[:, None]
    highest = max(values.max() for values in y) + 2 * fabric.radius + 0.5 * up / rows
    images = max(1, int(np.count_nonzero(lowest < highest))) if touches else 1
    return np.arange(rows + images) % rows


def wrapped_nodes(space: Space, fabric: Fabric) -> Floats:
    """Return the undeformed nodes (N, 3) of all yarns of an endless fabric, images included [m]."""
    rows, lattice = _wrapped(space, fabric)
    nodes = [row.seam.nodes(row.start, lattice.vectors[0]) for row in rows]
    for number in range(len(rows), len(space.yarns)):
        below = number - len(rows)
        unity = space.unity[slice(*space.first_node[below : below + 2])]
        nodes.append(nodes[below] + np.multiply.outer(unity, lattice.vectors[1]))
    return np.concatenate(nodes)


def without_images(parts: Discretisation, fabric: Fabric, material: Material) -> Discretisation:
    """Return yarns of which rows alone have elements; one node is held and none is driven."""
    rows = Space(parts.splines.yarns[: rows_of(fabric)])
    return replace(
        parts,
        groups=lambda nodes: span_groups(rows, nodes[: rows.size], material),
        volume=partial(_volume, parts.volume, rows),
        ends=Grips(HELD, HELD[:0]),
    )


def _volume(every: Callable[..., Floats], rows: Space, groups: tuple[ElementGroup, ...]) -> Floats:
    """Return the volume (N,) of every node [m3], of the image above the rows as of the first yarn."""
    total = every(groups)
    first = rows.yarns[0].size
    total[rows.size : rows.size + first] = total[:first]
    return total


@dataclass(frozen=True, eq=False)
class WrappedYarn:
    """A yarn that wraps around."""

    seam: Seam
    start: Floats  # (p, 3) its undeformed nodes that wrap around [m]


def _wrapped(space: Space, fabric: Fabric) -> tuple[list[WrappedYarn], Lattice]:
    """Return the yarns of all rows, and the lattice."""
    lattice = Lattice(fabric.periods)
    kinds = {}
    rows = fabric.copy_of[:-1].tolist()
    for one in set(rows):
        own, curve = space.yarns[one], fabric.centrelines[one]
        around = seam(own)
        kinds[one] = around, wrapped_shape(own, around, curve, fabric.radius, lattice.vectors[0])
    shapes = (kinds[one] for one in rows)
    return [
        WrappedYarn(around, start + np.multiply.outer(around.unity, shift))
        for (around, start), shift in zip(shapes, fabric.shift, strict=False)
    ], lattice


def periodic_map(
    space: Space,  # of all yarns, copies of a yarn share theirs
    rows: list[WrappedYarn],
    lattice: Lattice,  # its second vector is the way of all rows
    nodes: Floats,  # (N, 3), undeformed [m]
) -> tuple[sp.csr_matrix, Floats]:
    """Return S (3 N, 3 n) and the jumps (3 N, 6) of all yarns, images of the rows after these."""
    every = sp.block_diag([row.seam.wrapped for row in rows], format="csr")
    copies = -(-len(space.yarns) // len(rows))
    wrapped = sp.vstack(copies * [every], format="csr")[: space.size]
    spread = sp.csr_matrix(sp.kron(wrapped, sp.identity(3)))
    jumps = []
    for row in rows:
        over = lattice.jumps(0, row.start, row.seam.unity)
        jumps.append((row.seam.beyond @ over.reshape(len(over), -1)).reshape(-1, 3, 6))
    for below in range(len(space.yarns) - len(rows)):
        here = slice(*space.first_node[below : below + 2])
        jumps.append(jumps[below] + lattice.jumps(1, nodes[here], space.unity[here]))
    return spread, np.concatenate(jumps).reshape(3 * space.size, 6)


def wrapped_shape(own: YarnSpace, around: Seam, curve: Centreline, radius: float, period: Floats) -> Floats:
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
