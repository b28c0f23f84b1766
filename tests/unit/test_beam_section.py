"""Stiffness of yarn sections and elements."""

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.knit.models.beam.contact import contact_of
from knitstudy.mechanics.beams import beam
from knitstudy.mechanics.beams.beam import BeamSection, Elements
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.rotation import exp
from knitstudy.run.configuration import load_scene


def test_circular_section():
    section = BeamSection.circular(diameter=2.0, youngs_modulus=100.0, poisson_ratio=0.25)
    assert section.EA == pytest.approx(100 * np.pi)
    assert section.EI == pytest.approx(100 * np.pi / 4)
    assert section.GJ == pytest.approx(40 * np.pi / 2)
    assert section.kGA == pytest.approx(0.89 * 40 * np.pi)


def test_full_slenderness_compensation_gives_one_element_the_exact_s_bending_stiffness():
    """With the factor kGA / EA both ends clamped give 1 / (L^3 / 12 EI + L / kGA) (MacNeal 1978)."""
    EA, kGA, EI, L = 7e3, 2e3, 5.0, 0.8
    element = Elements.between(np.array([[L, 0, 0]]), BeamSection(EA, kGA, EI, 3.0, slenderness=kGA / EA))
    now = beam.deform(element, np.array([[L, 0.0, 0.0]]), np.eye(3)[None], np.eye(3)[None])
    K = beam.stiffness(element, now)[0]
    assert K[7, 7] == pytest.approx(1 / (L**3 / (12 * EI) + L / kGA), rel=1e-14)


CHORDS = np.array([[0.3, 0.0, 0.1], [0.0, -0.4, 0.2], [0.2, 0.2, 0.2]])


def test_curved_section_of_straight_rods_is_the_straight_one_but_for_its_shear_factor():
    straight = BeamSection.circular(1.8, 1.3e3, 0.42).stiffness(CHORDS)
    curved = CurvedSection(0.9, 1.3e3, 0.42, np.zeros((3, 3))).stiffness(CHORDS)
    np.testing.assert_allclose(curved[:, 3:, 3:], straight[:, 3:, 3:], rtol=1e-9, atol=1e-7)
    t = CHORDS / np.linalg.norm(CHORDS, axis=1)[:, None]
    along = [np.einsum("ei,eij,ej->e", t, law[:, :3, :3], t) for law in (curved, straight)]
    np.testing.assert_allclose(*along, rtol=1e-9)
    # Twice the shear stiffness and the axial one.
    shear = [
        np.trace(law[:, :3, :3], axis1=1, axis2=2) - a
        for law, a in zip((curved, straight), along, strict=True)
    ]
    np.testing.assert_allclose(shear[0] / shear[1], 0.84656 / 0.89, rtol=1e-5)
    assert np.abs(curved[:, :3, 3:]).max() < 1e-7 * np.abs(curved).max()


def test_law_of_a_curved_rod_turns_with_the_rod():
    curvature = np.array([[0.1, 0.4, 0.0], [0.3, 0.0, 0.2], [0.0, 0.0, 0.0]])
    Q = exp(np.array([0.4, -1.1, 0.6]))
    law = CurvedSection(0.9, 1.3e3, 0.42, curvature).stiffness(CHORDS)
    turned = CurvedSection(0.9, 1.3e3, 0.42, curvature @ Q.T).stiffness(CHORDS @ Q.T)
    turn = np.kron(np.eye(2), Q)
    np.testing.assert_allclose(turned, turn @ law @ turn.T, atol=1e-10 * np.abs(law).max())


@pytest.mark.parametrize("bend", [0.81, float("nan")])
def test_rod_bent_too_tightly_is_refused(bend):
    curvature = np.array([[0.0, 0.0, 0.3], [bend, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(GeometryError, match=r"element 1 is bent to .* 1\.25 yarn radii: take straight"):
        CurvedSection(1.0, 1.0, 0.3, curvature).stiffness(np.eye(3))


@pytest.mark.parametrize(("friction", "share"), [(0.0, 1.0), (0.76, 0.631), (1.8, 0.0)])
def test_friction_takes_the_place_of_normal_forces(friction, share):
    """Sticking yarns pull in all directions; nu R^2 / c is 1.645 at nu = 0.42."""
    scene = load_scene("beam-hertz-patch-isotropic-course").vary({"contact.friction": friction})
    assert contact_of(scene).pressed == pytest.approx(share, abs=2e-3)
    assert contact_of(scene.vary({"interaction": "rough"})).pressed == 0.0
