"""Repeats of knit and purl stitches: which of them are one knit, room for their yarns, and which loop holds which."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.fit import LARGEST_CURVATURE, fitted_loop
from knitstudy.knit.geometry.lay_out import all_of_repeat
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.loop_metrics import loop_metrics
from knitstudy.knit.geometry.specimens import cut_cells, endless_cell
from knitstudy.knit.geometry.stitches import sides, standard
from knitstudy.run.configuration import load_scene

COURSE, WALE, RADIUS = 0.9e-3, 1.1e-3, 0.1e-3
SMALL = [("".join(row[:2]), "".join(row[2:])) for row in product("KP", repeat=4)]
SAMPLES = 80  # of a half loop, as a polygon


@cache
def knit_of(stitches):
    """The optimised loops of the repeat that stands for stitches."""
    settings = load_scene("dns-tie-course").geometry
    return fitted_loop(LoopTarget(COURSE, WALE, RADIUS, 0.01, stitches=stitches), settings)[1]


def fitted(stitches):
    return all_of_repeat(knit_of(standard(stitches)[0]), stitches)


def linking(first, second):
    """Linking number of two closed polygons (n, 3), (m, 3): the Gauss integral, exact for each pair of edges.

    Klenin and Langowski 2000, "Computation of writhe in modeling of supercoiled DNA", Biopolymers 54.
    """
    a, b = first[:, None], np.roll(first, -1, axis=0)[:, None]
    c, d = second[None], np.roll(second, -1, axis=0)[None]
    normals = [np.cross(p, q) for p, q in ((c - a, d - a), (d - a, d - b), (d - b, c - b), (c - b, c - a))]
    normals = [n / np.linalg.norm(n, axis=-1, keepdims=True) for n in normals]
    angles = sum(
        np.arcsin(np.clip(np.vecdot(p, q), -1, 1))
        for p, q in zip(normals, normals[1:] + normals[:1], strict=True)
    )
    return (np.sign(np.vecdot(np.cross(d - c, b - a), c - a)) * angles).sum() / (4 * np.pi)


def links(loop, row, column, above, leg, beside=0):
    """Linking of a loop's bight, closed between the middles of its legs, with a leg of a loop some rows above.

    The leg runs from the sinker to the head and goes on straight down and up; far away it is closed.
    """
    lower, upper = loop.image(row), loop.image(row + above)
    first = 16 * column
    bight = lower.value(first + np.linspace(4, 12, SAMPLES))
    ends = (0, 8) if leg == 0 else (16, 8)
    half = upper.value(first + 16 * beside + np.linspace(*ends, SAMPLES))
    far = 50 * loop.wale_spacing
    out = np.array([[0, far, 0], [far, far, 0], [far, -far, 0], [0, -far, 0]])
    around = np.concatenate([half, half[-1] + out[:2], half[0] + out[2:]])
    return linking(bight, around)


def test_repeats_of_two_by_two_are_five_knits():
    assert {standard(stitches)[0] for stitches in SMALL} == {
        ("K",),
        ("KP",),
        ("K", "P"),
        ("KP", "PK"),
        ("KK", "KP"),
    }


def marks(stitches):
    """One of these repeats takes half a minute, its images nothing more; the others have all pairs of neighbours."""
    return pytest.mark.full if standard(stitches)[0] == ("KK", "KP") else ()


@pytest.mark.parametrize(
    "stitches", [pytest.param(each, marks=marks(each), id="/".join(each)) for each in SMALL]
)
def test_every_loop_is_held_by_the_one_above_and_yarns_have_room(stitches):
    loop = fitted(stitches)
    actual, side = loop_metrics(loop), sides(stitches)
    assert actual.gap / RADIUS > 0.01 - 1e-3, "the clearance"
    assert RADIUS / actual.radius_of_curvature < LARGEST_CURVATURE + 1e-3
    for row, column in np.ndindex(2, 2):
        through = side[(row + 1) % 2, column]
        for leg in (0, 1):
            assert links(loop, row, column, 1, leg) == pytest.approx(-through, abs=1e-6)
        assert links(loop, row, column, 1, leg=0, beside=1) == pytest.approx(0, abs=1e-6), "the next wale"
        assert links(loop, row, column, 2, leg=0) == pytest.approx(0, abs=1e-6), "two rows above"


def test_purl_is_knit_seen_from_behind():
    settings = load_scene("dns-tie-course").geometry
    one, other = (
        fitted_loop(LoopTarget(COURSE, WALE, RADIUS, 0.01, stitches=(letter,)), settings)[1]
        for letter in "KP"
    )
    np.testing.assert_allclose(
        other.control_points, one.control_points * [1, 1, -1], atol=1e-9 * RADIUS, rtol=0
    )


@pytest.mark.parametrize(("stitches", "moved"), [(("KP",), [1, 0, 0]), (("K", "P"), [0, 1, 0])])
def test_repeat_begun_elsewhere_is_the_same_knit(stitches, moved):
    """Begun one stitch later, the yarns lie where those of the first lie, in the plane and behind it."""
    one, other = fitted(stitches), fitted(tuple(row.translate({75: "P", 80: "K"}) for row in stitches))
    mirrored = one.control_points * [1, 1, -1]
    np.testing.assert_allclose(other.control_points, mirrored, atol=0.3 * RADIUS, rtol=0)
    assert loop_metrics(other).gap == pytest.approx(loop_metrics(one).gap, abs=1e-9 * RADIUS)
    assert other.length == pytest.approx(one.length, rel=1e-9)


@pytest.mark.parametrize("stitches", [("KP",), ("K", "P")])
def test_cells_and_pieces_have_the_yarn_of_their_repeats(stitches):
    loop = fitted(stitches)
    cell = endless_cell(loop, 2, 2)
    np.testing.assert_allclose(cell.periods, [[2 * WALE, 0, 0], [0, 2 * COURSE, 0]])
    assert cell.cells == (2, 2)
    assert len(cell.crossings) == 16
    again = fabric_of(fabric_dataset(cell))
    assert again.loop.stitches == stitches
    np.testing.assert_array_equal(again.crossings.arc_length, cell.crossings.arc_length)
    pieces = cut_cells(loop, 2, 2)
    assert sum(line.length for line in pieces.centrelines) == pytest.approx(4 * loop.length, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"pattern.stitches": ["K", "F"]},
            "stitch 1 of row 2 is 'F' but must be - .float., K .knit., P .purl. or T",
        ),
        ({"pattern.stitches": ["KT"]}, "stitch 2 is T in all rows but must be K or P in one"),
        ({"pattern.stitches": ["K", "-"]}, "row 2 floats past all needles"),
        ({"pattern.stitches": ["KP", "K"]}, "all of one length"),
        ({"pattern.stitches": ["KP"], "pattern.loops": 3}, "pattern.loops is 3 but must be a multiple of 2"),
    ],
)
def test_stitches_that_are_not_knitted_here_are_refused_by_name(plain_scene, changes, message):
    with pytest.raises(ConfigurationError, match=message) as refused:
        plain_scene.vary(changes)
    assert "\n" not in str(refused.value)
