"""Parts of the contact of beams: laws, points of contact and their axes, ties, crossings."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from half_spaces import hertz
from scipy.spatial import cKDTree

from knitstudy.errors import ConvergenceError, GeometryError
from knitstudy.knit.models.beam.contact import joined
from knitstudy.mechanics.beams.beam import BeamState
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE, BeamContact
from knitstudy.mechanics.beams.contact_points import Axes, ContactPoints
from knitstudy.mechanics.beams.laws import CrossedCylinders, Power, Repulsion
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.beams.pair_search import PairSearch

UNEVEN = np.array([0.0, 1.0, 1.6, 2.9, 4.0, 4.5, 6.0])
TWO = np.repeat([0, 1], len(UNEVEN))
LAWS = [Power(3.0), hertz(1.3e9, 0.42, 0.9e-3), CrossedCylinders.elastic(1.3e9, 0.42, 0.9e-3)]


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


@pytest.mark.parametrize("law", LAWS)
def test_stiffness_and_stiffening_are_derivatives_of_force(law):
    approach, step = np.array([2e-5, 1e-6, -3e-6]), 1e-9
    slopes = (np.array(law.force(approach + step)) - law.force(approach - step)) / (2 * step)
    _, stiffness, stiffening = law.force(approach)
    np.testing.assert_allclose(stiffness, slopes[0], rtol=1e-5)
    np.testing.assert_allclose(stiffening, slopes[1], rtol=1e-5, atol=1e-9)


def test_cylinders_that_cross_are_half_spaces_where_patches_are_small():
    """Beyond, they are stiffer, as yarns give way less: by 17 % at 0.03 R (`laws.CrossedCylinders`)."""
    half_spaces, cylinders = LAWS[1:]
    approach = 0.9e-3 * np.array([1e-6, 0.03])
    np.testing.assert_allclose(
        cylinders.force(approach)[0] / half_spaces.force(approach)[0], [1.0, 1.17], rtol=0.01
    )


def curve(s, order=0):
    """A parabola in space, or one of its derivatives."""
    columns = [
        [s, 0.3 * s**2 - s, 2.0 - 0.1 * s**2],
        [np.ones_like(s), 0.6 * s - 1, -0.2 * s],
        [0 * s, 0.6 + 0 * s, -0.2 + 0 * s],
    ]
    return np.stack(columns[order], axis=-1)


def along(yarn, s, order=0):
    """The parabola, mirrored for yarn 1."""
    return np.where(yarn == 0, 1, -1)[:, None] * curve(s, order)


@pytest.mark.parametrize("per_station", [1, 3])
def test_points_lie_on_a_parabola_through_uneven_stations(per_station):
    s = np.tile(UNEVEN, 2)
    points = ContactPoints.of(TWO, s, per_station)
    assert len(points.yarn) == per_station * len(s)
    np.testing.assert_allclose(points.weights @ along(TWO, s), along(points.yarn, points.arc_length))
    np.testing.assert_allclose(np.bincount(points.yarn, points.weight), 6.0)
    last = per_station * len(UNEVEN)
    assert points.ends.tolist() == [0, last, last - 1, 2 * last - 1]
    # Sections are those of the nearest stations.
    apart = np.abs(points.arc_length[:, None] - UNEVEN)
    np.testing.assert_array_equal(points.station % len(UNEVEN), apart.argmin(axis=1))


def test_points_of_yarns_that_repeat_themselves_go_on_over_their_images():
    period = np.array([7.0, 6.5])
    points = ContactPoints.of(TWO, np.tile(UNEVEN, 2), 4, period)
    np.testing.assert_allclose(np.bincount(points.yarn, points.weight), period)
    x = points.weights @ np.tile(UNEVEN, 2) + points.around * period[points.yarn]
    np.testing.assert_allclose(x, points.arc_length, atol=1e-12)
    assert points.arc_length.min() < 0  # before the first station


def test_yarns_of_two_stations_are_refused():
    with pytest.raises(GeometryError, match=r"yarn 1 has 2 beam nodes: .* needs at least 3"):
        ContactPoints.of(np.array([0, 0, 0, 1, 1]), np.array([0, 1, 2, 0, 1.0]), 2)


@pytest.mark.parametrize("length", [0.1, 1.4])
def test_axes_of_a_parabola_are_exact_to_its_ends(length):
    """Through neighbours, and through points farther away; nearer to the ends, through the last ones."""
    points = ContactPoints.of(TWO, np.tile(UNEVEN, 2), 3)
    yarn, s = points.yarn, points.arc_length
    axes = Axes.of(yarn, s, points.weight, length, None)
    assert np.all(yarn[axes.points] == yarn[:, None])
    derivatives = axes.at(np.arange(len(s)), along(yarn, s), np.zeros((2, 3)))
    for order, actual in enumerate(derivatives, start=1):
        np.testing.assert_allclose(actual, along(yarn, s, order), atol=1e-10)


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


def test_motion_counts_between_yarns_that_are_near_each_other(twice):
    contact, state = twice
    every, wave = np.ones((122, 1)), (np.arange(122) >= 61)[:, None]
    far = replace(state, position=state.position + every * [3.0, 2.0, 1.0])
    apart = replace(far, position=far.position + wave * [0, 0, 0.1])
    assert contact.motion(state, far) == pytest.approx(0, abs=1e-12)
    assert contact.motion(state, apart) == pytest.approx(0.1)


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
    with pytest.raises(ConvergenceError, match=r"yarns 0 and 1 has slid to the end of a yarn"):
        contact.commit(off)
