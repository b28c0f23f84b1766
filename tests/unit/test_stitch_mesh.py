"""Drawn tucks and floats: yarns stand apart, and every loop is drawn as its letter says."""

from itertools import product

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.knit.geometry.crossings import plane_crossings
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.stitch_mesh import endless_cell_of_stitches, stitches_of
from knitstudy.knit.geometry.stitches import sides
from knitstudy.knit.scene.stitches import size_of_repeat

COURSE, WALE, DIAMETER = 2.2e-3, 3.3e-3, 0.44e-3
HALF_CARDIGAN, FLOATS, CROSS_TUCK = ("KP", "KT"), ("K-", "-K"), ("KT", "TK")
CABLE, LACE = ("K>K(", "KK"), ("K)K", "TK")


def cell(stitches, loops=None):
    target = LoopTarget(COURSE, WALE, DIAMETER / 2, 0.0, None, stitches)
    return endless_cell_of_stitches(target, loops or size_of_repeat(stitches)[0], len(stitches))


def in_front(fabric, lower, upper, column):
    """Return how often the upper of two yarns passes in front of and behind the lower one, in a column of needles."""
    curves = [fabric.centrelines[yarn].curve for yarn in (lower, upper)]
    u = [np.arange(0, 20 * curve.period + 1) / 20 for curve in curves]
    crossed = plane_crossings(
        *((each, curve.value(each)[:, :2]) for each, curve in zip(u, curves, strict=True))
    )
    below, above = (curve.value(crossed[:, side]) for side, curve in enumerate(curves))
    here = below[:, 0] // WALE == column
    front = above[here, 2] > below[here, 2]
    return int(front.sum()), int((~front).sum())


def test_loops_are_held_until_their_needle_knits():
    (knit, purl), (again, tuck) = stitches_of(HALF_CARDIGAN)
    assert [each.held for each in (knit, purl, again, tuck)] == [0, 1, 0, 0]
    assert (purl.place, tuck.place, tuck.side) == (0, 1, -1.0)
    assert [[each.place for each in row] for row in stitches_of(("K", "T", "-", "T"))] == [[0], [1], [0], [2]]


@pytest.mark.parametrize(
    ("stitches", "apart"),
    [
        (HALF_CARDIGAN, 0.5),
        (FLOATS, 0.7),
        (CROSS_TUCK, 0.5),
        (CABLE, 0.5),
        (LACE, 0.35),
        (("K", "T"), 0.5),
        (("K", "T", "T"), 0.5),
        (("KK", "KT", "KT", "KK", "TK", "TK"), 0.5),
        (("K", "T", "T", "T"), 0.35),
    ],
)
def test_yarns_stand_apart_where_they_cross(stitches, apart):
    fabric = cell(stitches, 2 * size_of_repeat(stitches)[0])
    assert fabric.crossings.distance.min() >= apart * DIAMETER
    assert len(fabric.centrelines) == len(stitches) + 1
    again = fabric_of(fabric_dataset(fabric))
    assert [line.length for line in again.centrelines] == [line.length for line in fabric.centrelines]
    np.testing.assert_array_equal(again.periods, fabric.periods)


def test_a_stitch_is_drawn_through_the_loop_and_its_tucks():
    """Its legs pass two heads in front (K) and its sinkers behind the legs of these; of a purl stitch reversed."""
    fabric = cell(HALF_CARDIGAN)
    assert in_front(fabric, 0, 1, 0) == (2, 2)
    assert in_front(fabric, 1, 2, 0) == (2, 2)
    assert in_front(fabric, 1, 2, 1) == (2, 2), "through the tuck"
    assert in_front(fabric, 0, 2, 1) == (2, 2), "and through the loop that was held"


