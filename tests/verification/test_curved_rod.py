"""The section law of a curved rod against closed forms."""

import numpy as np
import pytest

from knitstudy.mechanics.beams.curved_rod import section_compliance

NU = 0.42
AREA, INERTIA = np.pi, np.pi / 4  # of radius 1
n_N, n_B, n_t, m_N, m_B, m_t = range(6)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_straight_rod_has_the_closed_forms(nu, verify):
    """Tension, bending and twist, and the shear factor of the strain energy of Saint-Venant's bending (Renton 1991)."""
    S, G = section_compliance(0.0, nu), 0.5 / (1 + nu)
    shear = (7 + 14 * nu + 8 * nu**2) / (6 * (1 + nu) ** 2) / (G * AREA)
    exact = np.diag([shear, shear, 1 / AREA, 1 / INERTIA, 1 / INERTIA, 1 / (2 * G * INERTIA)])
    verify.at_most(f"section of a straight rod, nu = {nu:g}: compliance", np.abs(S - exact).max(), 1e-10)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.42])
def test_couplings_of_a_slightly_curved_rod(nu, verify):
    k = 1e-3
    S, G = section_compliance(k, nu), 0.5 / (1 + nu)
    tension = (3 + 7 * nu + 5 * nu**2) / (12 * (1 + nu)) / INERTIA
    shear = -(7 + 14 * nu + 9 * nu**2) / (24 * (1 + nu) ** 2) / (2 * G * INERTIA)
    error = max(abs(S[n_t, m_B] / k / tension - 1), abs(S[n_B, m_t] / k / shear - 1))
    verify.at_most(f"curved rod, couplings over curvature, nu = {nu:g}", error, 1e-5, "rational in nu")


@pytest.mark.parametrize("k", [0.1, 0.33, 0.55])
def test_coil_under_a_force_on_its_axis(k, verify):
    """Goehner's problem: twist P / k and shear P alike everywhere. Deflection over that of twist alone is 1 - 3/16 k^2
    to the second order (Ancker and Goodier 1958), whatever nu is.
    """
    found = []
    for nu in (0.0, NU):
        S = section_compliance(k, nu)
        torsion = (1 + nu) / INERTIA
        found.append((S[m_t, m_t] + 2 * k * S[n_B, m_t] + k**2 * S[n_B, n_B]) / torsion)
    assert found[0] == pytest.approx(found[1], rel=1e-10)
    verify.within(
        f"coil, R over radius {k:g}: deflection over twist", found[1], 1 - 3 / 16 * k**2, 0.2 * k**4
    )


def test_pure_bending_of_a_curved_rod_without_lateral_contraction(verify):
    """Second order in k: 1 + k^2 / 16 with deforming sections. Winkler's, which do not deform, give 1 - k^2 / 4."""
    k = 0.02
    found = section_compliance(k, 0.0)[m_B, m_B] * INERTIA
    verify.within("curved rod in pure bending, nu = 0: factor of k^2", (found - 1) / k**2, 1 / 16, 1e-3)
