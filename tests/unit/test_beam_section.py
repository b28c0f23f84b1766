"""Stiffness of yarn sections and elements."""

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.mechanics import beam
from knitstudy.mechanics.beam import Elements, Section


def test_circular_section():
    section = Section.circular(diameter=2.0, youngs_modulus=100.0, poisson_ratio=0.25)
    assert section.EA == pytest.approx(100 * np.pi)
    assert section.EI == pytest.approx(100 * np.pi / 4)
    assert section.GJ == pytest.approx(40 * np.pi / 2)
    assert section.kGA == pytest.approx(0.89 * 40 * np.pi)


def test_two_yarns_side_by_side_are_twice_as_stiff():
    one, two = (Section.circular(1e-3, 1e9, 0.4, count) for count in (1.0, 2.0))
    for name in ("EA", "kGA", "EI", "GJ"):
        assert getattr(two, name) == pytest.approx(2 * getattr(one, name))


@pytest.mark.parametrize(
    ("diameter", "modulus"), [(0.0, 1e9), (-1e-3, 1e9), (1e-3, 0.0), (float("nan"), 1e9)]
)
def test_section_without_size_or_stiffness_is_refused(diameter, modulus):
    with pytest.raises(ConfigurationError, match=r"yarn\.diameter"):
        Section.circular(diameter, modulus, 0.4)


def test_element_without_length_is_refused():
    with pytest.raises(GeometryError, match="element 1 has no length"):
        Elements.between(np.array([[1.0, 0, 0], [0, 0, 0]]), Section(1.0, 1.0, 1.0, 1.0))


def test_full_slenderness_compensation_gives_one_element_the_exact_s_bending_stiffness():
    """With the factor kGA / EA both ends clamped give 1 / (L^3 / 12 EI + L / kGA) (MacNeal 1978)."""
    EA, kGA, EI, L = 7e3, 2e3, 5.0, 0.8
    element = Elements.between(np.array([[L, 0, 0]]), Section(EA, kGA, EI, 3.0, slenderness=kGA / EA))
    now = beam.deform(element, np.array([[L, 0.0, 0.0]]), np.eye(3)[None], np.eye(3)[None])
    K = beam.stiffness(element, now)[0]
    assert K[7, 7] == pytest.approx(1 / (L**3 / (12 * EI) + L / kGA), rel=1e-14)
