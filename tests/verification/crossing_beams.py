"""Two beams that cross, for cases of contact with closed forms."""

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.crossings import Crossings
from knitstudy.mechanics.beam import Section
from knitstudy.mechanics.beam_approach import Curves
from knitstudy.mechanics.beam_contact import BeamContact, Power, hertz
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.hertz import Patch
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.rotation import exp
from knitstudy.models.beams_in_contact import Neighbours, point_pairs

RADIUS, MODULUS, POISSON = 0.9e-3, 1.3e9, 0.42
SECTION = Section.circular(2 * RADIUS, MODULUS, POISSON)
PATCHES = {"rigid": None, "hertz": Patch(POISSON)}
LAWS = {"rigid": Power(10 * MODULUS * RADIUS), "hertz": hertz(MODULUS, POISSON, RADIUS)}


@dataclass(frozen=True)
class Beams:
    """Two straight beams with their middles one above the other, crossing at an angle; all turned by a rotation."""

    length: float = 40e-3
    angle: float = 90.0
    gap: float = 0.02e-3
    elements: int = 40
    turn: tuple = (0.0, 0.0, 0.0)
    friction: float = 0.5
    law: str = "rigid"
    normal: Power | None = None
    carried: float = 0.0  # overlap up to which a tie keeps the beams apart
    reach: float = np.inf  # least distance of the point on the upper beam from the crossing, if it is finite

    @property
    def rotation(self):
        return exp(np.array(self.turn))

    @property
    def nodes(self):
        """(2, n, 3): the lower beam along x, the upper one turned to y."""
        s = np.linspace(-0.5, 0.5, self.elements + 1)[:, None] * self.length
        turn = np.radians(self.angle)
        along = np.array([[1.0, 0, 0], [np.cos(turn), np.sin(turn), 0]])
        middle = (RADIUS + 0.5 * self.gap) * np.array([[0, 0, -1.0], [0, 0, 1.0]])
        return np.stack([middle[i] + s * along[i] for i in (0, 1)]) @ self.rotation.T

    @property
    def crossings(self):
        one = np.array([0])
        middle = self.nodes.mean(axis=1)
        return Crossings(
            one,
            one,
            one,
            np.array([[0, 1]]),
            np.full((1, 2), 0.5 * self.length),
            middle[None],
            np.linalg.norm(middle[1:] - middle[:1], axis=1),
        )

    def model(self):
        nodes = self.nodes
        count = nodes.shape[1]
        chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
        s = np.tile(np.linspace(0, self.length, count), 2)
        curves = Curves(np.repeat([0, 1], count), s)
        law = self.normal or LAWS[self.law]
        pairs = point_pairs(self.crossings, np.array([0]), curves.length)
        if np.isfinite(self.reach):
            pairs.bounds[0, 1, 0] = 0.5 * self.length + self.reach
        stations = np.arange(2 * count), np.zeros((2 * count, 3))
        contact = BeamContact(
            curves,
            pairs,
            *stations,
            RADIUS,
            law,
            self.friction,
            carried=self.carried,
            patch=PATCHES[self.law],
        )
        ends = np.concatenate([chain, chain + count])
        return BeamModel(nodes.reshape(-1, 3), ends, SECTION, RADIUS, contact=contact)

    def ends(self, beam):
        """Nodes at the two ends of a beam."""
        count = self.elements + 1
        return count * beam + np.array([0, count - 1])

    def drive(self, legs, spins=None):
        """Ends of the lower beam held, those of the upper one along legs (m, 3), and spun about its axis (m,) [rad]."""
        held = (6 * self.ends(0)[:, None] + np.arange(6)).ravel()
        driven = 6 * self.ends(1)[:, None] + np.arange(6)
        legs = np.asarray(legs, dtype=float) @ self.rotation.T
        axis = np.diff(self.nodes[1, [0, -1]], axis=0)[0] / self.length
        value = np.zeros((len(legs), len(held) + driven.size))
        spin = np.zeros((len(legs), 1)) if spins is None else np.asarray(spins, dtype=float)[:, None]
        value[:, len(held) :] = np.tile(np.concatenate([legs, spin * axis], axis=1), 2)
        corners = tuple((np.arange(len(legs)) + 1) / len(legs))
        return PrescribedDisplacement(np.concatenate([held, driven.ravel()]), value, corners)

    def trace(self, legs, increments=10, spins=None, **settings):
        """Model and all increments of a path."""
        model = self.model()
        settings = Settings(
            **({"increments": increments, "predictor": 1, "residual_tolerance": 1e-8} | settings)
        )
        return model, list(trace(model, self.drive(legs, spins), settings, LU()))

    def contact_force(self, increment):
        """Force (3,) of contact on the lower beam, in the axes of the beams before they were turned."""
        force = increment.response.force.reshape(-1, 6)[self.ends(0), :3].sum(axis=0)
        return -force @ self.rotation

    def slip(self, increment):
        """Length slipped so far."""
        return increment.state.contact.slip[0]


