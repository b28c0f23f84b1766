"""Parts of the contact of beams: smooth centrelines, pieces at crossings, laws, neighbours."""

import numpy as np
import pytest

from knitstudy.geometry.crossings import Crossings
from knitstudy.mechanics.beam_approach import Curves, Pairs, approach
from knitstudy.mechanics.beam_contact import Power, hertz
from knitstudy.models.beams_in_contact import STRIP, Neighbours

UNEVEN = np.array([0.0, 1.0, 1.6, 2.9, 4.0, 4.5, 6.0])


def two_yarns():
    """Curves of two yarns with uneven stations, and their yarn numbers."""
    yarn = np.repeat([0, 1], len(UNEVEN))
    return Curves(yarn, np.concatenate([UNEVEN, UNEVEN + 0.0])), yarn


def curve(s, order=0):
    """A parabola in space, which the curves follow exactly."""
    columns = [
        [s, 0.3 * s**2 - s, 2.0 - 0.1 * s**2],
        [np.ones_like(s), 0.6 * s - 1, -0.2 * s],
        [0 * s, 0.6 + 0 * s, -0.2 + 0 * s],
    ]
    return np.stack(columns[order], axis=-1)


def test_curves_pass_a_parabola_through_uneven_stations():
    curves, yarn = two_yarns()
    position = np.where(yarn[:, None] == 0, curve(curves.arc_length), -curve(curves.arc_length))
    s = np.linspace(0, 6, 41)
    for number, sign in ((0, 1.0), (1, -1.0)):
        stencil = curves.stencil(np.full(len(s), number), s)
        for order, weights in enumerate((stencil.value, stencil.first, stencil.second)):
            np.testing.assert_allclose(stencil.of(weights, position), sign * curve(s, order), atol=1e-12)


def test_closest_points_of_two_curves():
    """A parabola over a straight yarn, found from a start that is far off; a bound is not a closest approach."""
    curves, _ = two_yarns()
    s = UNEVEN
    bowl = np.stack([s - 2.2, 0 * s, 1 + 0.2 * (s - 2.2) ** 2], axis=-1)
    straight = np.stack([0 * s, s - 3.7, 0 * s], axis=-1)
    position = np.concatenate([bowl, straight])
    whole = np.array([[[0.0, 6.0], [0.0, 6.0]], [[3.0, 6.0], [0.0, 6.0]]])
    pairs = Pairs(np.array([[0, 1], [0, 1]]), whole, np.array([[5.5, 0.4], [5.5, 0.4]]))
    found = approach(curves, position, pairs)
    np.testing.assert_allclose(found.s[0], [2.2, 3.7], atol=1e-9)
    np.testing.assert_allclose(found.distance[0], 1.0, atol=1e-12)
    np.testing.assert_allclose(found.normal[0], [0, 0, -1], atol=1e-9)
    assert found.free.tolist() == [[True, True], [False, True]]
    np.testing.assert_allclose(found.s[1, 0], 3.0)


