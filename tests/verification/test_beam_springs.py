"""Beams joined by springs: closed forms in small motions."""

import numpy as np
import pytest

from knitstudy.mechanics.beams.beam import BeamSection, LinearSprings
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace

SECTION = BeamSection(EA=1e3, kGA=4e2, EI=50.0, GJ=30.0)
LENGTH, ELEMENTS = 2.0, 20
STIFFNESS = np.array([300.0, 20.0, 70.0])


def two_cantilevers():
    """Two beams along x whose tips a spring joins."""
    x = np.linspace(0, LENGTH, ELEMENTS + 1)
    first = np.column_stack([x, 0 * x, 0 * x])
    second = first + np.array([LENGTH, 0, 0])
    chain = np.column_stack([np.arange(ELEMENTS), np.arange(1, ELEMENTS + 1)])
    springs = LinearSprings(
        np.array([[ELEMENTS, ELEMENTS + 1]]), np.zeros((1, 2, 3)), np.diag(STIFFNESS)[None]
    )
    nodes, ends = np.concatenate([first, second]), np.concatenate([chain, chain + ELEMENTS + 1])
    return BeamModel(nodes, ends, SECTION, 0.2, springs=springs)


def pulled(model, way):
    """Return the force (3,) on the second root that is moved by `way` (3,), the first one held; neither turns."""
    last = len(model.nodes) - 1
    fixed = np.concatenate([np.arange(6), 6 * last + np.arange(6)])
    value = np.concatenate([np.zeros(6), way, np.zeros(3)])
    *_, end = trace(
        model, PrescribedDisplacement(fixed, value), Settings(increments=4, residual_tolerance=1e-8), LU()
    )
    return end.response.force[-6:-3]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_beams_and_spring_in_series(axis, verify):
    """Tip of a cantilever: L / EA along it, L^3 / 3 EI + L / kGA across; the spring's own axis is global."""
    along = LENGTH / SECTION.EA
    across = LENGTH**3 / (3 * SECTION.EI) + LENGTH / SECTION.kGA
    expected = 1 / (2 * (along if axis == 0 else across) + 1 / STIFFNESS[axis])
    force = pulled(two_cantilevers(), 1e-2 * np.eye(3)[axis])
    verify.within(f"two cantilevers and a spring along {'xyz'[axis]}", force[axis] / 1e-2, expected, 1e-3)
