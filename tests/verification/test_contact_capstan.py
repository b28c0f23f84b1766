"""A belt sliding on a drum: Euler's and Eytelwein's law."""

from dataclasses import replace

import numpy as np
import pytest
from contact_bodies import MODULUS, law, plate, together
from hexahedral_block import unknowns
from scipy.optimize import brentq

from knitstudy.mechanics.contact.friction import SLIP
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace

THICKNESS, WIDTH = 0.01, 0.1  # of the belt, over the radius of the drum

FACETS = 60  # facets of belt and drum along half a turn

FREE = 4  # facets of the belt beyond the drum at each end

SOFT = 0.2
"""Contact stiffness over E / h: so soft that the belt's pressure does not feel how two grids of facets differ."""

TOUCH = 1e-7  # initial overlap: without any, nothing would hold the belt on the drum to begin with

STRETCH, SLIDE = 5e-3, 2e-2
"""Mean strain by which the belt is tightened, and how far it is moved then, over the radius."""


def wrapped(body, start, end):
    """The body bent around the y axis, on a drum of radius 1: straight before the angle x = start and after x = end."""
    x, y, z = body.nodes.T
    turned = np.clip(x, start, end)
    tangent = np.stack([np.cos(turned), 0 * x, -np.sin(turned)], axis=1)
    outward = np.stack([np.sin(turned), 0 * x, np.cos(turned)], axis=1)
    nodes = (1 + z)[:, None] * outward + (x - turned)[:, None] * tangent + y[:, None] * [0, 1.0, 0]
    return replace(body, nodes=nodes)


def growth(friction):
    """Growth of the tension with the angle, of a thick belt: T' = lambda T.

    Friction tau = mu p acts at the radius 1, the tension at r = 1 + t/2. With a shear force Q and no bending
    T' = tau w - Q, T - Q' = p w and Q r = tau w t/2, so lambda = mu / r / (1 + mu lambda t / (2 r)).
    """
    r = 1 + 0.5 * THICKNESS
    return brentq(lambda x: x - friction / r / (1 + friction * x * 0.5 * THICKNESS / r), 0, friction)


@pytest.mark.parametrize(
    ("friction", "turn", "way", "slow"),
    [
        (0.3, 0.5, 1, False),
        (0.3, 0.5, -1, True),
        (0.1, 1.0, 1, True),
        (0.3, 1.0, 1, True),
        (0.3, 1.0, -1, True),
        (0.76, 0.5, 1, True),
    ],
)
def test_capstan(friction, turn, way, slow, full, skip_if_long, verify):
    """Both ends are pulled apart and then moved one way, until the whole belt slides."""
    skip_if_long(slow)
    angle, count = np.pi * turn, round(FACETS * turn)
    step = angle / count
    # The belt leaves the drum along the tangents; the drum reaches further, and is wider by a facet on both sides.
    drum = plate([count + 4, 3, 1], [angle + 4 * step, 3 * WIDTH, 0.1], up=True).moved(
        [-2 * step, -WIDTH, -0.1]
    )
    length = angle + 2 * FREE * step
    belt = plate([count + 2 * FREE, 1, 1], [length, WIDTH, THICKNESS], up=False).moved(
        [-FREE * step, 0, -TOUCH]
    )
    bodies = [wrapped(drum, -np.pi, 2 * np.pi), wrapped(belt, 0, angle)]
    model, first = together(bodies, law(step, friction, normal=SOFT), size=step, poisson=0.0, overlap=1e-4)
    nodes = np.arange(first[1], first[2])
    free = (FREE - 0.5) * step
    ends = [nodes[belt.nodes[:, 0] < -free], nodes[belt.nodes[:, 0] > angle + free]]
    tangents = np.array([[1.0, 0, 0], [np.cos(angle), 0, -np.sin(angle)]])
    gripped = unknowns(np.concatenate(ends))
    apart = np.array([-0.5, 0.5]) * STRETCH * length
    value = [np.repeat(each[:, None] * tangents, 4, axis=0).ravel() for each in (apart, apart + way * SLIDE)]
    still = np.concatenate([unknowns(np.arange(first[1])), np.setdiff1d(unknowns(nodes)[1::3], gripped)])
    fixed = np.concatenate([still, gripped])
    motion = PrescribedDisplacement(fixed, np.pad(value, ((0, 0), (len(still), 0))), (0.5, 1.0))
    settings = Settings(increments=8, residual_tolerance=1e-7, correction_tolerance=1e-6)
    *_, end = trace(model, motion, settings, LU())
    assert np.all(end.response.status[:, 2] == SLIP)
    force = end.response.force.reshape(-1, 3)
    start, finish = (abs(force[each].sum(axis=0) @ along) for each, along in zip(ends, tangents, strict=True))
    assert min(start, finish) > 1e-3 * MODULUS * WIDTH * THICKNESS
    direction = "" if way == 1 else ", the other way"
    case = f"capstan, mu = {friction}, {180 * turn:g} degrees{direction}: T2/T1"
    verify.within(case, (finish / start) ** way, np.exp(growth(friction) * angle), 0.01)
