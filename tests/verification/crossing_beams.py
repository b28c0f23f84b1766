"""Yarns of beams that cross, for cases of contact with closed forms."""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from half_spaces import hertz

from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.models.beam.contact import joined
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE, BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import Power, Repulsion
from knitstudy.mechanics.beams.line_contact import SPACINGS, LineContact
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.rotation import exp

RADIUS, MODULUS, POISSON = 0.9e-3, 1.3e9, 0.42
SECTION = BeamSection.circular(2 * RADIUS, MODULUS, POISSON)
LAWS = {"rigid": Power(10 * MODULUS * RADIUS**0.5), "hertz": hertz(MODULUS, POISSON, RADIUS)}


def crossings_at(arc_length):
    """Crossings of yarns 0 and 1 at arc lengths (K, 2)."""
    arc_length = np.asarray(arc_length, dtype=float)
    one = np.zeros(len(arc_length), dtype=int)
    point, apart = np.zeros((len(one), 2, 3)), np.full(len(one), 2 * RADIUS)
    return Crossings(one, one, one, np.tile([0, 1], (len(one), 1)), arc_length, point, apart)


def two_yarns(position, count, law, friction, crossings, per_station=4, normal=None, offset=None, tie=0.0):
    """Model of two yarns through stations (n, 3), of which the first `count` are of the lower one.

    Stations lie on rigid arms `offset` (n, 3); ties at all crossings have discs of radius `tie` R.
    """
    number = np.arange(len(position))
    yarn = (number >= count).astype(int)
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    s = np.append(0.0, np.cumsum(step))
    s[count:] -= s[count]
    points = ContactPoints.of(yarn, s, per_station)
    onset = SPACINGS**2 * points.weight.max() ** 2 / (16 * RADIUS)
    line = LineContact(
        points.yarn,
        points.arc_length,
        points.weight,
        Repulsion(normal or LAWS[law], 2 * RADIUS, onset),
        friction,
        joined=joined(points, crossings, 2 * tie * RADIUS) if tie else None,
    )
    arms = 0 * position if offset is None else offset
    contact = BeamContact(line, points, number, arms, crossings.yarn, crossings.arc_length)
    ends = np.column_stack([number[:-1], number[1:]])[np.diff(yarn) == 0]
    return BeamModel(position - arms, ends, SECTION, RADIUS, arms[ends], contact=contact)


@dataclass(frozen=True)
class Beams:
    """Two straight beams with their middles one above the other, crossing at a right angle."""

    length: float = 30e-3
    friction: float = 0.3
    law: str = "rigid"
    normal: Power | None = None
    tie: float = 0.0
    elements: int = 40
    per_station: int = 8  # points a tenth of R apart: contact is soft below a hundredth of R

    @property
    def count(self):
        return self.elements + 1

    def model(self):
        s = np.linspace(-0.5, 0.5, self.count)[:, None] * self.length
        nodes = np.concatenate([s * [1, 0, 0] - [0, 0, RADIUS], s * [0, 1, 0] + [0, 0, RADIUS]])
        middle, tie = crossings_at([[0.5 * self.length] * 2]), self.tie
        return two_yarns(
            nodes, self.count, self.law, self.friction, middle, self.per_station, self.normal, tie=tie
        )

    def ends(self, beam):
        """Nodes at the two ends of a beam."""
        return self.count * beam + np.array([0, self.elements])

    def drive(self, legs, spins=None):
        """Ends of the lower beam held, those of the upper one along legs (m, 3), and spun about its axis (m,) [rad]."""
        held = (6 * self.ends(0)[:, None] + np.arange(6)).ravel()
        driven = (6 * self.ends(1)[:, None] + np.arange(6)).ravel()
        turns = np.zeros((len(legs), 3))
        if spins is not None:
            turns[:, 1] = spins
        value = np.zeros((len(legs), len(held) + len(driven)))
        value[:, len(held) :] = np.tile(np.concatenate([legs, turns], axis=1), 2)
        corners = tuple((np.arange(len(legs)) + 1) / len(legs))
        return PrescribedDisplacement(np.concatenate([held, driven]), value, corners)

    def trace(self, legs, increments=10, spins=None):
        """All increments of a path."""
        settings = Settings(increments=increments, predictor=1, residual_tolerance=1e-8)
        return list(trace(self.model(), self.drive(legs, spins), settings, LU()))

    def contact_force(self, increment):
        """Force (3,) of contact on the lower beam."""
        return -increment.response.force.reshape(-1, 6)[self.ends(0), :3].sum(axis=0)


