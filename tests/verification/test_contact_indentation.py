"""Crossing solid yarns of low degree with the law of their local indentation, against the converged solid."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

from knitstudy.mechanics.contact.compliance import FAR, LENGTH, PHASE, computed_far_compliance, far_compliance
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.indentation import CylinderContact, indentation
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.core.cylinder import ACROSS, ALONG, NORMAL
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

CELL = 0.25


class CrossedYarns:
    """Yarns of unit radius and modulus, of a degree and spans, whose middles lie at `phase` of a span."""

    def __init__(self, degree, span, angle, poisson, *, friction=0.0, phase=PHASE, cell=CELL):
        breaks = 0.5 * LENGTH + span * (np.arange(-20, 21) - phase)
        breaks = breaks[(breaks > 0.25 * span) & (breaks < LENGTH - 0.25 * span)]
        own = yarn_space(np.concatenate([[0.0], breaks, [LENGTH]]), degree)
        self.space = Space((own, own))
        turn = np.radians(angle)
        axes = np.array([[1.0, 0, 0], [np.cos(turn), np.sin(turn), 0]])
        nodes = np.concatenate(
            [_straight(own, np.array([0, 0, side]), axis) for side, axis in zip((-1, 1), axes, strict=True)]
        )
        law = indentation(degree, span, 3, modulus=1.0, poisson=poisson, radius=1.0, friction=friction)
        half = round(1.5 / cell)
        fine = 0.5 * LENGTH + cell * np.arange(-half, half + 1)
        along = np.concatenate([np.linspace(0, fine[0], 4)[:-1], fine, np.linspace(fine[-1], LENGTH, 4)[1:]])
        surfaces = Cylinders(self.space, 1.0, [along, along], round(2 * np.pi / cell))
        apart = ~np.eye(2, dtype=bool)
        contact = Contact(nodes, surfaces, law, meets=apart, margin=0.3, overlap=1e-6)
        groups = span_groups(self.space, nodes, Hencky(1.0, poisson))
        self.model = SolidModel(nodes, groups, span, contact=contact)
        first = own.first_node
        ends = np.concatenate([np.arange(first[1]), np.arange(*first[-2:])])
        self.ends = ends, ends + own.size

    def force(self, path, increments=1):
        """Forces (increments, 3) on the upper yarn along a path (m, 3) of its ends."""
        held = np.concatenate(self.ends)
        unity = self.space.unity[held]
        unity[: len(self.ends[0])] = 0
        path = np.atleast_2d(path)
        values = unity[:, None] * path[:, None]
        drive = PrescribedDisplacement(
            (3 * held[:, None] + np.arange(3)).ravel(),
            values.reshape(len(path), -1),
            tuple((np.arange(len(path)) + 1) / len(path)),
        )
        settings = Settings(increments=increments, residual_tolerance=1e-6, correction_tolerance=1e-5)
        forces = [
            unity @ increment.response.force.reshape(-1, 3)[held]
            for increment in trace(self.model, drive, settings, LU())
        ]
        return np.array(forces)


def converged(angle, poisson, approach):
    """Force of the converged solid: Hertz's indentation, and what yarns give way besides."""
    hertz, elastic, beyond = (
        CylinderContact.at(np.radians(angle)),
        0.5 / (1 - poisson**2),
        far_compliance(poisson),
    )
    return brentq(lambda p: hertz.approach * (p / elastic) ** (2 / 3) + 2 * beyond * p - approach, 0, 1)


def stuck(angle, poisson, approach, slide):
    """Force (2,) of the converged solid, pressed and then slid (2,) while it sticks: Mindlin's share, and the yarns."""
    turn, force = np.radians(angle), converged(angle, poisson, approach)
    local = CylinderContact.at(turn).approach * (force / (0.5 / (1 - poisson**2))) ** (2 / 3) / (1.5 * force)
    compliance = 0.5 * (2 - poisson) / (1 - poisson) * local * np.eye(2)
    for axis in ([1.0, 0.0], [np.cos(turn), np.sin(turn)]):
        along = np.outer(axis, axis)
        compliance += far_compliance(poisson, ALONG) * along + far_compliance(poisson, ACROSS) * (
            np.eye(2) - along
        )
    return np.linalg.solve(compliance, slide)


