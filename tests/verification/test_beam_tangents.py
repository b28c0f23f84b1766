"""Tangents of beams and joints against central differences, at states with large rotations."""

import numpy as np
import pytest

from knitstudy.mechanics.beams.beam import BeamSection, LinearSprings
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import CurvedSection

SECTION = BeamSection(EA=1e3, kGA=4e2, EI=50.0, GJ=30.0)


def network(offsets, arms_turn=True, springs=False, curved=False):
    """Six nodes, a branch, and a random zigzag; optionally with arms at all ends, and with springs."""
    rng = np.random.default_rng(5)
    nodes = np.cumsum(rng.normal(size=(6, 3)), axis=0)
    ends = np.array([[0, 1], [1, 2], [3, 2], [3, 4], [2, 5], [4, 5]])
    arms = 0.4 * rng.normal(size=(6, 2, 3)) if offsets else None
    between = np.array([[0, 4], [5, 1]])
    arm = 0.4 * rng.normal(size=(2, 2, 3)) * offsets
    stiffness = np.array([np.diag([100.0, 300.0, 900.0]), 50 * np.outer([1, 2, 3], [1, 2, 3])])
    joined = LinearSprings(between, arm, stiffness)
    section = CurvedSection(0.7, 1e3, 0.42, 0.4 * rng.normal(size=(6, 3))) if curved else SECTION
    return BeamModel(nodes, ends, section, 0.7, arms, arms_turn, joined if springs else None)


def differences(model, state, step):
    columns = [
        (
            model.respond(model.advance(state, step * column), stiffness=False).force
            - model.respond(model.advance(state, -step * column), stiffness=False).force
        )
        / (2 * step)
        for column in np.eye(model.size)
    ]
    return np.column_stack(columns)


CASES = {
    "nodes": (False, True),
    "rigid arms": (True, True),
    "arms that only follow": (True, False),
    "springs between nodes": (False, True, True),
    "springs between rigid arms": (True, True, True),
    "springs between arms that only follow": (True, False, True),
    "curved rods": (True, True, False, True),
}


@pytest.mark.parametrize("name", CASES)
def test_tangent_equals_central_differences(name, verify):
    model = network(*CASES[name])
    state = model.advance(model.start(), 0.6 * np.random.default_rng(6).normal(size=model.size))
    tangent = model.respond(state, stiffness=True).stiffness.toarray()
    level = np.abs(tangent).max()
    errors = [np.abs(differences(model, state, step) - tangent).max() / level for step in (4e-4, 2e-4)]
    verify.at_most(f"tangent, beams and joints: {name}", errors[1], 1e-6, "central differences")
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)  # falls as the square of the step


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("springs", [False, True])
@pytest.mark.parametrize("offsets", [False, True])
def test_force_is_the_derivative_of_energy(offsets, springs, curved):
    model = network(offsets, springs=springs, curved=curved)
    rng = np.random.default_rng(7)
    state = model.advance(model.start(), 0.6 * rng.normal(size=model.size))
    direction, t = rng.normal(size=model.size), 1e-5
    plus, minus = (
        model.respond(model.advance(state, sign * t * direction), stiffness=False).energy["internal"]
        for sign in (1, -1)
    )
    work = model.respond(state, stiffness=False).force @ direction
    assert (plus - minus) / (2 * t) == pytest.approx(work, rel=1e-8)


def test_ends_turned_against_each_other_by_almost_half_a_turn_give_nan():
    model = network(offsets=False)
    step = np.zeros(model.size)
    step[9] = 0.97 * np.pi
    assert np.isnan(model.respond(model.advance(model.start(), step), stiffness=False).force).any()
