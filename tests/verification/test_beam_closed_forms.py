"""Beams against closed forms and published results: section forces, large rotations, springs."""

import numpy as np
import pytest
from dead_loads import balance

from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LinearSprings
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.core.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.rotation import exp

CLAMPED = np.arange(6)


def chain(points, section, radius=1.0):
    ends = np.column_stack([np.arange(len(points) - 1), np.arange(1, len(points))])
    return BeamModel(points, ends, section, radius)


def tip_load(model, force=(0, 0, 0), moment=(0, 0, 0)):
    load = np.zeros(model.size)
    load[-6:] = [*force, *moment]
    return load


def test_45_degree_bend(verify):
    """Bathe and Bolourchi (1979): cantilever of 45 degrees of a circle, R = 100, loaded out of its plane."""
    P, tip = 600.0, (47.150, 15.685, 53.475)
    angle = np.linspace(0, np.pi / 4, 65)
    points = 100.0 * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    model = chain(points, BeamSection(EA=1e7, kGA=4.1667e6, EI=8.333e5, GJ=8.333e5))
    state, _ = balance(model, tip_load(model, (0, 0, P)), CLAMPED, steps=8)
    error = np.abs(state.position[-1] / tip - 1).max()
    verify.at_most(f"45 degree bend, P = {P:g}: tip", error, 2e-3, str(tip))


def test_tip_moment_rolls_a_cantilever_up_to_a_circle(verify):
    """M = 2 pi EI / L: exact for any number of elements, since curvature is constant along the beam."""
    L, EI, count = 10.0, 3.5e3, 8
    points = np.column_stack([np.linspace(0, L, count + 1), np.zeros((count + 1, 2))])
    model = chain(points, BeamSection(EA=1e5, kGA=4e4, EI=EI, GJ=2e3))
    state, _ = balance(model, tip_load(model, moment=(0, 0, 2 * np.pi * EI / L)), CLAMPED, steps=8)
    gap = np.linalg.norm(state.position[-1] - state.position[0]) / L
    verify.at_most("roll-up, M = 2 pi EI / L: gap of the closed circle over L", gap, 1e-6)
    np.testing.assert_allclose(state.rotation[-1], np.eye(3), atol=1e-9)


def test_stretch_and_twist_are_exact():
    section = BeamSection(EA=2e4, kGA=1e4, EI=30.0, GJ=20.0)
    model = chain(np.array([[0, 0, 0], [1.0, 2, 2], [2, 4, 4]]), section)
    axis = np.array([1.0, 2, 2]) / 3
    state, _ = balance(model, tip_load(model, 500.0 * axis, 4.0 * axis), CLAMPED)
    np.testing.assert_allclose(state.position[-1], 6 * (1 + 500 / 2e4) * axis, rtol=1e-12)
    np.testing.assert_allclose(state.rotation[-1], exp(6 * 4.0 / 20.0 * axis), atol=1e-11)


