"""Bending of a jersey whose yarns touch, by beams and by solid yarns; docs/notes/periodic_cell.md has the table.

``python benchmarks/bending.py`` takes some three minutes. An endless jersey without friction is stretched in both
directions, and bent along its wales by 0.02 rad a period, up and down, with both strains held. The first-order jumps
of solid yarns from a row to its images above leave out that forces on images turn with them: f . d2x / dphi2, and the
same by the nodes. These terms come from the forces at the stretch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from knitstudy import load_scene
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.solve import settings_of
from knitstudy.knit.models.beam.bending import bent
from knitstudy.knit.models.beam.cell import HELD
from knitstudy.knit.models.beam.cell import build as build_beams
from knitstudy.knit.models.spline_yarns.build import discretise
from knitstudy.knit.models.spline_yarns.cell import problem, rows_of
from knitstudy.mechanics.cells.solids import PeriodicModel
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace

STRAINS = (0.01, 0.02, 0.03)
ANGLE = 0.02  # of a period [rad]
BASE = {
    "interaction": "isotropic",
    "contact.friction": 0.0,
    "load.deformation": "biaxial",
    "load.lateral": "fixed",
    "solver.increments": 6,
}
BEAMS = {"fidelity": "beam", "beam.section": "hertz"}


@dataclass(eq=False)
class Turning:
    """A model and terms that are linear in the change of its unknowns; a state is one of the model, and the change."""

    model: PeriodicModel
    terms: sp.csr_matrix
    block = 3

    def __post_init__(self) -> None:
        self.size, self.scale, self.length = self.model.size, self.model.scale, self.model.length

    def start(self) -> Any:
        """Return the undeformed state."""
        return self.model.start(), np.zeros(self.size)

    def begin(self, state: Any, load: float, change: float) -> Any:
        """Return the state in which an increment starts."""
        return self.model.begin(state[0], load, change), state[1]

    def settle(self, state: Any) -> Any:
        """Return None, or the state to balance again."""
        settled = self.model.settle(state[0])
        return None if settled is None else (settled, state[1])

    def commit(self, state: Any) -> Any:
        """Return the state that an increment leaves."""
        return self.model.commit(state[0]), state[1]

    def advance(self, state: Any, step: Floats) -> Any:
        """Return the state a step further."""
        return self.model.advance(state[0], step), state[1] + step

    def respond(self, state: Any, stiffness: bool) -> Any:
        """Return forces and tangent with the terms."""
        answer = self.model.respond(state[0], stiffness)
        tangent = sp.csr_matrix(answer.stiffness + self.terms) if stiffness else None
        return replace(answer, force=answer.force + self.terms @ state[1], stiffness=tangent)


def solids(strain: float, degree: int) -> Floats:
    """Return force per width [N/m], moment per width [N] and bending stiffness [N m] along the wales of solid yarns."""
    keys = BASE | {"load.strain": strain, "mesh.crossing_degree": degree, "mesh.degree": min(degree, 3)}
    scene = load_scene("stitches-plain-course").vary(keys)
    fabric = fabric_of(lay_out(scene))
    parts = discretise(scene, fabric)
    flat = problem(scene, fabric, parts)
    *_, last = flat.increments()
    cell = flat.observer
    space = parts.splines
    rows = rows_of(fabric)
    model = cell.yarns.model
    state = replace(last.state, step=None)
    place = parts.nodes + model.node_displacement(state)
    force = model.respond(state, False).force.reshape(-1, 3)
    width, u = (1 + strain) * np.linalg.norm(cell.lattice.vectors, axis=1)
    up, across = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    turn = np.cross(up, across)
    first, second, nodes = (np.zeros((len(place), 3)) for _ in range(3))
    for yarn in range(rows, len(space.yarns)):
        j, own = divmod(yarn, rows)
        here, of = (slice(*space.first_node[k : k + 2]) for k in (yarn, own))
        arc = space.unity[here, None] * u
        once = j * np.cross(turn, place[of])
        first[here] = once + arc * j**2 / 2 * np.cross(turn, across)
        second[here] = j * np.cross(turn, once) - arc * j**3 / 3 * across
        nodes[of] += j * np.cross(force[here], turn)
    spread = sp.hstack([cell.spread, cell.model.spread[:, -3:-1], sp.csr_matrix(first.reshape(-1, 1) / u)])
    periodic = PeriodicModel(model, sp.csr_matrix(spread))
    column = np.append(cell.spread.T @ nodes.ravel() / u, [0.0, 0.0, np.vdot(force, second) / u**2])
    ends = np.arange(periodic.size)
    last_one = np.full(periodic.size, periodic.size - 1)
    entries = np.append(column, column[:-1]), (np.append(ends, last_one[1:]), np.append(last_one, ends[:-1]))
    turning = Turning(periodic, sp.csr_matrix(entries, shape=2 * (periodic.size,)))
    begun = state, np.zeros(turning.size)
    moments = []
    for angle in (ANGLE, -ANGLE):
        held = np.append(np.arange(3), turning.size - np.arange(3, 0, -1))
        path = PrescribedDisplacement(held, np.append(np.zeros(5), angle * u))
        start = Increment(0, 0.0, begun, turning.respond(begun, False), 1.0)
        *_, bent_one = trace(turning, path, replace(flat.settings, increments=1), flat.solver, resume=start)
        moments.append(float(bent_one.response.force[-1]) * u / width)
    pull = last.response.force[cell.model.lattice][1] * cell.lattice.lengths[1] / cell.lattice.area
    return np.array([pull, np.vdot(force, first) / width, (moments[0] - moments[1]) / (2 * ANGLE) * u])


def beams(strain: float, size: float) -> Floats:
    """Return the same of beams that are `size` radii long."""
    scene = load_scene("stitches-plain-course").vary(
        BEAMS | BASE | {"load.strain": strain, "mesh.beam_size": size}
    )
    flat = build_beams(scene, fabric_of(lay_out(scene)))
    *_, last = flat.increments()
    lattice = flat.model.lattice
    pull = last.response.force[flat.model.lattice_unknowns][1] * lattice.lengths[1] / lattice.area
    stretched = replace(flat.observer, model=flat.model.starting_at(last.state))
    model = bent(scene, stretched, along=1)
    u, width = model.per_curvature
    held = np.append(HELD, model.size - np.arange(4, 0, -1))
    settings = replace(settings_of(scene.solver, touches=True), increments=1)
    moments = []
    for angle in (ANGLE, -ANGLE):
        path = PrescribedDisplacement(held, np.append(np.zeros(len(held) - 1), angle))
        *_, bent_one = trace(model, path, settings, LU())
        moments.append(float(bent_one.response.force[-1]) / width)
    flat_moment = model.respond(model.start(), False).force[-1] / width
    return np.array([pull, flat_moment, (moments[0] - moments[1]) / (2 * ANGLE) * u])


if __name__ == "__main__":
    print("strain  model  wale force [N/m]  moment [N]  stiffness [N m]")
    for strain in STRAINS:
        for name, values in (
            *((f"solid yarns, degree {degree}", solids(strain, degree)) for degree in (3, 4)),
            *((f"beams of {size:g} R", beams(strain, size)) for size in (0.4, 0.28)),
        ):
            print(f"{strain:g}  {name}  {values[0]:.2f}  {values[1]:.5f}  {values[2]:.4e}", flush=True)
