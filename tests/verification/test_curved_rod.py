"""Curved rods: their section law against closed forms, chains of beams against solid yarns, small patches."""

import numpy as np
import pytest
from polynomial_rods import POISSON, RADIUS, YOUNG, Rod, arc

from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import (
    PLANES,
    CurvedSection,
    _balance,
    _Disc,
    _strains,
    eased_by_pressure,
    section_compliance,
)
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.cylinder import APART, _beam_patch, cylinder_patch, local_compliance
from knitstudy.mechanics.materials.isotropic import Hencky

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


# Points (q, 2) of the surface of a ring around which a normal force is spread, and its direction N or B: on the inside
# of the bend, and beside it, half on either side.
AROUND = np.linspace(-0.3, 0.3, 31)
SPREAD = np.exp(-0.5 * (AROUND / 0.1) ** 2)
SPREAD /= SPREAD @ np.cos(AROUND)
CIRCLE = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
PLACES = {
    "inside": ([CIRCLE], n_N),
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
    # Unknowns are polynomials of N, B and t.
    load, odd, place = np.zeros(strain.shape[1]), disc.modes(12).sine, 0
    for component in (n_N, n_B):
        kept = odd == ((direction == n_N) == (component == n_B))
        some = slice(place, place := place + kept.sum())
        for at in points:
            push = np.sign(at[len(at) // 2, direction]) * SPREAD * at[:, component] / len(points)
            load[some] += push @ disc.values(12, at)[:, kept]
    stiffness = strain.conj().T @ strain
    answer = np.linalg.lstsq(stiffness, load.astype(complex), rcond=1e-13)[0]
    S = (section_compliance(k, nu) - eased_by_pressure([k], nu)[0])[np.ix_(forces, forces)]
    if wave:
        push = np.zeros(3)
        push[forces.index(direction)] = -1.0
        f = np.linalg.solve(1j * wave * np.eye(3) - _balance(k)[np.ix_(forces, forces)], push)
    else:  # a ring that becomes wider, without a change of its angles
        f = np.array([0.0, 1.0, -S[2, 1] / S[2, 2]]) / k
    return np.real(load @ answer), np.real(f.conj() @ S @ f)


def local_compliances(k, nu, waves, place):
    return [np.subtract(*compliances_of_waves(k, nu, wave, place)) for wave in waves]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("k", [1e-6, 0.2])
def test_normal_forces_on_the_surface_of_a_curved_rod(k, place, verify):
    """What a solid ring gives way beside its beam is local: 1.1 and 0.5 over E R, for waves of 9 radii and of 4.5.

    Beside a beam with the compliance of the energy, both differ by 0.9 to 1.1.
    """
    local = local_compliances(k, NU, (0.7, 1.4), place)
    name = (
        f"surface of a rod with k = {k:.1g}, forces {place}: local compliance of waves of 9 radii, less 4.5"
    )
    verify.at_most(name, abs(local[0] - local[1]), 0.12)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.42])
def test_surface_inside_of_a_slightly_curved_rod(nu, verify):
    """An even force and waves of 126 and 63 radii see one local compliance.

    At nu = 0.3 they differ by 20 where tension makes yarns no thinner, by 2.5 where bending makes no section flat.
    """
    local = local_compliances(0.01, nu, (0.0, 0.05, 0.1), "inside")
    verify.at_most(f"inside of a rod with k = 0.01, nu = {nu:g}: local compliances", np.ptp(local), 0.07)


@pytest.mark.parametrize("nu", [0.2, 0.42])
def test_surfaces_move_with_the_curvature(nu, verify):
    """Patches under normal forces, and under forces across, at two distances of each other on a straight cylinder."""
    near, far = (np.diag(cylinder_patch(0.1, apart, nu))[:3] - _beam_patch(0.1, apart, nu) for apart in APART)
    per_moment = (near - far) / (APART[1] - APART[0]) / (2 / INERTIA / 4)  # twice the motion over dk: -c
    c = INERTIA / 2 * eased_by_pressure([0.0], nu)[0, 0, 0]
    for number, name, expected in ((0, "normal", c), (2, "across", c - nu)):
        case = f"motion of a surface under forces {name}, nu = {nu:g}, over the change of curvature"
        verify.within(case, per_moment[number], expected, 0.03)


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


def test_small_patch_yields_as_a_half_space_does(verify):
    """Two sizes differ as Boussinesq's and Cerruti's mean displacement under an even traction do."""
    small, large = 0.15, 0.3
    normal = 16 * (1 - NU**2) / (3 * np.pi**2) * (1 / small - 1 / large)
    exact = normal * np.array([1, (2 - NU) / (2 * (1 - NU)), (2 - NU) / (2 * (1 - NU))])
    actual = np.subtract(local_compliance(small, NU), local_compliance(large, NU))
    verify.at_most(
        "patch beside a beam: change with its radius over a half-space's",
        np.abs(actual / exact - 1).max(),
        0.06,
    )
