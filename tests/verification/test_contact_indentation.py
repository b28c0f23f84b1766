"""Crossing solid yarns of low degree with the law of their local indentation, against the converged solid."""

import numpy as np
import pytest
from crossed_solid_yarns import CrossedYarns, converged, stuck

CASES = [(90, 0.4), (45, 0.0), (30, 0.45)]
PRESS = 0.1

FINE_CELL = (
    0.0625  # of contact points, over the radius: where contact ends the stiffness of sticking begins steeply
)

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
