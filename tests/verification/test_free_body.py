"""A yarn that nothing holds before others touch it: led there by a drag that the result does not know."""

import numpy as np
from contact_bodies import MODULUS, back, drive, law, reaction, together, yarn
from curves import Straight

from knitstudy.knit.mesh.section import SectionMesh
from knitstudy.mechanics.core.increment import Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import DRAG, FADED

SIZE, RADIUS, GAP = 0.4, 1.0, 0.01
DOWN = np.array([0, 0, -1.0])


class Stack:
    """A free yarn along y between two held ones below it and two driven ones above it, a gap apart from each."""

    def __init__(self, friction=np.inf):
        section, rise = SectionMesh.butterfly(3, 1), 2 * RADIUS + GAP
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
        volume[: first[4]] = 0.0  # the last yarn alone is free
        self.model.drag = np.repeat(DRAG * MODULUS * volume / SIZE**2, 3)
        self.held = np.concatenate([first[i] + back(bodies[i], DOWN) for i in (0, 1)])
        self.driven = np.concatenate([first[i] + back(bodies[i], -DOWN) for i in (2, 3)])

    def press(self, depth, increments):
        settings = Settings(
            increments=increments, residual_tolerance=1e-6, correction_tolerance=1e-6, predictor=1
        )
        path = np.array([(2 * GAP + depth) * DOWN])
        return list(trace(self.model, drive(self.held, self.driven, path), settings, LU()))

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


def test_drag_carries_next_to_nothing(verify):
    stack = Stack()
    _, loose, *_, last = stack.press(0.043, 6)  # the first increment ends before the lower yarns are touched
    assert last.state.led == FADED
    final = stack.force(last)
    verify.within("free yarn: force below over above", reaction(last, stack.held)[2] / final, 1.0, 1e-6)
    verify.at_most("free yarn: drag over force", last.response.viscous_force / final, 1e-6)
    verify.at_most(
        "free yarn: force before anything holds it, over that at the end", stack.force(loose) / final, 1e-4
    )
    taken = last.response.energy
    verify.at_most(
        "free yarn: work of the drag over energy", taken["stabilisation"] / taken["internal"], 1e-5
    )
