"""The section law of a curved rod against closed forms."""

import numpy as np
import pytest

from knitstudy.mechanics.beams.curved_rod import (
    PLANES,
    _balance,
    _Disc,
    _strains,
    eased_by_pressure,
    section_compliance,
)
from knitstudy.mechanics.contact.compliance import APART, _beam_patch, cylinder_patch
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.spline_yarn import basis as disc

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
    actual = []
    for nu in (0.0, NU):
        S = section_compliance(k, nu)
        torsion = (1 + nu) / INERTIA
        actual.append((S[m_t, m_t] + 2 * k * S[n_B, m_t] + k**2 * S[n_B, n_B]) / torsion)
    assert actual[0] == pytest.approx(actual[1], rel=1e-10)
    verify.within(
        f"coil, R over radius {k:g}: deflection over twist", actual[1], 1 - 3 / 16 * k**2, 0.2 * k**4
    )


def test_pure_bending_of_a_curved_rod_without_lateral_contraction(verify):
    """Second order in k: 1 + k^2 / 16 with deforming sections. Winkler's, which do not deform, give 1 - k^2 / 4."""
    k = 0.02
    actual = section_compliance(k, 0.0)[m_B, m_B] * INERTIA
    verify.within("curved rod in pure bending, nu = 0: factor of k^2", (actual - 1) / k**2, 1 / 16, 1e-3)


# Points (q, 2) of the surface of a ring around which a force is spread, and its direction N or B: on the inside and the
# outside of the bend, and beside it, half on either side.
AROUND = np.linspace(-0.3, 0.3, 31)
SPREAD = np.exp(-0.5 * (AROUND / 0.1) ** 2)
CIRCLE = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
PLACES = {
    "inside and outside": ([CIRCLE, CIRCLE * [-1, 1]], n_N),
    "beside": ([CIRCLE[:, ::-1], CIRCLE[:, ::-1] * [1, -1]], n_B),
}


def compliances_of_waves(k, nu, wave, place):
    """Compliance of a solid ring of curvature k under a force exp(i wave s) on its surface, and of its section law."""
    points, direction = PLACES[place]
    section, forces = _Disc(12, direction == n_N), list(PLANES[direction])
    B0, B1, _ = _strains(section, k)
    root = np.linalg.cholesky(Hencky(1.0, nu).moduli).T
    weigh = np.sqrt(section.weight * (1 - k * section.x))[:, None, None] * root
    strain = (weigh @ (B0 + 1j * wave * B1)).reshape(-1, B0.shape[-1])
    # Unknowns are polynomials of N, B and t; those of the force's direction are even in y.
    odd = disc.modes(12).sine
    first, stiffness = direction * odd.sum(), strain.conj().T @ strain
    loads = np.zeros((2, strain.shape[1]))
    for load, at in zip(loads, points, strict=True):
        load[first : first + (~odd).sum()] = SPREAD / SPREAD.sum() @ disc.values(12, at)[:, ~odd]
    loads = loads if direction == n_N else loads.mean(axis=0, keepdims=True)
    answers = np.linalg.lstsq(stiffness, loads.T.astype(complex), rcond=1e-13)[0]
    actual = np.real(np.einsum("pn,np->p", loads, answers)).mean()
    push = np.zeros(3)
    push[forces.index(direction)] = -1.0
    T = _balance(k)[np.ix_(forces, forces)]
    f = np.linalg.solve(1j * wave * np.eye(3) - T, push)
    S = section_compliance(k, nu) - eased_by_pressure([k], nu)[0]
    return actual, np.real(f.conj() @ S[np.ix_(forces, forces)] @ f)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("k", [1e-6, 0.2])
def test_normal_forces_on_the_surface_of_a_curved_rod(k, place, verify):
    """What a solid ring gives way beside its beam is local: 1.1 and 0.5 over E R, for waves of 9 radii and of 4.5.

    Beside a beam with the compliance of the energy, both differ by 0.9 to 1.1.
    """
    local = [np.subtract(*compliances_of_waves(k, NU, wave, place)) for wave in (0.7, 1.4)]
    name = (
        f"surface of a rod with k = {k:.1g}, forces {place}: local compliance of waves of 9 radii, less 4.5"
    )
    verify.at_most(name, abs(local[0] - local[1]), 0.12)


@pytest.mark.parametrize("nu", [0.2, 0.42])
def test_surfaces_move_with_the_curvature(nu, verify):
    """Patches under normal forces, and under forces across, at two distances of each other on a straight cylinder."""
    near, far = (np.diag(cylinder_patch(0.1, apart, nu))[:3] - _beam_patch(0.1, apart, nu) for apart in APART)
    per_moment = (near - far) / (APART[1] - APART[0]) / (2 / INERTIA / 4)  # twice the motion over dk: -c
    c = INERTIA / 2 * eased_by_pressure([0.0], nu)[0, 0, 0]
    for number, name, expected in ((0, "normal", c), (2, "across", c - nu)):
        case = f"motion of a surface under forces {name}, nu = {nu:g}, over the change of curvature"
        verify.within(case, per_moment[number], expected, 0.03)
