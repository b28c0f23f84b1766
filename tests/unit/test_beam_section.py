"""Stiffness of yarn sections and elements."""

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.models.beam.contact import pressed
from knitstudy.mechanics.beams import beam
from knitstudy.mechanics.beams.beam import Elements, Section
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.run.configuration import load_scene


def test_circular_section():
    section = Section.circular(diameter=2.0, youngs_modulus=100.0, poisson_ratio=0.25)
    assert section.EA == pytest.approx(100 * np.pi)
    assert section.EI == pytest.approx(100 * np.pi / 4)
    assert section.GJ == pytest.approx(40 * np.pi / 2)
    assert section.kGA == pytest.approx(0.89 * 40 * np.pi)


def test_full_slenderness_compensation_gives_one_element_the_exact_s_bending_stiffness():
    """With the factor kGA / EA both ends clamped give 1 / (L^3 / 12 EI + L / kGA) (MacNeal 1978)."""
    EA, kGA, EI, L = 7e3, 2e3, 5.0, 0.8
    element = Elements.between(np.array([[L, 0, 0]]), Section(EA, kGA, EI, 3.0, slenderness=kGA / EA))
    now = beam.deform(element, np.array([[L, 0.0, 0.0]]), np.eye(3)[None], np.eye(3)[None])
    K = beam.stiffness(element, now)[0]
    assert K[7, 7] == pytest.approx(1 / (L**3 / (12 * EI) + L / kGA), rel=1e-14)


@pytest.mark.parametrize("bend", [0.81, float("nan")])
def test_rod_bent_too_tightly_is_refused(bend):
    curvature = np.array([[0.0, 0.0, 0.3], [bend, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with refusal(r"element 1 is bent to .* 1\.25 yarn radii: take straight"):
        CurvedSection(1.0, 1.0, 0.3, curvature).stiffness(np.eye(3))


@pytest.mark.parametrize(("friction", "share"), [(0.0, 1.0), (0.76, 0.631), (1.8, 0.0)])
def test_friction_takes_the_place_of_normal_forces(friction, share):
    """Sticking yarns pull in all directions; nu R^2 / c is 1.645 at nu = 0.42."""
    scene = load_scene("beam-hertz-patch-isotropic-course").vary({"contact.friction": friction})
    assert pressed(scene) == pytest.approx(share, abs=2e-3)
    assert pressed(scene.vary({"interaction": "rough"})) == 0.0
