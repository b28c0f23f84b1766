"""Beams: rotations, sections, points and crossings of their contact, ties."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refusal
from scipy.spatial import cKDTree

from knitstudy.errors import ConvergenceError
from knitstudy.knit.models.beam import cell as endless_beams
from knitstudy.knit.models.beam.build import beam_knit
from knitstudy.knit.models.beam.contact import contact_of, joined
from knitstudy.mechanics.beams import beam
from knitstudy.mechanics.beams.beam import BeamElements, BeamSection, BeamState
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE, BeamContact
from knitstudy.mechanics.beams.contact_points import ContactPoints, spline_weights
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.beams.laws import RIGID, Power, Repulsion
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.beams.pair_search import PairSearch
from knitstudy.mechanics.core.rotation import Halfway, exp, log
from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate

ANGLES = [0.0, 1e-9, 1e-4, 0.3, 1.0, 2.5, 3.1]


def rotation_vectors(angle, count=5):
    axes = np.random.default_rng(1).normal(size=(count, 3))
    return angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_gives_rotations_that_log_takes_back(angle):
    v = rotation_vectors(angle)
    R = exp(v)
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.tile(np.eye(3), (len(v), 1, 1)), atol=1e-14)
    # Rounding in R of 1e-16 turns into 1e-16 of the angle, amplified by 1/(pi - angle) near pi.
    np.testing.assert_allclose(log(R), v, atol=1e-13)


@pytest.mark.parametrize("angle", [0.1, 1.0, 2.5, np.pi])
def test_scalars_equal_their_closed_forms(angle):
    h = Halfway.of(rotation_vectors(angle, 1))
    a = (angle / 2) / np.sin(angle / 2)
    assert h.a[0] == pytest.approx(a, rel=1e-14)
    assert h.b[0] == pytest.approx(np.tan(angle / 4) / (2 * angle), rel=1e-14)
    assert h.g[0] == pytest.approx((1 - a) / angle**2, rel=1e-12)  # the closed form cancels


def test_circular_section():
    section = BeamSection.circular(diameter=2.0, youngs_modulus=100.0, poisson_ratio=0.25)
    assert section.EA == pytest.approx(100 * np.pi)
    assert section.EI == pytest.approx(100 * np.pi / 4)
    assert section.GJ == pytest.approx(40 * np.pi / 2)
    assert section.kGA == pytest.approx(0.89 * 40 * np.pi)


def test_full_slenderness_compensation_gives_one_element_the_exact_s_bending_stiffness():
    """With the factor kGA / EA both ends clamped give 1 / (L^3 / 12 EI + L / kGA) (MacNeal 1978)."""
    EA, kGA, EI, L = 7e3, 2e3, 5.0, 0.8
    element = BeamElements.between(np.array([[L, 0, 0]]), BeamSection(EA, kGA, EI, 3.0, slenderness=kGA / EA))
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
    assert contact_of(scene).pressed == pytest.approx(share, abs=2e-3)
    assert contact_of(scene.vary({"interaction": "rough"})).pressed == 0.0


UNEVEN = np.array([0.0, 1.0, 1.6, 2.9, 4.0, 4.5, 6.0])
TWO = np.repeat([0, 1], len(UNEVEN))


@pytest.mark.parametrize("stretch", [1.5, 0.9])
def test_pairs_of_a_stretched_knit_need_no_new_search(stretch, monkeypatch):
    """Points move by many reaches. The affine motion of the knit explains nearly all of that."""
    rng = np.random.default_rng(2)
    position = rng.uniform(0, 30, size=(600, 3))
    count = np.arange(600)
    search = PairSearch(count // 20, 1.0 * (count % 20), np.inf, None, None)
    search.within(1.0, 1.4, position, NO_LATTICE)
    monkeypatch.setattr(PairSearch, "_all", None)
    moved = position * [stretch, 1.0, 1.0] + 0.05 * rng.uniform(-1, 1, size=(600, 3))
    actual = search.within(1.0, 1.4, moved, NO_LATTICE)
    near = cKDTree(moved).query_pairs(1.0, output_type="ndarray")
    near = near[near[:, 0] // 20 != near[:, 1] // 20]
    assert len(near) > 10
    assert set(map(tuple, actual.both.tolist())) == set(map(tuple, near.tolist()))


def test_yarns_of_two_stations_are_refused():
    with refusal(r"yarn 1 has 2 beam nodes: .* needs at least 3"):
        ContactPoints.of(np.array([0, 0, 0, 1, 1]), np.array([0, 1, 2, 0, 1.0]), 2)


@pytest.mark.parametrize("period", [None, 7.0])
def test_a_yarn_goes_on_smoothly_through_uneven_stations(period):
    """Tangent and curvature; a straight yarn stays straight, and its images follow it."""
    step, low, high = 0.01, UNEVEN[0], UNEVEN[-1]
    at = np.arange(low, high, step) if period is None else np.arange(low - 0.5, high + 0.5, step)
    weights, periods = spline_weights(UNEVEN, at, period)
    np.testing.assert_allclose(weights @ UNEVEN + (0 if period is None else periods * period), at, atol=1e-12)
    assert (np.diff(weights.indptr) <= 6).all()
    curvature = np.diff(weights.toarray(), 2, axis=0) / step**2
    # Third derivatives times the step; parabolas from station to station jump by a tenth in position
    assert np.abs(np.diff(curvature, axis=0)).max() < 0.3


def test_points_near_a_tie_are_joined_by_its_number():
    points = ContactPoints.of(TWO, np.tile(np.arange(7.0), 2), 1)
    tied = SimpleNamespace(yarn=np.array([[1, 0], [0, 1]]), arc_length=np.array([[5.2, 1.0], [2.0, 3.0]]))
    assert joined(points, tied, 0.5).tolist() == [-1, 0, 1, -1, -1, -1, -1, -1, -1, -1, 1, -1, 0, -1]
    assert joined(points, tied, 1.1).tolist() == [0, 0, 1, 1, -1, -1, -1, -1, -1, 1, 1, 1, 0, 0]


@pytest.fixture(scope="module")
def twice():
    """Contact of a straight yarn and a wave 0.45 above it that crosses it twice, once in either order; their state."""
    x = np.linspace(0, 6, 61)
    low, high = (
        np.stack([x, 0 * x, 0 * x], axis=-1),
        np.stack([x, np.cos(np.pi * x / 3), 0.45 + 0 * x], axis=-1),
    )
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(high, axis=0), axis=1)))
    yarn, s = np.repeat([0, 1], 61), np.concatenate([x, length])
    points, both = ContactPoints.of(yarn, s, 2), np.interp([1.5, 4.5], x, length)
    law = Repulsion(Power(3.0, 1.5), 0.5, 0.01)
    line = LineContact(points.yarn, points.arc_length, points.weight, law, beside=1.0)
    places = np.array([[1.5, both[0]], [both[1], 4.5]])
    none = np.zeros((122, 3))
    contact = BeamContact(line, points, np.arange(122), none, np.array([[0, 1], [1, 0]]), places)
    state = BeamState(np.concatenate([low, high]), np.tile(np.eye(3), (122, 1, 1)))
    return contact, replace(state, contact=contact.start(state))


def test_forces_of_points_are_those_of_the_nearer_crossing(twice):
    contact, state = twice
    actual, force = contact.commit(state), contact.respond(state)[0][:, :3]
    low, left = np.arange(122) < 61, state.position[:, 0] < 3
    on_low, on_high = -force[low & left].sum(axis=0), -force[~low & ~left].sum(axis=0)
    np.testing.assert_allclose(actual.force, [on_low, on_high], atol=1e-12)
    assert actual.force[0, 2] < 0 < actual.force[1, 2]
    np.testing.assert_allclose(actual.gap, [-0.05, -0.05, np.nan], atol=1e-3)
    np.testing.assert_allclose(state.contact.gap, actual.gap)


def test_a_yarn_that_slides_off_the_end_of_another_is_refused(twice):
    contact, state = twice
    pressed, wave = replace(state, contact=contact.commit(state)), (np.arange(122) >= 61)[:, None]
    near, off = (replace(pressed, position=pressed.position + wave * [x, 0, 0]) for x in (-0.7, -1.5))
    assert contact.commit(near).force[0].any()
    with refusal(r"yarns 0 and 1 has slid to the end of a yarn"):
        contact.commit(off)


@pytest.fixture(scope="module")
def beam_scene(touching_cell):
    keys = {"name": "beam", "mesh.beam_size": 10 / 9, "load.strain": 0.03}
    return touching_cell.vary(keys | {"solver.increments": 3, "gates.ledger": 0.2})


@pytest.fixture
def tied_scene(beam_scene):
    """Scene of a knit whose outer rows are tied."""
    tied = {"pattern.loops": 3, "pattern.rows": 3, "contact.tied_edges": "outer", "beam.tie": "rigid"}
    return beam_scene.vary(tied)


def test_pinned_ties_join_points_and_not_sections(tied_scene, knit):
    """A pin is as stiff as contact that sticks, and leaves both sections free to turn."""
    beams = beam_knit(tied_scene.replace("beam.tie", "pinned"), knit)
    assert np.bincount(beams.network.station_node).max() == 1
    penalty = RIGID * tied_scene.yarn.youngs_modulus * tied_scene.yarn.radius
    springs = beams.network.springs
    np.testing.assert_allclose(springs.stiffness, np.tile(penalty * np.eye(3), (beams.tied.sum(), 1, 1)))
    points = beams.network.nodes[springs.ends] + springs.offsets
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-12)


def test_a_relaxation_that_does_not_converge_says_how_to_draw_the_loops(monkeypatch):
    """In the stage, which sees no key but those it reads."""

    def ends(model, prescribed, settings, solver, resume):
        yield from ()
        raise ConvergenceError(f"increment 1 makes no headway. {settings.remedy}")

    monkeypatch.setattr(endless_beams, "trace", ends)
    message = r"relaxation of scene .* does not converge: increment 1 makes no headway\. Draw .* pattern\.wale_spacing"
    with refusal(message):
        simulate(load_scene("fabric-acrylic-stockinette-course-free"))
