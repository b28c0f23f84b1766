"""Yarns of long beams slide along each other and feel neither nodes nor points of contact.

Without friction a straight yarn that slides along another one under a force feels no force along the way, wherever the
nodes are. A yarn that rides on a bent one under a force along its normal feels none along its tangent. Unit of length
is the radius R, of force E R^2.
"""

import numpy as np
import pytest
from crossing_beams import crossings_at
from scipy.integrate import quad
from scipy.optimize import brentq

from knitstudy.knit.models.beam.contact import YarnContact
from knitstudy.knit.scene.sections import BeamYarn
from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LineHistory
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE, BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.laws import CrossedCylinders
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace

NU, BEAM = 0.3, 2.5
NEAR = 1e-3  # by how much the approaches at neighbouring places differ at most, as a rule
LAW = CrossedCylinders.elastic(1.0, NU, 1.0)


def contact_along(yarn, s, friction=0.0):
    """Contact of yarns with stations as scenes have it, and its points."""
    thread = BeamYarn(diameter=2.0, youngs_modulus=1.0, poisson_ratio=NU)
    return YarnContact((thread,), (LAW,), friction).along(yarn, s)


class Ridden:
    """A yarn whose angle to x is `slope` by its arc length, and a straight one that rides on it at a right angle."""

    def __init__(self, slope, angle=90.0):
        self.slope, lower, upper = slope, BEAM * np.arange(-8, 9), BEAM * (np.arange(-4, 5) + 0.37)
        self.stations = np.array([self.place(s) for s in lower])
        away = np.radians(angle)
        self.upper = upper[:, None] * [np.cos(away), np.sin(away), 0.0]
        yarn = np.repeat([0, 1], [len(lower), len(upper)])
        self.line, self.points = contact_along(yarn, np.append(lower - lower[0], upper - upper[0]))

    def place(self, s):
        """Point (3,) of the lower axis."""
        x, _ = quad(lambda t: np.cos(self.slope(t)), 0, s)
        z, _ = quad(lambda t: np.sin(self.slope(t)), 0, s)
        return np.array([x, 0.0, z])

    def frame(self, s):
        """Point (3,), tangent and normal of the lower axis."""
        angle = self.slope(s)
        tangent, normal = np.array([[np.cos(angle), 0, np.sin(angle)], [-np.sin(angle), 0, np.cos(angle)]])
        return self.place(s), tangent, normal

    def force(self, frame, approach):
        """Force on the upper yarn along the normal and the tangent of the lower one (2,)."""
        place, tangent, normal = frame
        turned = self.upper @ np.stack([tangent, [0.0, 1.0, 0.0], normal])
        nodes = np.concatenate([self.stations, turned + place + (2 - approach) * normal])
        position = self.points.weights @ nodes
        state = BeamState(position, np.tile(np.eye(3), (len(position), 1, 1)))
        force = self.line.respond(state, NO_LATTICE, LineHistory.none(), False)[0][:-6].reshape(-1, 6)
        return -force[self.line.yarn == 1, :3].sum(axis=0) @ np.stack([normal, tangent], axis=1)

    def pull(self, s, load, near):
        """Force along the tangent over a load along the normal, and the approach, which is sought near one first."""
        frame = self.frame(s)

        def excess(approach):
            return self.force(frame, approach)[0] - load

        low, high = near - NEAR, near + NEAR
        if not excess(low) < 0 < excess(high):
            low, high = -0.3, 0.3
        approach = brentq(excess, low, high, xtol=1e-8)
        return self.force(frame, approach)[1] / load, approach


def wave(bend):
    """Slope of a wave 31 R long whose curvature is at most kR = bend."""
    return lambda s: 5 * bend * np.sin(0.2 * s)


