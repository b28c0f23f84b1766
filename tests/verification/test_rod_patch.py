"""Chains of beams against solid yarns that are bent as tightly as yarns of a knit are, and more so."""

import numpy as np
import pytest
from polynomial_rods import POISSON, RADIUS, YOUNG, Rod, arc

from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.contact import compliance as rod_patch

ANGLE = 1.5 * np.pi
BEAMS = 96


def solid(bend):
    """Stiffness (3, 3) of three quarters of a ring against displacements of one end, the other end held [N/mm]."""
    curvature = bend / RADIUS
    length = ANGLE / curvature
    rod = Rod(arc(curvature), np.linspace(0, length, round(length / (0.5 * RADIUS)) + 1), 5)
    ends = [rod.end(last) for last in (False, True)]
    held = np.concatenate(ends)
    constant = rod.space.unity[ends[1]] != 0
    actual = np.empty((3, 3))
    for axis in range(3):
        values = np.zeros((len(held), 3))
        values[len(ends[0]) :][constant, axis] = 1.0
        _, force = rod.solve(held, values)
        actual[axis] = force[ends[1]][constant].sum(axis=0)
    return actual


def chain(bend, curved):
    """The same of a chain of beams."""
    curvature = bend / RADIUS
    t = np.linspace(0, ANGLE, BEAMS + 1)
    nodes = np.stack([1 - np.cos(t), 0 * t, np.sin(t)], axis=-1) / curvature
    ends = np.column_stack([np.arange(BEAMS), np.arange(1, BEAMS + 1)])
    along = np.tile([0.0, curvature, 0.0], (BEAMS, 1))  # t x dt/ds
    section = (
        CurvedSection(RADIUS, YOUNG, POISSON, along)
        if curved
        else BeamSection.circular(2 * RADIUS, YOUNG, POISSON)
    )
    model = BeamModel(nodes, ends, section, RADIUS)
    tangent = model.respond(model.start(), stiffness=True).stiffness.toarray()
    end = np.arange(model.size - 6, model.size)
    inner = np.arange(6, model.size - 6)
    kept = tangent[np.ix_(end, end)] - tangent[np.ix_(end, inner)] @ np.linalg.solve(
        tangent[np.ix_(inner, inner)], tangent[np.ix_(inner, end)]
    )
    return kept[:3, :3]


@pytest.mark.parametrize(("bend", "straight"), [(0.33, 0.93), (0.55, 0.80)])
def test_ring_of_beams_is_as_stiff_as_a_solid_one(bend, straight, verify):
    """In the plane held ends count: they cannot contract, and solids are as if shorter by 0.1 R at either end."""
    stiffness = np.diag(solid(bend))
    actual = np.diag(chain(bend, curved=True)) / stiffness
    about = f"3/4 ring, R over radius {bend:g}, beams over solid yarn"
    verify.within(f"{about}: pulled along its axis", actual[1], 1.0, 5e-3)
    verify.within(f"{about}: pulled open", actual[0], 1.0, 0.045)
    assert np.all(np.diag(chain(bend, curved=False)) / stiffness < straight)


# How patches yield beyond what beams do


NU = 0.42


def test_small_patch_yields_as_a_half_space_does(verify):
    """Two sizes differ as Boussinesq's and Cerruti's mean displacement under an even traction do."""
    small, large = 0.15, 0.3
    normal = 16 * (1 - NU**2) / (3 * np.pi**2) * (1 / small - 1 / large)
    exact = normal * np.array([1, (2 - NU) / (2 * (1 - NU)), (2 - NU) / (2 * (1 - NU))])
    actual = np.subtract(rod_patch.local_compliance(small, NU), rod_patch.local_compliance(large, NU))
    verify.at_most(
        "patch beside a beam: change with its radius over a half-space's",
        np.abs(actual / exact - 1).max(),
        0.06,
    )
