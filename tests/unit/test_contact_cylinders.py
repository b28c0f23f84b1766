"""The surface of solid yarns of polynomials, as contact sees it."""

import numpy as np
import pytest

from knitstudy.mechanics.contact.candidate_pairs import WIDTH, Neighbourhoods
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.search import Search
from knitstudy.mechanics.spline_yarn.space import Space, yarn_space

RNG = np.random.default_rng(0)
RADIUS, LENGTH, ANGLES = 0.5, 3.0, 12
BREAKS = np.array([0.0, 0.8, 1.2, 1.5, 2.1, LENGTH])
CELLS = [0.0, 0.6, 1.2, 1.4, 1.6, 1.8, 2.4, LENGTH]


def straight(space, middle, along, up):
    """Nodes of a straight yarn of that space."""
    spline = space.spline
    s = np.linspace(0, LENGTH, 60)
    centre = spline.fit(s, middle + (s - 0.5 * LENGTH)[:, None] * along)
    turned = [np.tile(d, (spline.size, 1)) for d in (up, np.cross(along, up))]
    return space.coefficients(centre, *turned, RADIUS)


@pytest.fixture(scope="module")
def crossing():
    """Two yarns that cross, with spans and degrees of all kinds: space, nodes and surfaces."""
    own = yarn_space(BREAKS, [2, 3, 4, 3, 2])
    space = Space((own, own))
    x, y, z = np.eye(3)
    nodes = np.concatenate(
        [straight(own, -(RADIUS + 0.005) * z, x, z), straight(own, (RADIUS + 0.005) * z, y, z)]
    )
    return space, nodes, Cylinders(space, RADIUS, [np.array(CELLS)] * 2, ANGLES)


def test_normals_point_outward_and_points_stand_for_the_area(crossing):
    _, nodes, surfaces = crossing
    contact = Contact(nodes, surfaces, Coulomb(1.0, 1.0, 0.0), margin=0.1, overlap=1e-3)
    assert contact.quadrature.area.sum() == pytest.approx(2 * 2 * np.pi * RADIUS * LENGTH, rel=1e-12)
    points = contact.points(nodes, nodes, ContactHistory.empty())
    assert contact.smallest_gap(points) == pytest.approx(0.01, abs=1e-3)


def beside(length, *heights):
    """Two yarns beside each other, by their heights over their lengths: nodes for every pair of heights, surfaces."""
    x, y, z = np.eye(3)
    own = yarn_space(np.arange(length + 1.0), [2] * length)
    s = np.linspace(0, length, 400)

    def yarn(height):
        centre = own.spline.fit(s, s[:, None] * x + np.broadcast_to(height(s), s.shape)[:, None] * z)
        return own.coefficients(centre, *(np.tile(d, (own.spline.size, 1)) for d in (z, -y)), RADIUS)

    surfaces = Cylinders(Space((own, own)), RADIUS, [np.linspace(0, length, 2 * length + 1)] * 2, ANGLES)
    return [np.concatenate([yarn(height) for height in both]) for both in heights], surfaces


def test_pairs_are_found_again_where_yarns_have_moved(monkeypatch):
    """Of two long yarns beside each other one bends towards the other at its end; all else has not moved."""
    below, above = (lambda s: 0 * s), (lambda s: 2 * RADIUS + 0.25)
    near = below, lambda s: above(s) - 0.27 * np.exp(-((s - 57) ** 2))
    (nodes, bent), surfaces = beside(60, (below, above), near)
    anew, again = (
        Contact(nodes, surfaces, Coulomb(1.0, 1.0, 0.0), margin=0.1, overlap=1e-3) for _ in range(2)
    )
    find, searched = Search.find, []
    monkeypatch.setattr(Search, "find", lambda *given: searched.append(given[3:]) or find(*given))
    assert not len(again.points(nodes, nodes, ContactHistory.empty()).active)
    actual = again.points(bent, nodes, ContactHistory.empty())
    ((rings,),) = searched
    assert 0 < rings.mean() < 0.5
    expected = anew.points(bent, bent, ContactHistory.empty())
    np.testing.assert_array_equal(actual.signature(), expected.signature())
    assert len(actual.active) > 10


def test_no_place_moves_farther_than_is_said(crossing):
    """In the box of a place's ring, for all places that share its neighbourhood."""
    _, nodes, surfaces = crossing
    generator = np.random.default_rng(5)
    before = surfaces.carry(nodes)
    near = Neighbourhoods(surfaces, before, RADIUS)
    xi = generator.uniform(0, [surfaces.edges(0)[0][-1], ANGLES], size=(4000, 2))
    surface = generator.integers(0, 2, len(xi))
    one, other = np.flatnonzero(surface == 0)[:500], np.flatnonzero(surface == 1)[:500]
    ring = np.searchsorted(surfaces.edges(0)[0], xi[one, 0], side="right") - 1
    smallest = []
    for size in np.linspace(0.002, 0.1, 20):
        change = surfaces.carry(size * RADIUS * generator.standard_normal(nodes.shape))
        # The larger part is of long waves, as in a fabric that shears.
        change += 0.3 * np.sin(before[:, [1, 2, 0]] / (6 * RADIUS)) * RADIUS
        motion = near.motion(before + change, before)
        here, there = (surfaces.places(surface, xi, state)[0] for state in (before, before + change))
        then, now = (np.linalg.norm(p[one, None] - p[None, other], axis=2) for p in (here, there))
        shares = then < (WIDTH - 2) * RADIUS
        bound = motion.least(then, near.of_ring[ring][:, None])
        assert np.all(now[shares] >= bound[shares])
        smallest.append((now - bound)[shares].min())
    assert shares.any()
    assert min(smallest) < 0.5 * RADIUS
