"""Two equal crossed cylinders pressed on each other, against Hertz and against finer meshes of the same."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from contact_bodies import MODULUS, POISSON, back, crossed_yarns, law, touching
from hexahedral_block import unknowns

from knitstudy.mechanics.contact.friction import ContactHistory
from knitstudy.mechanics.contact.solid import Penetration, SolidModel
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU, factorise
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import Response
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.elements.hexahedron import OnePointHexahedron

DIAMETER, LENGTH, PRESS = 1.0, 2.0, 0.05

CONVERGED = 9.56
"""Force at PRESS of these cylinders and supports as the elements vanish; +- 0.03.

Extrapolated with the square of the element size from 12, 16 and 24 elements across (8.678, 9.091, 9.346): 9.57 from
the first and the last, 9.55 from the last two.
"""

REACH = 0.42  # distance from the crossing up to which surface nodes can move; the contact's radius is 0.16.


@dataclass(frozen=True)
class Patch:
    """Surface nodes (p,) of a body, and the stiffness (3 p, 3 p) that its solids give them."""

    nodes: np.ndarray
    stiffness: np.ndarray


def condensed(body, away, size):
    """The patch that a body, held at its back, offers to the other one.

    Hertz's theory is one of small strains: so is this, and the contact is all that is not linear.
    """
    element = OnePointHexahedron(body.nodes[body.hexahedra], Hencky(MODULUS, POISSON))
    model = SolidModel(body.nodes, [ElementGroup(body.hexahedra, element)], size)
    stiffness = model.respond(model.start(), stiffness=True).stiffness.tocsr()
    held = back(body, away)
    free = np.setdiff1d(np.arange(model.size), unknowns(held))
    surface = np.unique(body.surface.nodes)
    nodes = np.setdiff1d(surface[np.linalg.norm(body.nodes[surface], axis=1) < REACH], held)
    place = np.searchsorted(free, unknowns(nodes))
    load = np.zeros((len(free), len(place)))
    load[place, np.arange(len(place))] = 1
    compliance = factorise(stiffness[free][:, free].tocsc()).solve(load)[place]
    return Patch(nodes, np.linalg.inv(0.5 * (compliance + compliance.T)))


@dataclass(frozen=True)
class State:
    """Displacement (n, 3) now and at the last converged increment, the contact's history, and updates so far."""

    displacement: np.ndarray
    before: np.ndarray
    history: ContactHistory
    augmentations: int = 0


