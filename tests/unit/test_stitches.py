"""Repeats of knit and purl stitches: which of them are one knit, room for their yarns, and which loop holds which."""

from functools import cache
from itertools import product

import numpy as np
import pytest

from knitstudy.knit.geometry.drawn_loop import LoopTarget
from knitstudy.knit.geometry.fit import fitted_loop
from knitstudy.knit.geometry.lay_out import all_of_repeat
from knitstudy.knit.geometry.loop_metrics import loop_metrics
from knitstudy.knit.geometry.loop_room import LARGEST_CURVATURE
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


@pytest.mark.parametrize(("stitches", "moved"), [(("KP",), [1, 0, 0]), (("K", "P"), [0, 1, 0])])
def test_repeat_begun_elsewhere_is_the_same_knit(stitches, moved):
    """Begun one stitch later, the yarns lie where those of the first lie, in the plane and behind it."""
    one, other = fitted(stitches), fitted(tuple(row.translate({75: "P", 80: "K"}) for row in stitches))
    mirrored = one.control_points * [1, 1, -1]
    np.testing.assert_allclose(other.control_points, mirrored, atol=0.3 * RADIUS, rtol=0)
    assert loop_metrics(other).gap == pytest.approx(loop_metrics(one).gap, abs=1e-9 * RADIUS)
    assert other.length == pytest.approx(one.length, rel=1e-9)
