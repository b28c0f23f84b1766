"""Rods that are beams at both ends and a solid yarn between, against rods of one kind and against closed forms."""

import numpy as np
import pytest
from polynomial_rods import AREA, INERTIA, POISSON, RADIUS, SHEAR, YOUNG, Rod, arc, straight
from test_beam_tangents import differences

from knitstudy.mechanics.beam import Section
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.rotation import exp
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.solids_and_beams import Seams, SolidsAndBeams

LENGTH = 12.0  # A third of it is solid

PIECES = 4  # beams on either side


class Joined:
    """A rod along a curve: beams, a solid yarn, beams."""

    def __init__(self, curve=straight, degrees=3):
        cuts = np.array([LENGTH / 3, 2 * LENGTH / 3])
        rod = Rod(lambda s: curve(s + cuts[0]), np.linspace(0, LENGTH / 3, 6), degrees)
        solids = SolidModel(rod.nodes, rod.groups, RADIUS)
        s = np.concatenate([np.linspace(0, cuts[0], PIECES + 1), np.linspace(cuts[1], LENGTH, PIECES + 1)])
        first = np.delete(np.arange(len(s) - 1), PIECES)
        section = Section.circular(2 * RADIUS, YOUNG, POISSON)
        beams = BeamModel(curve(s)[0], np.column_stack([first, first + 1]), section, RADIUS)
        ends = np.stack([rod.end(False)[:3], rod.end(True)[:3]])
        seams = Seams(ends, np.array([PIECES, PIECES + 1]), rod.nodes[ends[:, 1:]])
        self.model = SolidsAndBeams(solids, beams, seams)
        self.last = len(s) - 1

    def unknowns(self, node, components):
        return self.model.first_beam + 6 * node + np.array(components)

    def pull(self, components, value, held=range(6), increments=1):
        """Return the model's state and the reaction (6,) at the last node that is moved by values."""
        fixed = np.concatenate([self.unknowns(0, held), self.unknowns(self.last, components)])
        values = np.concatenate([np.zeros(len(held)), value])
        settings = Settings(increments=increments, residual_tolerance=1e-7, correction_tolerance=1e-7)
        *_, last = trace(self.model, PrescribedDisplacement(fixed, values), settings, LU())
        return last.state, last.response.force[self.unknowns(self.last, range(6))]


SMALL = 1e-5

CLOSED = {
    "tension": ([2], SMALL * LENGTH, 2, YOUNG * AREA * SMALL),
    "torsion": ([0, 1, 2, 5], SMALL * LENGTH, 5, SHEAR * 2 * INERTIA * SMALL),
    "bending": ([4], SMALL * LENGTH, 4, YOUNG * INERTIA * SMALL),
}


@pytest.mark.parametrize("name", CLOSED)
def test_straight_rod(name, verify):
    """Tension, torsion and bending of a rod that is solid in its middle are those of the whole rod."""
    components, moved, component, exact = CLOSED[name]
    rod = Joined()
    value = np.zeros(len(components))
    value[-1] = moved
    state, reaction = rod.pull(components, value)
    verify.within(f"rod, partly solid: {name}", reaction[component], exact, 1e-4)
    force, moment = rod.model.seam_forces(state)
    jump = np.abs(force.sum(axis=1)).max() + np.abs(moment.sum(axis=1)).max() / RADIUS
    level = np.abs(force).max() + np.abs(moment).max() / RADIUS
    verify.at_most(f"rod, partly solid: {name}, jump of force and moment over them", jump / level, 1e-7)


def test_rigid_motion(verify):
    """A rotation by any angle gives no force, in the solid, in the beams, and at the seams."""
    model = Joined(arc(0.2)).model
    rotation, shift = exp(np.array([1.1, -0.7, 2.0])), np.array([1.0, -2.0, 3.0])
    step = np.zeros(model.size)
    beams = model.beams.nodes @ rotation.T + shift - model.beams.nodes
    step[model.first_beam :] = np.concatenate(
        [beams, np.tile([1.1, -0.7, 2.0], (len(beams), 1))], axis=1
    ).ravel()
    nodes = model.solids.nodes
    at_place = (np.arange(len(nodes)) % 10 == 0)[:, None]  # degree 3: ten functions a section
    moved = nodes @ rotation.T + at_place * shift - nodes
    step[: model.first_width] = moved.ravel()[model._own]
    force = model.respond(model.advance(model.start(), step), False).force
    verify.at_most(
        "rod, partly solid: rigid motion, force over E R^2", np.abs(force).max() / (YOUNG * RADIUS**2), 1e-10
    )


def bent_state(rod):
    """A state of large rotations with some strain everywhere."""
    state, _ = rod.pull([0, 1, 2, 3, 4, 5], [1.0, 0.5, -0.8, 0.2, 0.5, 0.6], increments=6)
    rng = np.random.default_rng(3)
    model = rod.model
    return model.begin(model.advance(state, 0.01 * rng.normal(size=model.size)), 1.0, 1.0)


def test_tangent_equals_central_differences(verify):
    rod = Joined(arc(0.2), degrees=2)
    model, state = rod.model, bent_state(rod)
    tangent = model.respond(state, True).stiffness.toarray()
    level = np.abs(tangent).max()
    errors = [np.abs(differences(model, state, step) - tangent).max() / level for step in (4e-4, 2e-4)]
    verify.at_most("tangent, solids and beams", errors[1], 1e-6, "central differences")
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)  # falls as the square of the step
