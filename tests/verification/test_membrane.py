"""Membranes of finite strain: tangent, patch test, uniaxial tension, and strips between clamps under refinement."""

import numpy as np
import pytest
from refusals import refusal
from scipy.optimize import brentq

from knitstudy.use.fabric_law import stretch_strip
from knitstudy.use.membrane_law import ExponentialLaw, MembraneModel, forces_per_width, rectangle, strains

# A fabric with a J-shaped curve that contracts nearly as much as it stretches [N/m]
FABRIC = ExponentialLaw(
    np.diag([60.0, 110.0, 15.0]),
    np.array([4.0, 1.0, 3.0]),
    np.array([[6.0, 3.0, 0], [2.0, 14.0, 0], [-8.0, 0, 0]]),
)
COUPLED = ExponentialLaw(
    np.array([[15.0, 6.0, 0.9], [6.0, 24.0, 0.3], [0.9, 0.3, 6.0]]),
    np.array([2.0]),
    np.array([[3.0, -2.0, 1.0]]),
)


def irregular(degree, seed=0):
    """Nodes, elements and numbers of a rectangle whose elements have moved corners and straight edges."""
    corners, _, _ = rectangle((2.0, 1.0), (4, 3), 1)
    _, elements, number = rectangle((2.0, 1.0), (4, 3), degree)
    moved = corners + 0.05 * np.random.default_rng(seed).uniform(-1, 1, corners.shape)
    if degree == 1:
        return moved, elements, number
    grid, fine = moved.reshape(5, 4, 2), np.empty((9, 7, 2))
    fine[::2, ::2] = grid
    fine[1::2, ::2] = 0.5 * (grid[1:] + grid[:-1])
    fine[:, 1::2] = 0.5 * (fine[:, :-1:2] + fine[:, 2::2])
    return fine.reshape(-1, 2), elements, number


@pytest.mark.parametrize("degree", [1, 2])
def test_patch_of_irregular_elements_strains_evenly(degree):
    nodes, elements, number = irregular(degree)
    model = MembraneModel(nodes, elements, COUPLED)
    gradient = np.array([[0.3, 0.1], [-0.05, -0.2]])
    state = nodes @ gradient.T
    expected = strains(np.eye(2) + gradient)
    np.testing.assert_allclose(
        strains(model.deformation(state)), np.broadcast_to(expected, (12, (degree + 1) ** 2, 3)), atol=1e-13
    )
    inner = number[1:-1, 1:-1].ravel()
    force = model.respond(state, False).force.reshape(-1, 2)
    np.testing.assert_allclose(force[inner], 0, atol=1e-12 * np.abs(force).max())


def test_folded_elements_are_refused():
    nodes, elements, _ = rectangle((1.0, 1.0), (2, 1), 1)
    nodes[0, 0] = 1.5
    with refusal("folded"):
        MembraneModel(nodes, elements, FABRIC)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_strip_free_across_is_in_uniaxial_tension(axis):
    actual = stretch_strip(FABRIC, 0.07, 0.04, 0.3, axis, clamped=False)

    def stretch(across):
        return np.array([0.3, across, 0.0]) if axis == 0 else np.array([across, 0.3, 0.0])

    across = brentq(lambda x: forces_per_width(FABRIC, stretch(x))[1 - axis], -0.5, 0.0, xtol=1e-14)
    assert actual["waist"][-1] == pytest.approx(1 + across, abs=1e-6)  # Newton: 1e-6
    assert actual["force_per_width"][-1] == pytest.approx(
        forces_per_width(FABRIC, stretch(across))[axis], rel=1e-8
    )


def test_a_wide_strip_between_clamps_is_held_across_and_a_long_one_is_free():
    held = forces_per_width(FABRIC, np.array([0.1, 0.0, 0.0]))[0]
    free = float(stretch_strip(FABRIC, 1.0, 1.0, 0.1, clamped=False)["force_per_width"][-1])
    wide, long = (
        float(stretch_strip(FABRIC, 1.0, width, 0.1, elements=8)["force_per_width"][-1])
        for width in (100.0, 0.05)
    )
    # What is left are edges: a width of the order of the length, and ends of the order of the width.
    assert wide == pytest.approx(held, rel=0.01)
    assert long == pytest.approx(free, rel=0.02)
    assert held > 1.1 * free


def test_strips_converge_under_refinement():
    """Singular corners leave the first order; a membrane with half the elements misses the force by 1e-3."""
    forces = [
        float(stretch_strip(FABRIC, 0.0455, 0.0959, 0.1, 1, elements=count)["force_per_width"][-1])
        for count in (3, 6, 12)
    ]
    assert forces[0] > forces[1] > forces[2], "displacements that may do less are stiffer"
    assert forces[1] - forces[2] < 0.6 * (forces[0] - forces[1])
    assert forces[1] == pytest.approx(forces[2], rel=2e-3)


def test_a_strip_that_finds_no_equilibrium_is_refused():
    with refusal("finds no equilibrium at a strain of -1") as refused:
        stretch_strip(FABRIC, 1.0, 1.0, -1.0, elements=1)
    assert refused.value.history["strain"][-1] < 0  # what was found before


def test_a_strip_ends_at_its_largest_force():
    force = stretch_strip(FABRIC, 1.0, 1.0, 0.3, elements=2, largest_force=50.0)["force_per_width"].to_numpy()
    assert force[-1] >= 50.0 > force[-2]
