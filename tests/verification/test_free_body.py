"""A yarn that nothing holds before others touch it: led there by a drag that the result does not know."""

import numpy as np
from contact_bodies import MODULUS, back, drive, law, reaction, together, yarn
from curves import Straight

from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.mechanics.model import FreeBodies
from knitstudy.mesh.section import Section

SIZE, RADIUS, GAP = 0.4, 1.0, 0.01
DOWN = np.array([0, 0, -1.0])


class Stack:
    """A free yarn along y between two held ones below it and two driven ones above it, a gap apart from each."""

    def __init__(self, friction=np.inf):
        section, rise = Section.butterfly(3, 1), 2 * RADIUS + GAP
        across = [(y, z) for z in (-rise, rise) for y in (-1.5, 1.5)]
        curves = [Straight(4.0, (-2.0, y, z)) for y, z in across]
        curves.append(Straight(6.0, (0, -3.0, 0), (0, 1.0, 0)))
        bodies = [
            yarn(curve, RADIUS, section, SIZE, facing=curve.position([0.5 * curve.length])[0] * [0, 1, 0])
            for curve in curves
        ]
        self.model, first = together(bodies, law(SIZE, friction), size=SIZE)
        each = np.repeat(self.model.groups[0].elements.volume / 8, 8)
        volume = np.bincount(self.model.groups[0].connectivity.ravel(), each, len(self.model.nodes))
        self.model.free_bodies = FreeBodies.of([np.arange(first[4], first[5])], volume, MODULUS, SIZE)
        self.held = np.concatenate([first[i] + back(bodies[i], DOWN) for i in (0, 1)])
        self.driven = np.concatenate([first[i] + back(bodies[i], -DOWN) for i in (2, 3)])

    def press(self, depth, increments):
        settings = Settings(
            increments=increments, residual_tolerance=1e-6, correction_tolerance=1e-6, predictor=1
        )
        path = np.array([(2 * GAP + depth) * DOWN])
        return list(trace(self.model, drive(self.held, self.driven, path), settings, LU()))

    def holds(self, state):
        """Whether contact holds the free yarn in a state."""
        touch = self.model.contact.forces(self.model.contact_points(state), stiffness=True)
        return self.model.free_bodies.held(touch.symmetric, self.model.nodes + state.displacement)

    def force(self, increment):
        return -reaction(increment, self.driven)[2]


def test_only_yarns_that_have_not_touched_yet_are_pulled_together():
    """The first guess of an increment balances the pull of open gaps, and no force once yarns touch."""
    stack = Stack()
    rest, *_, last = stack.press(0.043, 1)
    for increment, pulled in ((rest, True), (last, False)):
        begun = stack.model.begin(increment.state, 1.0, 0.5)
        response = stack.model.respond(begun, stiffness=True)
        assert response.pulled == pulled
        assert not stack.model.respond(stack.model.advance(begun, 0 * response.force), stiffness=True).pulled
    assert (
        np.abs(stack.model.respond(stack.model.begin(rest.state, 1.0, 1.0), stiffness=True).force).max() > 0
    )


def test_drag_has_died_out(verify):
    """What is left of its work bounds what the result can know of it."""
    stack = Stack()
    increments = stack.press(0.043, 6)  # no increment ends where the gap just closes
    assert not stack.holds(increments[0].state)
    assert stack.holds(increments[-1].state)
    assert increments[-1].state.led == 0.0
    carried = reaction(increments[-1], stack.held)[2]
    verify.within(
        "free yarn: force below it over that above it", carried / stack.force(increments[-1]), 1.0, 1e-6
    )
    led = [each for each in increments[1:] if each.state.led]
    assert led, "the first increment ends before all yarns touch"
    felt = max(abs(stack.force(each)) for each in led) / stack.force(increments[-1])
    verify.at_most("free yarn: force before anything holds it, over that at the end", felt, 1e-3)
    taken = increments[-1].response.energy
    verify.at_most(
        "free yarn: work of the drag over energy", taken["stabilisation"] / taken["internal"], 1e-3
    )
