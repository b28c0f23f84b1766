"""Contact zones on small grids of facets, counted by hand."""

import numpy as np
import pytest

from knitstudy.contacts.facets import count_zones

AROUND = 8


@pytest.mark.parametrize(
    ("cells", "zones"),
    [
        ([(3, 3)], 1),
        ([(3, 3), (3, 3)], 1),  # two points of one facet
        ([(3, 3), (3, 4)], 1),
        ([(3, 3), (4, 3)], 1),
        ([(3, 3), (4, 4)], 1),  # a corner
        ([(3, 3), (2, 4)], 1),
        ([(3, 3), (3, 5)], 2),
        ([(3, 3), (5, 3)], 2),
        ([(3, 0), (3, 7)], 1),  # around the yarn
        ([(3, 0), (4, 7)], 1),
        ([(3, 7), (4, 0)], 1),
        ([(0, 0), (1, 1), (2, 2), (5, 5), (6, 5)], 2),
        ([(3, 0), (4, 6)], 2),
    ],
)
def test_facets_that_share_an_edge_or_a_corner_are_one_zone(cells, zones):
    cells = np.array(cells)
    assert count_zones(np.zeros(len(cells), dtype=int), cells, AROUND, 1).tolist() == [zones]


def test_places_are_counted_apart():
    """The last layer of one place is numbered next to the first layer of the following one."""
    place = np.array([0, 1, 1, 3])
    cells = np.array([(5, 0), (0, 0), (5, 4), (0, 7)])
    assert count_zones(place, cells, AROUND, 4).tolist() == [1, 2, 0, 1]


def test_order_of_the_points_does_not_matter():
    rng = np.random.default_rng(0)
    place, cells = rng.integers(0, 5, 80), rng.integers(0, 9, (80, 2)) % [9, AROUND]
    shuffled = rng.permutation(80)
    zones = count_zones(place, cells, AROUND, 5)
    np.testing.assert_array_equal(count_zones(place[shuffled], cells[shuffled], AROUND, 5), zones)
    assert zones.sum() > 5


def test_without_points_there_are_no_zones():
    assert count_zones(np.zeros(0, dtype=int), np.zeros((0, 2), dtype=int), AROUND, 2).tolist() == [0, 0]