# Slope by arc length, angle of the other yarn, bar. Beams of 2.5 R are 4 % too stiff in the sharpest wave, of the 5 %
# that `gates.polygon` admits: its hills are the largest that a scene may have.
RIDES = {
    "straight": (lambda s: 0.0 * s, 90, 0.01),
    "straight, at 50 degrees": (lambda s: 0.0 * s, 50, 0.01),
    "arc, kR 0.1": (lambda s: 0.1 * s, 90, 0.01),
    "wave, kR to 0.1": (wave(0.1), 90, 0.01),
    "wave, kR to 0.2": (wave(0.2), 90, 0.01),
    "wave, kR to 0.2, at 50 degrees": (wave(0.2), 50, 0.015),
}


@pytest.mark.parametrize("load", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("name", RIDES)
def test_smooth_yarns_slide_along_each_other_without_a_force(name, load, verify):
    slope, angle, bar = RIDES[name]
    ride = Ridden(slope, angle)
    pulls, approach = [], 0.0
    for s in np.linspace(-5 * BEAM, 5 * BEAM, 67):
        pull, approach = ride.pull(s, load, approach)
        pulls.append(pull)
    case = f"{name}, {load:g} E R^2, ten beams: largest force along the way over that across"
    verify.at_most(case, np.abs(pulls).max(), bar)


LOWER, UPPER = (BEAM * (np.arange(count) - (count - 1) / 2) for count in (29, 9))  # arc lengths of stations
PRESSED, INCREMENTS = 0.1, 160  # share of the way that presses


def dragged(friction):
    """Forces along and across the way (m, 2) that drag a clamped yarn along another one, over ten beams."""
    position = np.concatenate(
        [LOWER[:, None] * [1, 0, 0], UPPER[:, None] * [0, 1, 0] + [-5 * BEAM - 0.4, 0, 2.0]]
    )
    number = np.arange(len(position))
    yarn = (number >= len(LOWER)).astype(int)
    crossing = crossings_at([[5 * BEAM, 4 * BEAM]])
    line, points = contact_along(yarn, np.append(LOWER - LOWER[0], UPPER - UPPER[0]), friction)
    contact = BeamContact(line, points, number, 0 * position, crossing.yarn, crossing.arc_length)
    elements = np.column_stack([number[:-1], number[1:]])[np.diff(yarn) == 0]
    model = BeamModel(position, elements, BeamSection.circular(2.0, 1.0, NU), 1.0, contact=contact)
    held, driven = number[[0, len(LOWER) - 1]], number[[len(LOWER), -1]]
    legs = np.array([[0.0, 0, -1, 0, 0, 0], [10 * BEAM, 0, -1, 0, 0, 0]])
    value = np.hstack([np.zeros((2, 12)), np.tile(legs, 2)])
    unknowns = (6 * np.append(held, driven)[:, None] + np.arange(6)).ravel()
    drive = PrescribedDisplacement(unknowns, value, (PRESSED, 1.0))
    settings = Settings(INCREMENTS, predictor=1, residual_tolerance=1e-8)
    forces = [
        increment.response.force.reshape(-1, 6)[driven][:, [0, 2]].sum(axis=0)
        for increment in trace(model, drive, settings, LU())
        if increment.load > PRESSED
    ]
    return np.array(forces) * [1, -1]


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_elastic_yarns_are_dragged_over_nodes_and_points_without_hills(friction, verify):
    """From where the yarn slides on: what is left beside a polynomial of degree 8, as soft as the lower yarn."""
    forces = dragged(friction)[16:]
    place = np.linspace(-1, 1, len(forces))
    trend = np.polynomial.chebyshev.Chebyshev.fit
    hills = forces - np.stack([trend(place, force, 8)(place) for force in forces.T], axis=1)
    for way, hill in zip(("along", "across"), np.abs(hills).max(axis=0), strict=True):
        case = f"yarns dragged over ten beams, friction {friction}: hills {way} the way over the normal force"
        verify.at_most(case, hill / forces[:, 1].mean(), 0.01)