def curved_yarns(law, friction):
    """Model of two hooked yarns that face each other, turned by 70 degrees, every other station on a rigid arm."""
    s = np.linspace(-4e-3, 4e-3, 17)
    bend = 4e-3
    hook = np.column_stack([bend * np.sin(s / bend), 0 * s, bend * (np.cos(s / bend) - 1)])
    turn = exp(np.array([0, 0, np.radians(70)]))
    lower = hook - np.array([0, 0, RADIUS])
    upper = (hook * [1, 1, -1]) @ turn.T + np.array([0, 0, RADIUS])
    position = np.concatenate([lower, upper])
    number = np.arange(len(position))
    offset = np.where((number % 2)[:, None] == 1, 1e-3 * np.array([0.4, -0.3, 0.5]), 0.0)
    chain = np.column_stack([np.arange(16), np.arange(1, 17)])
    ends = np.concatenate([chain, chain + 17])
    curves = Curves(np.repeat([0, 1], 17), np.tile(s - s[0], 2))
    one = np.array([0])
    points = np.array([[[0, 0, -RADIUS], [0, 0, RADIUS]]])
    crossings = Crossings(
        one, one, one, np.array([[0, 1]]), np.full((1, 2), 4e-3), points, np.array([2 * RADIUS])
    )
    pairs = point_pairs(crossings, one, curves.length)
    contact = BeamContact(curves, pairs, number, offset, RADIUS, LAWS[law], friction, patch=PATCHES[law])
    return BeamModel(position - offset, ends, SECTION, RADIUS, offset[ends], contact=contact)


def hairpin(law, friction):
    """Model of a straight yarn and a hairpin over it: they touch twice, 5 R apart, and one crossing is known."""
    leg, half, bend, below = 9 * RADIUS, 4, 2.5 * RADIUS, 6 * RADIUS
    down = np.linspace(-below, leg - below, 19)[:-1]
    turn = np.linspace(np.pi, 0, 17)
    upper = np.concatenate(
        [
            np.column_stack([0 * down - bend, down]),
            np.column_stack([bend * np.cos(turn), leg - below + bend * np.sin(turn)]),
            np.column_stack([0 * down + bend, down[::-1]]),
        ]
    )
    lower = np.linspace(-8 * RADIUS, 8 * RADIUS, 8 * half + 1)
    position = np.concatenate(
        [
            np.column_stack([lower, 0 * lower, 0 * lower - RADIUS]),
            np.column_stack([upper, np.full(len(upper), RADIUS)]),
        ]
    )
    yarn = np.repeat([0, 1], [len(lower), len(upper)])
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    along = np.cumsum(np.where(np.diff(yarn) > 0, 0.0, step))
    s = np.concatenate([[0.0], along])
    s[yarn == 1] -= s[len(lower)]
    one = np.array([0])
    points = np.array([[[-bend, 0, -RADIUS], [-bend, 0, RADIUS]]])
    place = np.array([[8 * RADIUS - bend, below]])
    crossings = Crossings(one, one, one, np.array([[0, 1]]), place, points, np.array([2 * RADIUS]))
    curves = Curves(yarn, s)
    neighbours = Neighbours(curves, yarn, crossings, np.array([False]), RADIUS)
    number = np.arange(len(yarn))
    stations = number, np.zeros((len(yarn), 3))
    contact = BeamContact(
        curves,
        neighbours.first(),
        *stations,
        RADIUS,
        LAWS[law],
        friction,
        search=neighbours.search,
        patch=PATCHES[law],
    )
    ends = np.column_stack([number[:-1], number[1:]])[np.diff(yarn) == 0]
    return BeamModel(position, ends, SECTION, RADIUS, contact=contact)