@pytest.mark.parametrize("law", [Power(3.0), hertz(1.3e9, 0.42, 0.9e-3)])
def test_force_is_the_derivative_of_energy(law):
    gap = np.array([-2e-5, -1e-6, 3e-6])
    step = 1e-9
    slope = -(law.energy(gap + step) - law.energy(gap - step)) / (2 * step)
    np.testing.assert_allclose(law.force(gap), slope, rtol=1e-5)
    stiffness = -(law.force(gap + step) - law.force(gap - step)) / (2 * step)
    np.testing.assert_allclose(law.stiffness(gap), stiffness, rtol=1e-5)
    stiffening = (law.stiffness(gap + step) - law.stiffness(gap - step)) / (2 * step)
    np.testing.assert_allclose(law.stiffening(gap), stiffening, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(law.depth(law.force(gap)), np.maximum(0, -gap), rtol=1e-12)


@pytest.fixture
def rods():
    """Three straight yarns of radius 0.2: 0 and 1 cross, 2 lies beside 0 and is known to touch nothing."""
    s = np.linspace(0, 6, 25)
    along_x = np.stack([s - 3, 0 * s, 0 * s], axis=-1)
    along_y = np.stack([0 * s, s - 3, 0 * s + 0.45], axis=-1)
    beside = along_x + np.array([0, 0.9, 0])
    yarn = np.repeat([0, 1, 2], len(s))
    curves = Curves(yarn, np.tile(s, 3))
    position = np.concatenate([along_x, along_y, beside])
    return Neighbours(curves, yarn, one_crossing(), np.array([False]), 0.2), position, yarn


def one_crossing():
    one = np.array([0])
    return Crossings(
        one, one, one, np.array([[0, 1]]), np.full((1, 2), 3.0), np.zeros((1, 2, 3)), np.array([0.45])
    )


def test_yarns_may_touch_beside_crossings(rods):
    neighbours, position, _ = rods
    known = neighbours.first()
    pairs = neighbours.search(position, known, known.start)
    assert pairs.yarn.tolist() == [[0, 1], [1, 2]]  # yarns 0 and 2 are too far apart
    np.testing.assert_allclose(pairs.start, [[3.0, 3.0], [3.9, 3.0]], atol=1e-9)
    np.testing.assert_allclose(pairs.bounds[1], [[3.1, 4.7], [2.2, 3.8]], atol=1e-9)


def test_hooked_yarns_may_touch_between_their_crossings():
    """Yarns 0 and 1 cross twice in a row, the second one the other way round; yarn 2 crosses 0 farther on."""
    every, point = np.arange(3), np.zeros((3, 2, 3))
    yarn, place = np.array([[0, 1], [0, 1], [0, 2]]), np.array([[2.0, 4.0], [3.0, 2.0], [5.0, 1.0]])
    crossings = Crossings(every, every, every, yarn, place, point, np.ones(3))
    station = np.repeat([0, 1, 2], 7)
    curves = Curves(station, np.tile(np.arange(7.0), 3))
    pairs = Neighbours(curves, station, crossings, np.zeros(3, dtype=bool), 0.2).first()[3:]
    assert pairs.yarn.tolist() == [[0, 1], [0, 1]]
    gap = STRIP * 0.2
    windows = [[[gap, 2.5 - gap], [gap, 3 - gap]], [[2.5 + gap, 4 - gap], [3 + gap, 6 - gap]]]
    np.testing.assert_allclose(pairs.bounds, windows)
    np.testing.assert_allclose(pairs.start, [[2.5, 3.0], [2.5, 3.0]])


def test_second_minimum_of_a_crossing_has_a_pair_of_its_own(rods):
    """Yarn 1 comes down on yarn 0 a second time, 1.5 to the side: windows part half way, whoever is side A."""
    neighbours, position, yarn = rods
    known = neighbours.first()
    s = neighbours.curves.arc_length
    bent = position.copy()
    bent[yarn == 1] = np.stack([s - 3, 0 * s, 0.45 + 0.2 * np.sin(np.pi * (s - 3) / 1.5) ** 2], axis=-1)[
        yarn == 1
    ]
    bent[yarn == 0] = position[yarn == 0] + np.array([0, 0.02, 0]) * np.cos(3 * (s[yarn == 0] - 3))[:, None]
    pairs = neighbours.search(bent, known, known.start)
    at = {
        (round(a, 1), round(b, 1)): k for k, (a, b) in enumerate(pairs.start) if set(pairs.yarn[k]) == {0, 1}
    }
    assert {(3.0, 3.0), (4.5, 4.5), (1.5, 1.5)} <= set(at)
    one, other = pairs.bounds[at[3.0, 3.0]], pairs.bounds[at[4.5, 4.5]]
    parted = other[:, 0] - one[:, 1]
    np.testing.assert_allclose(parted.max(), STRIP * 0.2, atol=1e-6)
    again = neighbours.search(bent, pairs, pairs.start)
    np.testing.assert_allclose(again.bounds, pairs.bounds, atol=1e-12)  # all minima are followed


def test_gaps_of_near_yarns(rods):
    neighbours, position, _ = rods
    pairs, s, gap = neighbours.closest(position, 0.3)
    # Yarns 1 and 2 cross as well, and nobody said so.
    assert pairs.yarn.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_allclose(gap, [0.05, 0.05], atol=1e-9)
    np.testing.assert_allclose(s, [[3.0, 3.0], [3.9, 3.0]], atol=1e-9)
    yarn, places = np.concatenate([pairs.yarn, pairs.yarn[:, ::-1]]), [*s, *(s[:, ::-1] + [0.1, -0.3])]
    near, apart = neighbours.near(yarn, np.array(places), 0.31 / 0.2)
    assert sorted(near.tolist()) == [[0, 2], [1, 3]]
    np.testing.assert_allclose(apart, 0.3)
    assert len(neighbours.near(yarn, np.array(places), 0.29 / 0.2)[0]) == 0
