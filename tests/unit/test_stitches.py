"""Repeats of stitches: which of them are one knit, room for their yarns, and how each is drawn."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from refusals import READ, REFUSED, refusal

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry import fit
from knitstudy.knit.geometry import lay_out as geometry_stage
from knitstudy.knit.geometry.crossings import plane_crossings
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.fit import LARGEST_CURVATURE, fitted_loop
from knitstudy.knit.geometry.lay_out import all_of_repeat, lay_out
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.loop_metrics import loop_metrics
from knitstudy.knit.geometry.stitch_mesh import endless_cell_of_stitches, stitches_of
from knitstudy.knit.geometry.stitches import sides, standard
from knitstudy.knit.models.beam.build import build
from knitstudy.knit.scene.stitches import size_of_repeat
from knitstudy.measures.construction import drawn
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


COURSE_DRAWN, WALE_DRAWN, DIAMETER = 2.2e-3, 3.3e-3, 0.44e-3
HALF_CARDIGAN, FLOATS = ("KP", "KT"), ("K-", "-K")
CABLE, LACE = ("K>K(", "KK"), ("K)K", "TK")


def cell(stitches, loops=None):
    target = LoopTarget(COURSE_DRAWN, WALE_DRAWN, DIAMETER / 2, 0.0, None, stitches)
    return endless_cell_of_stitches(target, loops or size_of_repeat(stitches)[0], len(stitches))


def in_front(fabric, lower, upper, column):
    """Return how often the upper of two yarns passes in front of and behind the lower one, in a column of needles."""
    curves = [fabric.centrelines[yarn].curve for yarn in (lower, upper)]
    u = [np.arange(0, 20 * curve.period + 1) / 20 for curve in curves]
    crossed = plane_crossings(
        *((each, curve.value(each)[:, :2]) for each, curve in zip(u, curves, strict=True))
    )
    below, above = (curve.value(crossed[:, side]) for side, curve in enumerate(curves))
    here = below[:, 0] // WALE_DRAWN == column
    front = above[here, 2] > below[here, 2]
    return int(front.sum()), int((~front).sum())


def test_loops_are_held_until_their_needle_knits():
    (knit, purl), (again, tuck) = stitches_of(HALF_CARDIGAN)
    assert [each.held for each in (knit, purl, again, tuck)] == [0, 1, 0, 0]
    assert (purl.place, tuck.place, tuck.side) == (0, 1, -1.0)
    assert [[each.place for each in row] for row in stitches_of(("K", "T", "-", "T"))] == [[0], [1], [0], [2]]


@pytest.mark.parametrize(("stitches", "apart"), READ["stitches"])
def test_yarns_stand_apart_where_they_cross(stitches, apart):
    """By a share of the diameter at least."""
    stitches = tuple(stitches)
    fabric = cell(stitches, 2 * size_of_repeat(stitches)[0])
    assert fabric.crossings.distance.min() >= apart * DIAMETER
    assert len(fabric.centrelines) == len(stitches) + 1
    again = fabric_of(fabric_dataset(fabric))
    assert [line.length for line in again.centrelines] == [line.length for line in fabric.centrelines]
    np.testing.assert_array_equal(again.periods, fabric.periods)


@pytest.mark.parametrize(
    "stitches",
    [("K", "T", "T"), ("K", "T", "T", "T"), ("KTP", "KTT", "TPK", "-TK"), ("TKP", "TKK", "KTT", "--T")],
)
def test_a_stitch_is_drawn_through_all_heads_on_its_needle(stitches):
    height = len(stitches)
    target = LoopTarget(COURSE_DRAWN, WALE_DRAWN, DIAMETER / 2, 0.0, None, stitches)
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


@pytest.mark.parametrize(("stitches", "reason"), REFUSED["marks"])
def test_marks_that_make_no_knit_are_refused(plain_scene, stitches, reason):
    cell = {
        "specimen": "cell",
        "fidelity": "beam",
        "interaction": "isotropic",
        "pattern.control_points": None,
    }
    size = {"pattern.stitches": list(stitches), "pattern.loops": 2, "pattern.rows": 2}
    with refusal(reason):
        lay_out(plain_scene.vary(cell | size))


def test_a_plain_knit_is_that_of_its_own_drawing():
    """Without tucks and floats the cell is the one of the loop that is drawn for these spacings."""
    target = LoopTarget(COURSE_DRAWN, WALE_DRAWN, DIAMETER / 2, 0.0, None, ("K",))
    points = cell(("K",)).centrelines[0].curve.control_points
    np.testing.assert_allclose(points, target.drawn().control_points, atol=1e-12)


def test_needles_that_never_knit_are_refused(plain_scene):
    with refusal("needle 2 never knits"):
        stitches_of(("KT", "K-"))
    with refusal("K and P alone"):
        sides(HALF_CARDIGAN)
    with refusal("must be cell and beam where"):
        plain_scene.vary({"pattern.stitches": ["KP", "KT"], "pattern.loops": 2, "pattern.rows": 2})


def test_a_cell_that_comes_to_rest_is_drawn_where_no_loop_can_be_fitted(monkeypatch):
    """Fits of slack repeats such as ["PK", "KK"] fail after half a minute: this one fails at once."""

    def refuses(*_):
        raise GeometryError("yarns cross 14 times")

    monkeypatch.setattr(geometry_stage, "fitted_loop", refuses)
    stitches = {"pattern.stitches": ["PK", "KK"], "pattern.loops": 2, "pattern.rows": 2}
    rests = load_scene("fabric-acrylic-stockinette-course-free").vary(
        stitches | {"pattern.loop_length": None}
    )
    drawn = fabric_of(lay_out(rests))
    assert drawn.periods[[0, 1], [0, 1]] == pytest.approx(
        [2 * rests.pattern.wale_spacing, 2 * rests.pattern.course_spacing]
    )
    assert len(drawn.centrelines) == 3
    with pytest.raises(GeometryError, match="yarns cross 14 times"):
        lay_out(rests.vary({"geometry.diameter_share": 1.0}))


RIB = {"pattern.course_spacing": 2.4e-3, "pattern.wale_spacing": 2.2e-3, "pattern.loop_length": None}
OF_INLAY = {"yarn_b.of": "wool-2-48", "yarn_b.diameter": 0.5e-3}


def laid(stitches, rows, turns=("a", "inlay"), **keys):
    """A scene of a cell with an inlay, of an acrylic yarn."""
    size = {"pattern.stitches": list(stitches), "pattern.loops": len(stitches[0]), "pattern.rows": rows}
    scene = load_scene("fabric-acrylic-stockinette-course-free")
    return scene.vary(RIB | OF_INLAY | size | {"yarn_b.rows": list(turns)} | keys)


@pytest.mark.parametrize(
    ("stitches", "turns", "inlays"),
    [
        (("KP",), ("a", "inlay"), [1]),
        (("KKPP",), ("a", "inlay"), [1]),
        (("KP", "KT"), ("a", "inlay"), [1, 3]),
        (("KP",), ("a", "a", "inlay"), [2]),
        (("KP", "KT"), ("a", "inlay", "b"), [1]),
    ],
)
def test_an_inlay_lies_between_the_beds_behind_loops_of_one_and_before_those_of_the_other(
    stitches, turns, inlays
):
    """It is straight, in the middle of its row, and the last yarn is the image of the first, a period higher."""
    scene = laid(stitches, 2 if len(stitches) > 1 or len(turns) > 2 else 1, turns)
    geometry = lay_out(scene)
    fabric = fabric_of(geometry)
    *yarns, image = (each.position(np.linspace(0, each.length, 400)) for each in fabric.centrelines)
    np.testing.assert_allclose(image - yarns[0], np.tile(fabric.periods[1], (400, 1)), atol=1e-12)
    assert [k for k, yarn in enumerate(yarns) if np.ptp(yarn[:, 2]) == 0] == inlays
    below = {k: k - sum(other < k for other in inlays) - 1 for k in inlays}  # rows
    assert [yarns[k][0, 1] for k in inlays] == pytest.approx([2.4e-3 * below[k] for k in inlays])
    assert len(scene.radius) == len(scene.tex) == len(yarns)
    assert (2e3 * scene.radius[inlays]).tolist() == [0.5] * len(inlays)
    numbers = {number.name: number.value for number in drawn(geometry, scene.tex)}
    length = np.array([line.length for line in fabric.centrelines[:-1]])
    rows = [k for k in range(len(yarns)) if k not in inlays]
    per_stitch = length[rows].sum() / (len(rows) * len(stitches[0]))
    assert numbers["length of yarn in a stitch"] == pytest.approx(1e3 * per_stitch)
    assert ("tightness factor" in numbers) == ("b" not in turns)
    area = fabric.width * fabric.height
    assert numbers["mass per area"] == pytest.approx(1e-3 * (scene.tex * length).sum() / area)


@pytest.mark.parametrize(("stitches", "share", "reason"), REFUSED["inlay"])
def test_an_inlay_that_would_pierce_loops_is_refused(stitches, share, reason):
    with refusal(reason):
        lay_out(laid(stitches, len(stitches), **{"geometry.diameter_share": share}))


def test_keys_of_an_inlay_are_those_of_its_geometry_alone():
    scene = laid(("KP",), 2)
    other = scene.vary({"yarn_b.diameter": 0.6e-3})
    assert scene.geometry_key != other.geometry_key
    stripes = scene.vary({"yarn_b.rows": ["a", "b"]})
    assert stripes.geometry_key == stripes.vary({"yarn_b.rows": ["b", "a"]}).geometry_key


RIB_OF_JERSEY = {"pattern.stitches": ["KP"], "pattern.loops": 2, "pattern.rows": 1}
JERSEY = {
    "knit": "jersey",
    "fidelity": "beam",
    "interaction": "isotropic",
    "outputs": [],
    "pattern.course_spacing": 0.9e-3,
    "pattern.wale_spacing": 1.1e-3,
    "yarn.diameter": 0.25e-3,
    "yarn.youngs_modulus": 2e8,
}


@pytest.fixture
def jersey():
    """The jersey of the tutorial, from which a rib is tried first."""
    return load_scene("cell-course").vary({"name": "jersey", **JERSEY})


def test_a_rib_in_the_spacings_of_a_jersey_names_a_remedy_that_works_and_looks_for_no_other(
    jersey, monkeypatch
):
    """Nearest spacings took 30 s, and no beams need them."""
    monkeypatch.setattr(fit, "_nearest", lambda *arguments: pytest.fail("other spacings are looked for"))
    with refusal("legs pass each other.*; or geometry.relaxed true: loops are drawn for a thinner yarn"):
        lay_out(jersey.vary(RIB_OF_JERSEY))
    relaxed = jersey.vary(RIB_OF_JERSEY | {"geometry.relaxed": True})
    assert (relaxed.load.start, relaxed.geometry.diameter_share) == ("rest", 0.6)
    assert relaxed.mesh.section_law == "straight"
    assert lay_out(relaxed).sizes["fabric_yarn"] == 2


def test_keys_that_are_set_have_priority_over_those_of_relaxed_loops(jersey):
    share = {"geometry.relaxed": True, "geometry.diameter_share": 0.5, "load.start": "rest_with_friction"}
    scene = jersey.vary(share)
    assert (scene.load.start, scene.geometry.diameter_share) == ("rest_with_friction", 0.5)
    assert jersey.vary({"geometry.relaxed": False}).load.start == "drawn"
    with refusal("geometry.relaxed is 'yes' but must be true or false"):
        jersey.vary({"geometry.relaxed": "yes"})


def test_tucks_that_bend_too_much_for_curved_rods_name_the_remedy(jersey):
    half_cardigan = {"pattern.stitches": ["KP", "KT"], "pattern.loops": 2, "pattern.rows": 2}
    scene = jersey.vary(half_cardigan)
    with refusal("take straight sections.* .mesh.section_law straight.: geometry.relaxed true"):
        build(scene, fabric_of(lay_out(scene)))