def curved_yarns(law, friction):
    """Model of two hooked yarns that face each other, turned by 70 degrees, every other station on a rigid arm."""
    s = np.linspace(-4e-3, 4e-3, 17)
    bend = 4e-3
    hook = np.column_stack([bend * np.sin(s / bend), 0 * s, bend * (np.cos(s / bend) - 1)])
    turn = exp(np.array([0, 0, np.radians(70)]))
    position = np.concatenate([hook - [0, 0, RADIUS], (hook * [1, 1, -1]) @ turn.T + [0, 0, RADIUS]])
    odd = (np.arange(len(position)) % 2)[:, None] == 1
    offset = np.where(odd, 1e-3 * np.array([0.4, -0.3, 0.5]), 0.0)
    return two_yarns(position, 17, law, friction, crossings_at([[4e-3, 4e-3]]), offset=offset)


def hairpin(law, per_station=16):
    """Model of a straight yarn and a hairpin over it without friction: they touch twice, 5 R apart."""
    leg, bend, below = 9 * RADIUS, 2.5 * RADIUS, 6 * RADIUS
    down = np.linspace(-below, leg - below, 19)[:-1]
    turn = np.linspace(np.pi, 0, 17)
    upper = np.concatenate(
        [
            np.column_stack([0 * down - bend, down]),
            np.column_stack([bend * np.cos(turn), leg - below + bend * np.sin(turn)]),
            np.column_stack([0 * down + bend, down[::-1]]),
        ]
    )
    lower = np.linspace(-8 * RADIUS, 8 * RADIUS, 33)
    position = np.concatenate(
        [
            np.column_stack([lower, 0 * lower, 0 * lower - RADIUS]),
            np.column_stack([upper, np.full(len(upper), RADIUS)]),
        ]
    )
    arc = np.linalg.norm(np.diff(upper, axis=0), axis=1).sum()
    crossings = crossings_at([[8 * RADIUS - bend, below], [8 * RADIUS + bend, arc - below]])
    return two_yarns(position, len(lower), law, 0.0, crossings, per_station)


FRICTION = {"stick": 1e4, "slip": 0.05, "rough": np.inf, "frictionless": 0.0}


def on_the_way(law, kind):
    """Model of hooked yarns, and its state in an increment that begins where they were pressed on each other.

    Nodes of the upper yarn have moved, and all nodes are disturbed, spins included.
    """
    model = curved_yarns(law, FRICTION[kind])
    upper = model.contact.places(model.start()).position[:, 2] > 0

    def moved(shift, seed):
        step = 2e-6 * np.random.default_rng(seed).normal(size=(len(upper), 6)) * [1, 1, 1, 20, 20, 20]
        step[upper, :3] += shift
        return model.advance(model.begin(model.start(), 0.0, 1.0), step.ravel())

    first = model.commit(moved([1e-6, 2e-6, -40e-6], 0))
    return model, replace(moved([20e-6, 8e-6, -41e-6], 1), contact=first.contact)


def pair_friction(model, state):
    """Friction of the pairs of points that touch."""
    line, points = model.contact.line, model.contact.at_points(state)
    return line.active_pairs(points, NO_LATTICE, state.contact.points, slip=True).friction


def alone(model):
    """The beams without their contact."""
    actual = copy(model)
    actual.contact = None
    return actual


def contact_forces(model, state):
    """Internal forces and moments (N, 6) of contact alone."""
    full, beams = model.respond(state, False).force, alone(model).respond(state, False).force
    return (full - beams).reshape(-1, 6)
