"""Beams joined by springs: closed forms in small motions, balance and the couple that springs leave in large ones."""

import numpy as np
import pytest

from knitstudy.mechanics.beam import LinearSprings, Section
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.newton import trace

SECTION = Section(EA=1e3, kGA=4e2, EI=50.0, GJ=30.0)
LENGTH, ELEMENTS = 2.0, 20
STIFFNESS = np.array([300.0, 20.0, 70.0])


def two_cantilevers(gap, arms):
    """Two beams along x whose tips, `gap` (3,) apart, a spring joins; arms meet halfway, or there are none."""
    x = np.linspace(0, LENGTH, ELEMENTS + 1)
    first = np.column_stack([x, 0 * x, 0 * x])
    second = first + (np.array([LENGTH, 0, 0]) + gap)
    chain = np.column_stack([np.arange(ELEMENTS), np.arange(1, ELEMENTS + 1)])
    offsets = np.array([[gap, -np.asarray(gap)]]) / 2 * arms
    springs = LinearSprings(np.array([[ELEMENTS, ELEMENTS + 1]]), offsets, np.diag(STIFFNESS)[None])
    nodes, ends = np.concatenate([first, second]), np.concatenate([chain, chain + ELEMENTS + 1])
    return BeamModel(nodes, ends, SECTION, 0.2, springs=springs)


def drawn(model, way):
    """Return the final state with the first root held and the second moved by `way` (3,), both without turning."""
    last = len(model.nodes) - 1
    fixed = np.concatenate([np.arange(6), 6 * last + np.arange(6)])
    value = np.concatenate([np.zeros(6), way, np.zeros(3)])
    *_, end = trace(
        model, PrescribedDisplacement(fixed, value), Settings(increments=4, residual_tolerance=1e-8), LU()
    )
    return end.state


def root_forces(model, state):
    """Return forces (2, 3) and moments (2, 3) that the roots carry."""
    loads = model.respond(state, stiffness=False).force.reshape(-1, 2, 3)[[0, -1]]
    return loads[:, 0], loads[:, 1]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_beams_and_spring_in_series(axis, verify):
    """Tip of a cantilever: L / EA along it, L^3 / 3 EI + L / kGA across; the spring's own axis is global."""
    along = LENGTH / SECTION.EA
    across = LENGTH**3 / (3 * SECTION.EI) + LENGTH / SECTION.kGA
    expected = 1 / (2 * (along if axis == 0 else across) + 1 / STIFFNESS[axis])
    model = two_cantilevers([0.0, 0.0, 0.0], arms=False)
    force, _ = root_forces(model, drawn(model, 1e-2 * np.eye(3)[axis]))
    verify.within(f"two cantilevers and a spring along {'xyz'[axis]}", force[1, axis] / 1e-2, expected, 1e-3)


@pytest.mark.parametrize("arms", [True, False])
def test_moments_balance_but_for_the_recorded_couple(arms, verify):
    model = two_cantilevers([0.0, 0.0, 0.3], arms)
    state = drawn(model, np.array([0.4, 0.3, -0.2]))
    force, moment = root_forces(model, state)
    position = state.position[[0, -1]]
    total = (np.cross(position, force) + moment).sum(axis=0)
    couple = model.couples(state).sum(axis=0)
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-8)
    verify.at_most(f"spring, arms {arms}: moments less its couple", np.abs(total + couple).max(), 1e-7)
    # The couple is the way between the points times the force on the second.
    points = model.carried(state, model.springs.ends[0], model.springs.offsets[0])
    np.testing.assert_allclose(couple, np.cross(points[1] - points[0], -force[1]), atol=1e-7)
    assert np.abs(couple).max() > 0.1


@pytest.mark.parametrize(("arms", "order"), [(True, 2), (False, 1)])
def test_order_of_the_couple_in_the_stretch(arms, order):
    model = two_cantilevers([0.0, 0.0, 0.3], arms)
    way = 0.02 * np.array([0.4, 0.3, -0.2])
    large, small = (np.abs(model.couples(drawn(model, part * way)).sum(axis=0)).max() for part in (1, 0.5))
    assert np.log2(large / small) == pytest.approx(order, abs=0.02)
