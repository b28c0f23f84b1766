"""Two rigid yarns, one of them moved: what their contact exerts along prescribed paths."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from crossing_beams import MODULUS, POISSON, RADIUS, SECTION

from knitstudy.mechanics.beam_approach import Curves, Pairs
from knitstudy.mechanics.beam_contact import BeamContact, hertz
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.hertz import Patch
from knitstudy.mechanics.rotation import exp

LAW = hertz(MODULUS, POISSON, RADIUS)
HALF_SPACES = Patch(POISSON)


@dataclass(frozen=True)
class Yarns:
    """A lower yarn along x and an upper one turned about z, bent towards each other, that just touch."""

    angle: float = 90.0  # [deg]
    bends: tuple = (0.0, 0.0)  # kR of either
    friction: float = np.inf
    patch: Patch | None = HALF_SPACES
    half: float = 6 * RADIUS
    count: int = 49

    def model(self):
        s = np.linspace(-self.half, self.half, self.count)
        turn = exp(np.array([0, 0, np.radians(self.angle)]))
        lower, upper = (_arc(s, k / RADIUS) for k in self.bends)
        nodes = np.concatenate([lower - [0, 0, RADIUS], (upper * [1, 1, -1]) @ turn.T + [0, 0, RADIUS]])
        curves = Curves(np.repeat([0, 1], self.count), np.tile(s + self.half, 2))
        window = np.array([[[self.half - 3 * RADIUS, self.half + 3 * RADIUS]] * 2])
        pairs = Pairs(np.array([[0, 1]]), window, np.full((1, 2), self.half))
        stations = np.arange(len(nodes)), np.zeros((len(nodes), 3))
        contact = BeamContact(curves, pairs, *stations, RADIUS, LAW, self.friction, patch=self.patch)
        chain = np.column_stack([np.arange(self.count - 1), np.arange(1, self.count)])
        ends = np.concatenate([chain, chain + self.count])
        return BeamModel(nodes, ends, SECTION, RADIUS, contact=contact)

    def carried(self, places, turns=None, whole=None):
        """Yield the force on the lower yarn, points and history at every place (m, 3) of the upper one.

        `turns` (m, 3) turn the upper yarn about the crossing, `whole` (m, 3) everything.
        """
        model = self.model()
        state, start = model.start(), model.start()
        upper = np.arange(len(state.position)) >= self.count
        for n, place in enumerate(places):
            own = exp(np.asarray(turns[n])) if turns is not None else np.eye(3)
            all_ = exp(np.asarray(whole[n])) if whole is not None else np.eye(3)
            position = np.where(upper[:, None], start.position @ own.T + place, start.position) @ all_.T
            rotation = all_ @ np.where(upper[:, None, None], own, np.eye(3))
            begun = model.begin(state, (n + 1) / len(places), 1 / len(places))
            state = replace(begun, position=position, rotation=rotation)
            points = model.contact.points(state)
            state = model.commit(state)
            yield points.on_a[0], points, state.contact


def _arc(s, k):
    """Points of a line of curvature k that bends towards z."""
    if k == 0:
        return np.column_stack([s, 0 * s, 0 * s])
    return np.column_stack([np.sin(k * s) / k, 0 * s, (1 - np.cos(k * s)) / k])


def path(*corners, steps=8):
    """Places (m, 3) along straight legs from the origin through corners, over R, each in so many steps."""
    legs = np.concatenate([[[0.0, 0, 0]], np.asarray(corners, dtype=float)]) * RADIUS
    share = (np.arange(steps) + 1)[:, None] / steps
    return np.concatenate([a + share * (b - a) for a, b in pairwise(legs)])
