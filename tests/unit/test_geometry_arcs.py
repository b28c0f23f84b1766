"""Sinker and head arcs: between the crossings that bound them, all loops alike."""

import numpy as np
import pytest

from knitstudy.geometry.cut import head_arcs, inside, sinker_arcs


def test_arcs_end_where_yarns_cross(knit):
    sinkers, heads = sinker_arcs(knit), head_arcs(knit)
    assert sinkers.shape == (knit.loops + 1, 2)
    assert heads.shape == (knit.loops, 2)
    crossings = knit.crossings
    lowest = {side: np.sort(np.unique(np.round(crossings.arc_length[:, side], 9))) for side in (0, 1)}
    for arcs, side in ((sinkers, 1), (heads, 0)):
        ends = arcs.ravel()
        ends = ends[(ends > 0) & (ends < knit.centrelines[0].length)]
        assert np.abs(ends[:, None] - lowest[side]).min(axis=1).max() < 1e-8


def test_no_crossing_lies_within_an_arc(knit):
    for arcs, side in ((sinker_arcs(knit), 1), (head_arcs(knit), 0)):
        along = knit.crossings.arc_length[:, side]
        deep = (along[:, None] > arcs[:, 0] + 1e-9) & (along[:, None] < arcs[:, 1] - 1e-9)
        assert not deep.any()


def test_arcs_follow_each_other_once_a_loop(knit):
    length = knit.centrelines[0].length
    sinkers, heads = sinker_arcs(knit), head_arcs(knit)
    assert sinkers[0, 0] == 0
    assert sinkers[-1, 1] == length
    stops = np.concatenate([np.ravel(sinkers)[1:-1].reshape(-1, 2), heads]).ravel()
    assert len(np.unique(np.round(stops, 9))) == stops.size
    middle = knit.centrelines[0].position(sinkers.mean(axis=1))[1:-1]
    top = knit.centrelines[0].position(heads.mean(axis=1))
    assert middle[:, 1].max() < top[:, 1].min()


@pytest.mark.parametrize(
    ("at", "expected"), [(1.0, True), (2.0, True), (2.1, False), (0.9, False), (5.5, True)]
)
def test_ends_belong_to_an_arc(at, expected):
    arcs = np.array([[1.0, 2.0], [5.0, 6.0]])
    assert inside(np.array([at]), arcs)[0] == expected
