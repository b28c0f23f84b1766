"""Facets at crossings, and sums over the points that touch near them."""

import numpy as np
import pytest

from knitstudy.knit.contacts.facets import (
    REACH,
    CrossingFacets,
    Rings,
    count_zones,
    crossing_forces,
    touching_points,
)
from knitstudy.knit.contacts.segments import KINDS, NO_SEGMENT, segments
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.yarns.discretisation import yarn_surfaces
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact

RADIUS, SIZE = 0.9e-3, 0.5


@pytest.fixture(scope="module")
def mesh(pair):
    return mesh_fabric(pair, SIZE, 1.2)


@pytest.fixture(scope="module")
def facets(pair, mesh):
    return CrossingFacets.of(pair.crossings, mesh)


@pytest.fixture(scope="module")
def knitted(plain_scene, knit_of):
    """Crossings of a knit of two rows on its mesh."""
    knit = knit_of(plain_scene.replace("pattern.loops", 1).replace("pattern.rows", 2))
    return CrossingFacets.of(knit.crossings, mesh_fabric(knit, SIZE))


def test_facets_face_each_other(facets, knitted):
    """The middles of the two facets of a crossing lie at the contact: nearer than half a facet."""
    for actual in (facets, knitted):
        middle = actual.mesh.nodes[actual.nodes].mean(axis=2)
        from_contact = np.linalg.norm(middle - actual.crossings.point.mean(axis=1, keepdims=True), axis=2)
        np.testing.assert_array_less(from_contact, 0.5 * SIZE * RADIUS)


def test_places_away_from_crossings_belong_to_none(facets, pair, mesh):
    along = np.linspace(0, mesh.stations[0][-1], 50)
    zero = np.zeros(50, dtype=int)
    crossing, side = facets.nearest(zero, zero + 1, along)
    near = np.abs(along - pair.centrelines[0].length / 2) <= REACH * RADIUS
    assert 0 < near.sum() < 50
    np.testing.assert_array_equal(crossing, np.where(near, 0, -1))
    assert not side.any()
    # Yarns without a crossing of their own.
    assert (facets.nearest(zero, zero, along)[0] == -1).all()


@pytest.fixture(scope="module")
def touching(mesh, facets):
    """The upper yarn pressed onto the lower one and slid, all its nodes alike: answer of contact, and columns."""
    law = Coulomb(1.3e9 / (SIZE * RADIUS), 1.3e9 / (SIZE * RADIUS), 0.3)
    contact = Contact(
        mesh.nodes, Grids(yarn_surfaces(mesh)), law, margin=0.3 * RADIUS, overlap=1e-2 * SIZE * RADIUS
    )
    upper = np.repeat(mesh.yarn_of_slice == 1, mesh.section.size)[:, None]
    pressed = mesh.nodes + upper * [0, 0, -1e-4]
    history = contact.commit(contact.points(pressed, mesh.nodes, ContactHistory.empty()))
    slid = pressed + upper * [2e-6, 1e-6, 0]
    answer = contact.forces(contact.points(slid, pressed, history), stiffness=False)
    committed = contact.points(slid, pressed, contact.commit(answer.points))
    return answer, touching_points(contact, committed, facets, Rings.of_rows(mesh.stations))


def test_force_of_a_crossing_is_that_on_the_lower_yarns_nodes(touching, mesh):
    answer, columns = touching
    on_lower = -answer.node_force[: mesh.first_slice[1] * mesh.section.size].sum(axis=0)
    assert on_lower[2] < -1.0
    assert on_lower[0] > 0.1, "friction draws the lower yarn along"
    np.testing.assert_allclose(crossing_forces(columns, 1)[0], on_lower, rtol=1e-9)
    assert not crossing_forces(columns | {"crossing": np.full(len(columns["side"]), -1)}, 1).any()


AROUND = 8


@pytest.mark.parametrize(
    ("cells", "zones"),
    [
        ([(3, 3)], 1),
        ([(3, 3), (4, 3)], 1),
        ([(3, 3), (4, 4)], 1),  # a corner
        ([(3, 3), (3, 5)], 2),
        ([(3, 0), (3, 7)], 1),  # around the yarn
        ([(3, 7), (4, 0)], 1),
        ([(3, 0), (4, 6)], 2),
    ],
)
def test_facets_that_share_an_edge_or_a_corner_are_one_zone(cells, zones):
    cells = np.array(cells)
    assert count_zones(np.zeros(len(cells), dtype=int), cells, AROUND, 1).tolist() == [zones]


@pytest.fixture(scope="module")
def cut(knit):
    return segments(knit.crossings, np.array([each.length for each in knit.centrelines]))


def pieces(cut, kind):
    return np.flatnonzero(np.isin(cut.of_piece, np.flatnonzero(cut.kind == KINDS.index(kind))))


def test_pieces_make_up_all_of_the_yarns(knit, cut):
    length = np.diff(cut.arc_length, axis=1)[:, 0]
    assert np.all(length > 0)
    for yarn, centreline in enumerate(knit.centrelines):
        assert length[cut.yarn == yarn].sum() == pytest.approx(centreline.length, rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "count", "yarns"),
    [
        ("head", 9, 1),
        ("interlock, left", 9, 2),
        ("interlock, right", 9, 2),
        ("leg, left", 6, 1),
        ("leg, right", 6, 1),
        ("sinker", 6, 1),
    ],
)
def test_segments_of_a_knit(cut, kind, count, yarns):
    assert (cut.kind == KINDS.index(kind)).sum() == count
    assert len(pieces(cut, kind)) == yarns * count


def test_a_piece_that_meets_no_other_yarn_is_no_segment(knit, cut):
    """Of the top yarn its heads, of the bottom yarn its feet, and of all yarns the cut ends."""
    ends = (cut.arc_length[:, 0] == 0) | (cut.arc_length[:, 1] == knit.centrelines[0].length)
    assert np.all(cut.of_piece[ends] == NO_SEGMENT)
    outside = (cut.of_piece == NO_SEGMENT) & ~ends
    assert {0: 2, 3: 3} == {yarn: int((outside & (cut.yarn == yarn)).sum()) for yarn in (0, 3)}
    assert not np.any(outside & np.isin(cut.yarn, (1, 2)))