def test_small_deflection_of_a_cantilever_converges_with_order_two(verify):
    """Timoshenko: u = P L^3 / 3 EI + P L / kGA; the one-point element misses it by (h/L)^2 / 4 of bending."""
    section = BeamSection(EA=1e6, kGA=3e5, EI=1e3, GJ=1e3)
    L, P = 2.0, 1e-6
    exact = P * L**3 / (3 * section.EI) + P * L / section.kGA
    counts = np.array([4, 8, 16, 32])
    error = []
    for count in counts:
        points = np.column_stack([np.linspace(0, L, count + 1), np.zeros((count + 1, 2))])
        model = chain(points, section)
        state, _ = balance(model, tip_load(model, (0, 0, P)), CLAMPED)
        error.append(abs(state.position[-1, 2] - exact) / exact)
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    verify.within("cantilever, small deflection: order", order, 2.0, 0.01)
    assert error[0] < 0.02


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_superposed_rigid_motion_turns_forces_and_keeps_energy(kind, verify):
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(4, 3)), axis=0)
    sections = {
        "straight": BeamSection(EA=1e3, kGA=4e2, EI=50.0, GJ=30.0),
        "curved": CurvedSection(0.8, 1e3, 0.42, np.array([0.3, -0.1, 0.2]) * np.arange(3)[:, None] / 2),
    }
    ends = np.column_stack([np.arange(3), np.arange(1, 4)])
    model = BeamModel(points, ends, sections[kind], 1.0, 0.3 * rng.normal(size=(3, 2, 3)))
    state = model.advance(model.start(), 0.4 * rng.normal(size=model.size))
    Q, shift = exp(np.array([1.0, -2.0, 0.7])), np.array([3.0, -1.0, 2.0])
    moved = BeamState(state.position @ Q.T + shift, Q @ state.rotation)
    before, after = model.respond(state, stiffness=True), model.respond(moved, stiffness=True)
    turned = (before.force.reshape(-1, 3) @ Q.T).ravel()
    error = np.abs(after.force - turned).max() / np.abs(turned).max()
    beams = "beams" if kind == "straight" else "beams of curved rods"
    verify.at_most(f"superposed rotation, {beams}: force", error, 1e-10)
    assert after.energy["internal"] == pytest.approx(before.energy["internal"], rel=1e-10)
    turn = np.kron(np.eye(model.size // 3), Q)
    stiffness = turn @ before.stiffness.toarray() @ turn.T
    np.testing.assert_allclose(after.stiffness.toarray(), stiffness, atol=1e-10 * np.abs(stiffness).max())


def test_lees_frame_snaps_through_under_a_prescribed_displacement(verify):
    """A hinged right-angled frame, pushed down a fifth beside its corner: Lee, Manuel and Rossow 1968.

    The displacement turns back at the end of the path that can be followed; a viscous flow continues it. Limit load
    18.552 E I / L^2 times L^2 / E I as published for E = 7.2e6, A = 6, I = 2 and L = 120.
    """
    E, A, inertia, L, n = 720.0, 6.0, 2.0, 120.0, 20
    s = np.linspace(0, L, n + 1)
    post = np.outer(s, [0, 1.0, 0])
    rafter = post[-1] + np.outer(s[1:], [1.0, 0, 0])
    nodes, last = np.concatenate([post, rafter]), 2 * n
    section = BeamSection(E * A, E / 2.6 * A, E * inertia, E * inertia, slenderness=0.25)
    model = BeamModel(nodes, np.column_stack([np.arange(last), np.arange(1, last + 1)]), section, 1.0)
    in_plane = (6 * np.arange(last + 1)[:, None] + [2, 3, 4]).ravel()
    loaded = 6 * (n + n // 5) + 1
    fixed = np.concatenate([in_plane, [0, 1, 6 * last, 6 * last + 1, loaded]])
    way = np.where(fixed == loaded, -90.0, 0.0)[None]
    path = list(trace(model, PrescribedDisplacement(fixed, way), Settings(increments=30), LU()))
    load = np.array([-increment.response.force[loaded] for increment in path])
    assert path[-1].load == 1.0
    verify.within("Lee's frame: limit load", load.max(), 1.8552, 0.005)
    verify.at_most("Lee's frame: load after it has snapped through", load[len(load) // 2 :].min(), -0.9)


def hinged_column(curved=0.0):
    """Return a path in 29 steps that shortens a column in one plane up to 15 Euler loads.

    It starts straight, or as half a sine wave.
    """
    n, euler = 40, 1e-4  # euler: the strain pi^2 EI / EA L^2 of the first buckling load
    x = np.linspace(0.0, 1.0, n + 1)
    section = BeamSection(EA=1.0, kGA=1.0, EI=euler / np.pi**2, GJ=1.0)
    column = chain(np.column_stack([x, curved * np.sin(np.pi * x), 0 * x]), section, radius=0.01)
    out_of_plane = (6 * np.arange(n + 1)[:, None] + [2, 3, 4]).ravel()
    fixed = np.concatenate([out_of_plane, [0, 1, 6 * n, 6 * n + 1]])
    way = np.where(fixed == 6 * n, -15 * euler, 0.0)
    return list(trace(column, PrescribedDisplacement(fixed, way), Settings(increments=29), LU()))


def test_negative_eigenvalues_are_the_buckling_loads_that_a_column_has_passed():
    """A straight column stays straight beyond the loads n^2 pi^2 EI / L^2 (Euler 1744), in balance but not stable."""
    path = hinged_column()
    euler_loads = np.array([-increment.response.force[-6] for increment in path]) / 1e-4
    np.testing.assert_allclose(euler_loads, 15 * np.array([increment.load for increment in path]), rtol=3e-3)
    passed = [increment.negative_eigenvalues for increment in path[1:]]
    assert passed == np.sqrt(euler_loads[1:]).astype(int).tolist()


def test_a_column_that_buckles_stays_stable():
    assert {increment.negative_eigenvalues for increment in hinged_column(curved=1e-3)[1:]} == {0}


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