def _straight(space, middle, axis):
    s = np.linspace(0, LENGTH, 100)
    centre = space.spline.fit(s, middle + (s - 0.5 * LENGTH)[:, None] * axis)
    up = np.array([0.0, 0, 1])
    frames = [np.tile(d, (len(centre), 1)) for d in (up, np.cross(axis, up))]
    return space.coefficients(centre, *frames, 1.0)


CASES = [(90, 0.4), (45, 0.0), (30, 0.45)]
PRESS = 0.1

# Of contact points, over the radius: where contact ends the stiffness of sticking begins steeply
FINE_CELL = 0.0625

SPACES = {2: 1.0, 3: 0.9, 4: 0.6}  # spans by degree, over the radius


@pytest.fixture
def spaces(full):
    """All of them at full resolution, else the middle one."""
    return SPACES if full else {3: SPACES[3]}


@pytest.mark.parametrize(("angle", "poisson"), CASES)
def test_press(angle, poisson, spaces, verify):
    """Hertz and the yarn's own bending, computed apart from each other, are exact in small strains: 3 % is theirs."""
    for degree, span in spaces.items():
        force = -CrossedYarns(degree, span, angle, poisson).force([0, 0, -PRESS])[-1, 2]
        name = f"crossing solid yarns, degree {degree}, {angle} degrees, nu {poisson:g}: force"
        verify.within(name, force, converged(angle, poisson, PRESS), 0.03)


@pytest.mark.parametrize(("angle", "poisson"), [(45, 0.4)])
def test_stick(angle, poisson, spaces, verify):
    """Pressed by half as much, then slid while all sticks: the law where the points resolve the small patch."""
    press, slide = 0.5 * PRESS, np.array([0.01, 0.0])
    path = [[0, 0, -press], [*slide, -press]]
    true = stuck(angle, poisson, press, slide)
    for degree, span in spaces.items():
        yarns = CrossedYarns(degree, span, angle, poisson, friction=np.inf, cell=FINE_CELL)
        force = yarns.force(path, 2)[-1, :2] @ true / np.linalg.norm(true)
        name = f"crossing solid yarns that stick, degree {degree}, {angle} degrees, nu {poisson:g}: force"
        verify.within(name, force, np.linalg.norm(true), 0.04)


def test_place_within_a_span(verify):
    """Under the end of a span a space shows more than under its middle; the law is that of a quarter."""
    for phase in (0.0, 0.5):
        force = -CrossedYarns(3, 0.9, 90, 0.4, phase=phase).force([0, 0, -PRESS])[-1, 2]
        name = f"crossing solid yarns, degree 3, at {phase:g} of a span: force"
        verify.within(name, force, converged(90, 0.4, PRESS), 0.03)


@pytest.mark.parametrize("poisson", [0.0, 0.42, 0.5 - 1e-6])
def test_series_of_far_compliance(verify, poisson):
    """The series that the code holds is the compliance of the yarn of high degree that it was made from."""
    for name, direction in {"normal": NORMAL, "across": ACROSS, "along": ALONG}.items():
        series, true = far_compliance(poisson, direction), computed_far_compliance(poisson, direction)
        verify.within(f"series of C_far, {name}, nu {poisson:.3g}", series, true, 1e-8)


if __name__ == "__main__":  # makes the series
    places = chebyshev.chebpts1(FAR.shape[1] + 2)
    far = [[computed_far_compliance((1 + w) / (3 + w), way) for way in range(3)] for w in places]
    print(chebyshev.chebfit(places, far, len(places) - 1)[: FAR.shape[1]].T.tolist())


@pytest.mark.parametrize("poisson", [0.1, 0.3, 0.45])
@pytest.mark.parametrize(("degree", "span"), [(2, 1.0), (3, 0.6), (4, 0.5)])
def test_pressure_rises(degree, span, poisson):
    """At every angle and depth the pressure rises at least as that of half spaces, with the root of the depth.

    A pressure that falls with the depth holds nothing, and sticking has no stiffness there.
    """
    law = indentation(degree, span, 3, modulus=1.0, poisson=poisson, radius=1.0, friction=0.3)
    angle, depth = map(np.ravel, np.meshgrid(np.radians(np.arange(10, 91)), np.linspace(1e-4, 0.3, 400)))
    slope = law.at(-depth, angle).normal * depth / law.pressure(-depth, 0.0, angle)
    assert slope.min() > 0.5
