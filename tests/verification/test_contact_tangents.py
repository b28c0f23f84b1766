"""Contact and friction: tangents against central differences, and the order of Newton's method."""

from dataclasses import replace

import numpy as np
import pytest
from contact_bodies import back, crossed_yarns, drive, joined, law, together
from scipy.sparse.linalg import spsolve

from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK, ContactHistory
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.newton import trace

SIZE = 0.4
"""Element size of the yarns, whose radius is 1."""

ROUGH = np.inf

DISTURBANCES = 1e-4, 5e-5
"""Of balanced nodes, over the element size."""


class Crossing:
    """Two crossing yarns whose surface nodes go wherever a case puts them."""

    def __init__(self, friction):
        self.nodes, _, grids, first = joined(crossed_yarns(3, 1, gap=0.02))
        apart = ~np.eye(2, dtype=bool)
        self.contact = Contact(
            self.nodes,
            Grids(grids),
            law(SIZE, friction, tangential=7.0),
            meets=apart,
            margin=0.3,
            overlap=1e-3,
        )
        self.upper = np.arange(len(self.nodes)) >= first[1]
        self.noise = 0.01 * np.random.default_rng(0).normal(size=self.nodes.shape)

    def moved(self, shift):
        """Nodes with the upper yarn shifted, and all of them disturbed."""
        return self.nodes + self.noise + np.where(self.upper[:, None], shift, 0.0)

    def tangent_error(self, nodes, before, history):
        """Difference of the tangent from central differences, over their size, and the status of all points."""
        direction = np.random.default_rng(1).normal(size=nodes.shape)
        answer = self.contact.respond(nodes, before, history, stiffness=True)
        exact = answer.stiffness @ direction.ravel()
        step = 1e-6
        plus, minus = (
            self.contact.respond(nodes + sign * step * direction, before, history, stiffness=False)
            for sign in (1, -1)
        )
        np.testing.assert_array_equal(plus.points.signature(), minus.points.signature())
        slope = (plus.node_force - minus.node_force).ravel() / (2 * step)
        return np.linalg.norm(slope - exact) / np.linalg.norm(slope), answer.points

    def history(self, shift):
        """What an increment that ends at a shift leaves."""
        nodes = self.moved(shift)
        return nodes, self.contact.commit(self.contact.points(nodes, self.nodes, ContactHistory.empty()))


BRANCHES = {
    "slip": (0.1, {SLIP}),
    "stick": (20.0, {STICK}),
    "stick and slip": (3.0, {STICK, SLIP}),
    "rough": (ROUGH, {STICK}),
    "frictionless": (0.0, {SLIP}),
}


@pytest.mark.parametrize("name", BRANCHES)
def test_tangent_in_contact(name, verify):
    friction, expected = BRANCHES[name]
    crossing = Crossing(friction)
    before, history = crossing.history([0.01, 0.02, -0.08])
    assert np.count_nonzero(history.pressure) > 20
    nodes = crossing.moved([0.03, 0.04, -0.08])
    error, points = crossing.tangent_error(nodes, before, history)
    old = points.history.pressure[points.active] > 0
    assert set(points.status[points.active][old]) == expected
    verify.at_most(f"tangent of contact, {name}", error, 1e-6, "central differences")


@pytest.mark.parametrize("name", ["slip", "stick", "rough"])
def test_tangent_at_first_contact(name, verify):
    """Points that close within the increment have slid for its rest only: that share has a derivative too."""
    friction, expected = BRANCHES[name]
    crossing = Crossing(friction)
    nodes = crossing.moved([0.01, 0.03, -0.08])
    error, points = crossing.tangent_error(nodes, crossing.nodes, ContactHistory.empty())
    assert np.all(points.slip_share[points.active] < 1)
    assert expected <= set(points.status[points.active])
    verify.at_most(f"tangent of first contact, {name}", error, 1e-6, "central differences")


@pytest.mark.parametrize("name", ["slip", "rough"])
def test_tangent_with_multiplier(name, verify):
    friction, _ = BRANCHES[name]
    crossing = Crossing(friction)
    before, history = crossing.history([0.01, 0.02, -0.08])
    nodes = crossing.moved([0.03, 0.04, -0.08])
    history = crossing.contact.augment(crossing.contact.points(nodes, before, history))
    error, points = crossing.tangent_error(crossing.moved([0.03, 0.04, -0.075]), before, history)
    assert np.all(points.history.multiplier[points.active] < 0)
    verify.at_most(f"tangent of contact with multipliers, {name}", error, 1e-6, "central differences")


def test_open_contact_has_neither_force_nor_tangent():
    crossing = Crossing(0.3)
    nodes = crossing.moved([0.01, 0.02, 0.1])
    answer = crossing.contact.respond(nodes, crossing.nodes, ContactHistory.empty(), stiffness=True)
    assert len(answer.points.followed.point) > 0
    assert np.all(answer.points.status == OPEN)
    assert answer.stiffness.nnz == 0
    assert not answer.node_force.any()


@pytest.mark.parametrize(("name", "friction"), [("sticks", ROUGH), ("slips", 0.2)])
def test_newton_converges_quadratically(name, friction, verify):
    """What one exact step leaves of a disturbance falls with its square, where no point changes its status.

    The disturbances are small, so that none does, and halved; a whole iteration either changes the status of some
    point or ends in rounding after its second step.
    """
    bodies = crossed_yarns(3, 1, length=5.0)
    model, first = together(bodies, law(SIZE, friction), size=SIZE)
    up = np.array([0, 0, 1.0])
    held, driven = back(bodies[0], -up), back(bodies[1], up) + first[1]
    motion = drive(held, driven, [[0, 0, -0.1], [0.5, 0.25, -0.1], [0.51, 0.255, -0.1]])
    settings = Settings(increments=12, residual_tolerance=1e-11, correction_tolerance=1e-8)
    *_, start, end = trace(model, motion, settings, LU())
    # The last increment as it was before it was committed.
    balanced = replace(end.state, memory=start.state.memory)
    free = np.setdiff1d(np.arange(model.size), motion.fixed)
    noise = np.zeros(model.size)
    noise[free] = np.random.default_rng(2).normal(size=len(free))
    left = []
    for disturbance in DISTURBANCES:
        state = model.advance(balanced, disturbance * SIZE * noise)
        before = model.respond(state, stiffness=True)
        matrix = before.stiffness.tocsr()[free][:, free].tocsc()
        step = np.zeros(model.size)
        step[free] = spsolve(matrix, -before.force[free])
        after = model.respond(model.advance(state, step), stiffness=False)
        assert after.same_status(before)
        left.append(np.linalg.norm(after.force[free]))
    assert set(before.status[:, 2]) == {STICK if name == "sticks" else SLIP}
    rate = np.log(left[0] / left[1]) / np.log(DISTURBANCES[0] / DISTURBANCES[1])
    verify.at_least(f"Newton's method, contact that {name}: exponent", rate, 1.8, "2")