@pytest.mark.parametrize(
    "stitches",
    [("K", "T", "T"), ("K", "T", "T", "T"), ("KTP", "KTT", "TPK", "-TK"), ("TKP", "TKK", "KTT", "--T")],
)
def test_a_stitch_is_drawn_through_all_heads_on_its_needle(stitches):
    height = len(stitches)
    target = LoopTarget(COURSE, WALE, DIAMETER / 2, 0.0, None, stitches)
    fabric = endless_cell_of_stitches(target, len(stitches[0]), 2 * height)
    for row, column in product(range(height), range(len(stitches[0]))):
        stitch = stitches_of(stitches)[row][column]
        if stitch.letter != "-":
            assert in_front(fabric, row, row + stitch.held + 1, column) == (2, 2)


def test_tucks_and_floats_interlock_with_no_loop_below():
    front, behind = in_front(cell(HALF_CARDIGAN), 0, 1, 1)
    assert front > 0
    assert behind == 0, "a tuck of the back bed lies before the purl loop, seen from the front"
    assert in_front(cell(FLOATS), 0, 1, 0) == (0, 2), "a float passes behind the two legs of a knit loop"


@pytest.mark.parametrize(("stitches", "right"), [(CABLE, True), (("K)K<", "KK"), False)])
def test_legs_of_a_cable_cross_as_its_marks_say(stitches, right):
    """Each leg of one loop crosses both of the other: the loop that moves right lies in front, or behind."""
    curve = cell(stitches).centrelines[0].curve
    u = np.linspace(0, curve.period, 40 * int(curve.period) + 1)
    halves = np.split(u[:-1], 2)  # the loops of columns 0 and 1
    crossed = plane_crossings(*((each, curve.value(each)[:, :2]) for each in halves))
    rightwards, leftwards = (curve.value(crossed[:, side])[:, 2] for side in (0, 1))
    assert ((rightwards > leftwards) == right).sum() == 4


def test_lace_has_two_heads_on_one_needle_and_none_on_the_next():
    (moved, home), (begun, knit) = stitches_of(LACE)
    assert (moved.moved, moved.place, home.place) == (1, 1, 0), "the loop that arrives lies behind"
    assert stitches_of(("K>K", "TK"))[0][0].place == 0, "or in front"
    assert (begun.letter, begun.place, knit.held) == ("T", 0, 0)
    assert stitches_of(("P)P", "TP"))[0][0].place == 0, "behind is the side to which a purl stitch is drawn"


def test_a_cable_beside_a_plain_column_leaves_no_needle_empty():
    (right, left, plain), above = stitches_of(("K>K(K", "KKK"))
    assert (right.moved, left.moved, plain.moved) == (1, -1, 0)
    assert [each.place for each in (right, left, plain, *above)] == [0] * 6


@pytest.mark.parametrize(
    ("stitches", "reason"),
    [
        (("K>K", "KK"), "stitch 1 of row 2 has no loop to be drawn through"),
        (("K><K", "KK"), "has marks of one kind"),
        (("K->", "KK"), "a float none"),
    ],
)
def test_marks_that_make_no_knit_are_refused(plain_scene, stitches, reason):
    cell = {
        "specimen": "cell",
        "fidelity": "beam",
        "interaction": "isotropic",
        "pattern.control_points": None,
    }
    size = {"pattern.stitches": list(stitches), "pattern.loops": 2, "pattern.rows": 2}
    with pytest.raises((ConfigurationError, GeometryError), match=reason):
        lay_out(plain_scene.vary(cell | size))


def test_a_plain_knit_is_that_of_its_own_drawing():
    """Without tucks and floats the cell is the one of the loop that is drawn for these spacings."""
    target = LoopTarget(COURSE, WALE, DIAMETER / 2, 0.0, None, ("K",))
    points = cell(("K",)).centrelines[0].curve.control_points
    np.testing.assert_allclose(points, target.drawn().control_points, atol=1e-12)


def test_needles_that_never_knit_are_refused(plain_scene):
    with pytest.raises(GeometryError, match="needle 2 never knits"):
        stitches_of(("KT", "K-"))
    with pytest.raises(GeometryError, match="K and P alone"):
        sides(HALF_CARDIGAN)
    with pytest.raises(ConfigurationError, match="must be cell and beam where"):
        plain_scene.vary({"pattern.stitches": ["KP", "KT"], "pattern.loops": 2, "pattern.rows": 2})
