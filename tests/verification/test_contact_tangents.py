"""Contact and friction: tangents against central differences, and the order of Newton's method."""

import numpy as np
import pytest
from contact_bodies import crossed_yarns, law, touching

from knitstudy.mechanics.contact.friction import SLIP, STICK, ContactHistory

SIZE = 0.4  # element size of the yarns, whose radius is 1

ROUGH = np.inf


class Crossing:
    """Two crossing yarns whose surface nodes go wherever a case puts them."""

    def __init__(self, friction):
        coulomb = law(SIZE, friction, tangential=7.0)
        self.nodes, _, first, self.contact = touching(
            crossed_yarns(3, 1, gap=0.02), coulomb, margin=0.3, overlap=1e-3
        )
        self.upper = np.arange(len(self.nodes)) >= first[1]
        self.noise = 0.01 * np.random.default_rng(0).normal(size=self.nodes.shape)

    def moved(self, shift):
        """Nodes with the upper yarn shifted, and all of them disturbed."""
        return self.nodes + self.noise + np.where(self.upper[:, None], shift, 0.0)

    def tangent_error(self, nodes, before, history):
        """Difference of the tangent from central differences, over their size, and the status of all points."""
        direction = np.random.default_rng(1).normal(size=nodes.shape)
        answer = self.contact.forces(self.contact.points(nodes, before, history), stiffness=True)
        exact = answer.stiffness @ direction.ravel()
        step = 1e-6
        plus, minus = (
            self.contact.forces(
                self.contact.points(nodes + sign * step * direction, before, history), stiffness=False
            )
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


@pytest.mark.parametrize("name", ["slip", "rough"])
def test_tangent_of_first_touch(name, verify):
    """Points that close within the increment have slid in contact only since."""
    friction, expected = BRANCHES[name]
    crossing = Crossing(friction)
    before, history = crossing.history([0.0, 0.0, 0.02])
    assert not history.pressure.any()
    error, points = crossing.tangent_error(crossing.moved([0.3, 0.1, -0.08]), before, history)
    closing = points.slip_share[points.active]
    assert np.all((closing > 0) & (closing < 1))
    assert set(points.status[points.active]) == expected
    verify.at_most(f"tangent of first touch, {name}", error, 1e-6, "central differences")


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
