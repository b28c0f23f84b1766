"""Two yarns hooked around each other, of beams and of solids: contact of surfaces that conform, far into the yarns.

Arcs of one curvature in planes at right angles touch at their middles; their ends are clamped and pushed together.
Solids decide what a law of contact for beams is worth where patches are no longer small.
"""

import numpy as np
import pytest

from knitstudy.mechanics.beams.beam_contact import BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.beams.laws import CrossedCylinders, Repulsion
from knitstudy.mechanics.beams.line_contact import SPACINGS, LineContact
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.indentation import indentation
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.rotation import turns
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

NU = 0.3  # of yarns of unit radius and modulus
PUSHED = (0.1, 0.2)  # way of the upper yarn's ends
SIDES = (-1, 1)


def arc(t, side, bend):
    """Places (n, 3) and tangents (n, 3) of the lower (-1) or the upper yarn at arc lengths from the middle (n,)."""
    x, z = (np.sin(bend * t) / bend, (1 - np.cos(bend * t)) / bend) if bend else (t, 0 * t)
    along, up = np.eye(3)[(side + 1) // 2], np.eye(3)[2]
    place = np.outer(x, along) + np.outer(side * (1 - z), up)
    return place, np.outer(np.cos(bend * t), along) - side * np.outer(np.sin(bend * t), up)


def half_length(bend):
    return min(3.5, 1.2 / bend) if bend else 3.5


def forces(model, held, unity, block, limits):
    """Force that pushes the ends `held` (k,) of weights `unity` (k,), those of the upper yarn, to each of `PUSHED`."""
    unknowns = (block * held[:, None] + np.arange(block)).ravel()
    way = np.zeros((len(held), block))
    way[:, 2] = -unity * PUSHED[-1]
    stops = tuple(np.array(PUSHED[:-1]) / PUSHED[-1])
    drive = PrescribedDisplacement(unknowns, way.reshape(1, -1), (1.0,), stops)
    settings = Settings(
        increments=8, predictor=1, residual_tolerance=1e-6, correction_tolerance=1e-5, **limits
    )
    found = {}
    for increment in trace(model, drive, settings, LU()):
        force = increment.response.force.reshape(-1, block)[held, 2]
        found[round(increment.load * PUSHED[-1], 9)] = -float(unity @ force)
    return np.array([found[way] for way in PUSHED])


def solid(bend, degree=4, span=0.5, cell=0.15):
    """Forces of solid yarns."""
    half = half_length(bend)
    spans = 2 * int(np.ceil(half / span)) + 1
    own = yarn_space(np.linspace(0, 2 * half, spans + 1), degree)
    s, shapes = np.linspace(0, 2 * half, 40 * spans + 1), []
    for side in SIDES:
        place, tangent = arc(s - half, side, bend)
        across = np.cross(tangent[len(s) // 2], [0.0, 0, 1])
        first = np.cross(across, tangent)
        values = own.spline.fit(s, np.concatenate([place, first, np.cross(tangent, first)], axis=1))
        shapes.append(own.coefficients(values[:, :3], values[:, 3:6], values[:, 6:], 1.0))
    nodes, space = np.concatenate(shapes), Space((own, own))
    edges = np.linspace(0, 2 * half, int(np.ceil(2 * half / cell)) + 1)
    law = indentation(degree, 2 * half / spans, 3, modulus=1.0, poisson=NU, radius=1.0, friction=0.0)
    surfaces = Cylinders(space, 1.0, [edges, edges], round(2 * np.pi / cell))
    apart = ~np.eye(2, dtype=bool)
    contact = Contact(nodes, surfaces, law, meets=apart, margin=0.4, overlap=1e-3)
    model = SolidModel(nodes, span_groups(space, nodes, Hencky(1.0, NU)), span, contact=contact)
    ends = np.concatenate([np.arange(own.first_node[1]), np.arange(*own.first_node[-2:])])
    held = np.concatenate([ends, ends + own.size])
    return forces(model, held, space.unity[held] * (held >= own.size), 3, {"stride": 0.3})


def beams(bend, size=0.25, points=4):
    """Forces of beams."""
    half = half_length(bend)
    count = round(2 * half / size) + 1
    s = np.linspace(0, 2 * half, count)
    place, tangent = (
        np.concatenate(each) for each in zip(*(arc(s - half, side, bend) for side in SIDES), strict=True)
    )
    yarn, along = np.repeat([0, 1], count), np.tile(s, 2)
    first = np.flatnonzero(yarn[1:] == yarn[:-1])
    curvature = turns(tangent[first], tangent[first + 1]) / s[1]
    at = ContactPoints.of(yarn, along, points)
    onset = SPACINGS**2 * at.weight.max() ** 2 / 16
    law = Repulsion(CrossedCylinders.elastic(1.0, NU, 1.0), 2.0, onset)
    line = LineContact(at.yarn, at.arc_length, at.weight, law)
    middle = np.array([[0, 1]]), np.full((1, 2), half)
    contact = BeamContact(line, at, np.arange(2 * count), 0 * place, *middle)
    section = CurvedSection(1.0, 1.0, NU, curvature, pressed=1.0)
    model = BeamModel(place, np.column_stack([first, first + 1]), section, 1.0, contact=contact)
    held = np.array([0, count - 1, count, 2 * count - 1])
    return forces(model, held, 1.0 * (held >= count), 6, {})


# Forces of solids of degree 4; degree 3 and spans of 0.6, and degree 5 and spans of 0.4, are within 2 % of them
SOLIDS = {
    0.0: (0.00843, 0.01885),
    0.2: (0.01192, 0.02757),
    0.3: (0.01533, 0.03717),
    0.4: (0.02284, 0.05688),
    0.45: (0.03151, 0.07796),
}


@pytest.mark.parametrize("bend", SOLIDS)
def test_hooked_beams_carry_what_solids_do(bend, full, verify):
    """Beams bent tighter than 0.3 / R are 5 to 17 % too soft: docs/notes/beams.md says why."""
    bar = 0.08 if bend < 0.4 else 0.18
    expected = solid(bend) if full else SOLIDS[bend]
    for way, beam, yarns in zip(PUSHED, beams(bend), expected, strict=True):
        verify.within(f"yarns hooked with kR {bend:g}, pushed by {way:g} R: force", beam, yarns, bar)