class Cylinders:
    """Both surfaces as a model: their patches follow the stiffness of the solids, the rest of them is prescribed.

    Displacements of a patch count from those of the first node of its body, which moves with the support.
    """

    block = 3

    def __init__(self, core, rings, *, limit, augmentations, points):
        self.length = DIAMETER / (core + 2 * rings)
        bodies = crossed_yarns(core, rings, radius=0.5 * DIAMETER, length=LENGTH)
        gaps = {"margin": 0.5 * self.length, "overlap": 1e-3 * self.length}
        self.nodes, _, first, self.contact = touching(bodies, law(self.length), points=points, **gaps)
        self.penetration = Penetration(limit, augmentations)
        self.size = self.nodes.size
        self.scale = np.ones(self.size)
        self.lower, self.upper = np.split(np.arange(len(self.nodes)), [first[1]])
        patches = [
            condensed(body, np.array([0, 0, z]), self.length)
            for body, z in zip(bodies, (-1.0, 1.0), strict=True)
        ]
        moving = [patch.nodes + low for patch, low in zip(patches, first[:-1], strict=True)]
        self.moving = np.concatenate(moving)
        unit = sp.identity(self.size, format="csr")
        relative = sp.vstack(
            [
                unit[unknowns(nodes)] - sp.vstack([unit[3 * low : 3 * low + 3]] * len(nodes))
                for nodes, low in zip(moving, first[:-1], strict=True)
            ]
        )
        inner = sp.block_diag([patch.stiffness for patch in patches])
        # Prescribed nodes need some stiffness to be eliminated like any others.
        self.still = np.setdiff1d(np.arange(len(self.nodes)), self.moving)
        diagonal = np.zeros(self.size)
        diagonal[unknowns(self.still)] = MODULUS * self.length
        self.stiffness = sp.bsr_matrix(relative.T @ inner @ relative + sp.diags(diagonal), blocksize=(3, 3))

    def start(self):
        rest = np.zeros_like(self.nodes)
        return State(rest, rest, ContactHistory.empty())

    def begin(self, state, load, change):
        return replace(state, augmentations=0)

    def advance(self, state, step):
        return replace(state, displacement=state.displacement + step.reshape(-1, 3))

    def points(self, state):
        return self.contact.points(self.nodes + state.displacement, self.nodes + state.before, state.history)

    def respond(self, state, stiffness):
        touch = self.contact.forces(self.points(state), stiffness)
        force = (self.stiffness @ state.displacement.ravel()).reshape(-1, 3)
        return Response(
            force=(force + touch.node_force).ravel(),
            mean_force=float(np.linalg.norm(force[self.moving], axis=1).mean()),
            stiffness=sp.bsr_matrix(self.stiffness + touch.stiffness) if stiffness else None,
            node_force=touch.node_force,
            status=touch.points.signature(),
        )

    def settle(self, state):
        points = self.points(state)
        if -self.contact.smallest_gap(points) <= self.penetration.limit:
            return None
        assert state.augmentations < self.penetration.augmentations
        return replace(state, history=self.contact.augment(points), augmentations=state.augmentations + 1)

    def commit(self, state):
        return replace(state, before=state.displacement, history=self.contact.commit(self.points(state)))

    def force(self):
        """Force that presses the cylinders on each other by PRESS."""
        value = np.zeros((len(self.still), 3))
        value[np.isin(self.still, self.upper), 2] = -PRESS
        settings = Settings(increments=3, residual_tolerance=1e-7, correction_tolerance=1e-5)
        *_, end = trace(self, PrescribedDisplacement(unknowns(self.still), value.ravel()), settings, LU())
        return abs(end.response.node_force[self.upper, 2].sum())


BARS = {(4, 2): 0.20, (6, 3): 0.10, (8, 4): 0.055}
"""What holds, by core and rings: 19%, 9% and 5% are missing at 8, 12 and 16 elements across.

The elements lack it, not the contact: twice as
many elements along the yarn gain 2% at 8, and so does a tenfold hourglass stiffness. The contact's radius is 1.3
elements at 8 across. What is missing falls with the square of the element size.
"""

HERTZ = 8.157
"""4/3 E* sqrt(R) delta^1.5 with E* = E / (2 (1 - nu^2)): of two half spaces, which are softer than held cylinders."""


def test_hertz(full, verify):
    """Force at full approach, augmented until the penetration is 0.1% of it, and with the penalty alone."""
    sections = list(BARS) if full else [(4, 2)]
    forces = []
    for core, rings in sections:
        across = core + 2 * rings
        options = {"points": 3 if full else 2}
        force = Cylinders(core, rings, limit=1e-3 * PRESS, augmentations=200, **options).force()
        raw = Cylinders(core, rings, limit=np.inf, augmentations=0, **options).force()
        forces.append(force)
        verify.within(
            f"crossed cylinders, {across} elements across: force", force, CONVERGED, BARS[core, rings]
        )
        verify.within(
            f"crossed cylinders, {across} elements across, penalty alone: force",
            raw,
            CONVERGED,
            0.06 + BARS[core, rings],
        )
        verify.within(
            f"crossed cylinders, {across} elements across: force of half spaces (Hertz)", force, HERTZ, 0.12
        )
    assert np.all(np.diff(forces) > 0)
    if full:
        rate = np.log((CONVERGED - forces[0]) / (CONVERGED - forces[-1])) / np.log(2)
        verify.at_least("crossed cylinders, 8 to 16 elements across: order of the force", rate, 1.8, "2")
