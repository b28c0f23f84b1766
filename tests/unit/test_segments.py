"""Yarns cut at their crossings, and the segments that the pieces make."""

import numpy as np
import pytest

from knitstudy.contacts.segments import KINDS, NO_SEGMENT, segments
from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.measures.segments import angles_to_axes


@pytest.fixture(scope="module")
def knit(plain_scene):
    return plain_knit(initial_loop(plain_scene), 3, 3)


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


def test_pieces_of_a_segment_join_its_contact_zones(knit, cut):
    """Heads and sinkers run along x, and legs are steeper than the interlocks of this loop."""
    angle = {}
    for kind in KINDS:
        here = pieces(cut, kind)
        chord = [
            np.diff(knit.centrelines[cut.yarn[each]].position(cut.arc_length[each]), axis=0)[0]
            for each in here
        ]
        assert np.ptp(np.abs(chord)[:, :2], axis=0).max() < 2 * knit.radius
        angle[kind] = angles_to_axes(np.array(chord) * [1, 1, 0])[:, 0].mean()
    assert angle["head"] < 5
    assert angle["sinker"] < 5
    assert min(angle["leg, left"], angle["leg, right"]) > 45
    assert angle["leg, left"] == pytest.approx(angle["leg, right"], abs=1e-6)


def test_what_meets_no_other_yarn_is_no_segment(knit, cut):
    """Of the top yarn its heads, of the bottom yarn its feet, and of all yarns the cut ends."""
    ends = (cut.arc_length[:, 0] == 0) | (cut.arc_length[:, 1] == knit.centrelines[0].length)
    assert np.all(cut.of_piece[ends] == NO_SEGMENT)
    outside = (cut.of_piece == NO_SEGMENT) & ~ends
    assert {0: 2, 3: 3} == {yarn: int((outside & (cut.yarn == yarn)).sum()) for yarn in (0, 3)}
    assert not np.any(outside & np.isin(cut.yarn, (1, 2)))
