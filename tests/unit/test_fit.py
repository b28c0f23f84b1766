"""Loops that are drawn from course spacing, wale spacing and yarn, and other ways to say these."""

import re

import numpy as np
import pytest
from loops import KEPT, OUTCOMES, loop_map

from knitstudy.errors import ConfigurationError
from knitstudy.files import read_table
from knitstudy.knit.geometry.fit import ITERATIONS, LARGEST_CURVATURE, ROUNDS, InfeasibleLoop, fitted_loop
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.geometry.loop import Loop, LoopTarget, peirce_length
from knitstudy.knit.geometry.loop_metrics import loop_metrics
from knitstudy.knit.geometry.symmetry import symmetries
from knitstudy.knit.scene.alternatives import diameter_of, read_points
from knitstudy.run.configuration import load_scene

COURSE, WALE = 0.9e-3, 1.1e-3  # the spacings of a jersey


@pytest.fixture(scope="module")
def settings():
    return load_scene("dns-tie-course").replace("geometry.samples", 20).geometry


def jersey(diameter, length=None, scale=1.0):
    return LoopTarget(scale * COURSE, scale * WALE, 0.5 * diameter, 0.01, length)


def assert_fits(loop, expected):
    actual = loop_metrics(loop)
    assert actual.distance / expected.radius == pytest.approx(2.01, abs=1e-4), (
        "gap within 1 % of what was asked"
    )
    assert actual.other_gap / expected.radius > 0.0098
    assert expected.radius / actual.radius_of_curvature < LARGEST_CURVATURE + 1e-3
    assert (loop.course_spacing, loop.wale_spacing) == (expected.course, expected.wale)


def test_drawn_loop_has_its_length_and_both_symmetries():
    loop = jersey(0.2e-3).drawn()
    assert loop.length == pytest.approx(2 * COURSE + WALE + 5.94 * 0.2e-3, rel=0.02), "16 points of a curve"
    assert len(symmetries(loop)) == 4


@pytest.mark.parametrize("diameter", [0.01e-3, 0.15e-3, 0.27e-3])
def test_jersey_has_the_gap_that_is_asked_for(settings, diameter):
    expected = jersey(diameter)
    _, loop, optimum = fitted_loop(expected, settings)
    assert_fits(loop, expected)
    assert optimum.gradient < 1e-3, "a minimum"


def test_loop_in_other_units_is_the_same(settings):
    loop, large = (
        fitted_loop(jersey(scale * 0.25e-3, scale=scale), settings)[1].in_radii() for scale in (1.0, 1e-3)
    )
    assert large.control_points == pytest.approx(loop.control_points, abs=1e-6)


def test_loop_has_the_length_that_is_asked_for(settings):
    expected = jersey(0.2e-3, length=4.3e-3)
    _, loop, _ = fitted_loop(expected, settings)
    assert loop.length == pytest.approx(4.3e-3, rel=1e-5)
    assert_fits(loop, expected)


@pytest.mark.parametrize("diameter", [pytest.param(0.2e-3, marks=pytest.mark.full), 0.25e-3])
def test_length_that_does_not_fit_is_refused_with_one_that_does(settings, diameter):
    """How long the named one is depends on rounding: 5.1 to 6.3 mm of the thinner yarn."""
    with pytest.raises(InfeasibleLoop, match=r"loop_length 8 mm: yarns of .* touch") as refused:
        fitted_loop(jersey(diameter, 8e-3), settings)
    actual = re.search(r"A loop of ([\d.]+) mm fits, the free one has ([\d.]+) mm", str(refused.value))
    named, free = map(float, actual.groups())
    assert named > 1.04 * free
    expected = jersey(diameter, 1e-3 * named)
    assert_fits(fitted_loop(expected, settings)[1], expected)


def test_wales_too_wide_for_a_drawn_interlock_are_refused_with_a_remedy(settings):
    with pytest.raises(
        InfeasibleLoop, match=r"no loop is drawn that interlocks: .*take a pattern.wale_spacing of"
    ):
        fitted_loop(LoopTarget(COURSE, 10 * COURSE, 0.1e-3, 0.01), settings)


def test_yarn_that_is_too_thick_is_refused_with_limit_and_spacings_that_fit(settings):
    with pytest.raises(InfeasibleLoop, match="yarns of one row touch beside") as refused:
        fitted_loop(jersey(0.3e-3), settings)
    assert "\n" not in str(refused.value)
    four_side_by_side = WALE / (4 * 0.3e-3 * 1.005)
    assert refused.value.share == pytest.approx(four_side_by_side, rel=2e-3), "the thickest one is found"
    actual = re.search(r"course_spacing ([\d.]+) and .* ([\d.]+) mm, or .* ([\d.]+) mm$", str(refused.value))
    course, wale, diameter = (1e-3 * float(each) for each in actual.groups())
    for nearest in (LoopTarget(course, wale, 0.15e-3, 0.01), jersey(diameter)):
        assert_fits(fitted_loop(nearest, settings)[1], nearest)


def test_loop_of_close_courses_is_found_where_yarns_nearly_lie_along_each_other(settings):
    expected = LoopTarget(2.772, 6.457, 0.5, 0.01, 17.871)
    _, loop, optimum = fitted_loop(expected, settings)
    assert_fits(loop, expected)
    assert optimum.iterations < ROUNDS * ITERATIONS / 2


@pytest.mark.parametrize(
    ("course", "wale", "share"),
    [(7.054, 8.295, 0.9831), (5.64, 4.113, 0.9714), (3.267, 4.406, 1.005), (6.772, 6.565, 1.047)],
)
def test_loop_that_a_path_reaches_where_it_makes_no_headway_is_found(settings, course, wale, share):
    """Loops of the box of `config/trade.yaml` that were refused, though lengths alike to four digits were found."""
    expected = LoopTarget(course, wale, 0.5, 0.01, share * peirce_length(course, wale, 1.0))
    _, loop, _ = fitted_loop(expected, settings)
    assert_fits(loop, expected)
    assert loop.length == pytest.approx(expected.length, rel=1e-5)


def test_spacings_in_a_scene_draw_a_loop_and_control_points_keep_theirs(plain_scene):
    scene = plain_scene
    per_length = {"pattern.courses_per_metre": 1 / COURSE, "pattern.wale_spacing": WALE}
    changed = scene.vary(per_length | {"yarn.tex": 30.0, "yarn.density": 909.0})
    assert changed.pattern.control_points is None
    assert changed.pattern.course_spacing == pytest.approx(COURSE)
    assert changed.yarn.diameter == diameter_of(30.0, 909.0)
    geometry = lay_out(changed)
    assert float(geometry["course_spacing"]) == pytest.approx(COURSE)
    assert scene.replace("yarn.diameter", 1.7e-3).pattern.control_points == scene.pattern.control_points


def test_diameter_of_a_yarn_is_that_of_peirce():
    count = 30.0  # English cotton count: 590.5 / tex
    assert diameter_of(590.5 / count, 1e3 / 1.1) == pytest.approx(
        34.14e-3 * 25.4e-3 * np.sqrt(1.1 / count), rel=1e-3
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pattern.courses_per_metre": 1e3, "pattern.course_spacing": 1e-3}, "say the same"),
        ({"yarn.tex": 20.0}, "yarn.density is missing"),
        ({"pattern.wales_per_metre": -1}, "must be a number > 0"),
        ({"pattern.loop_length": 4e-3, "pattern.keep": "length"}, "must be 'shape' where"),
        ({"pattern.points_file": "nowhere.csv"}, "must be a CSV file"),
    ],
)
def test_contradictions_are_refused(plain_scene, changes, message):
    with pytest.raises(ConfigurationError, match=message):
        plain_scene.vary(changes)


@pytest.fixture(scope="module")
def paper_points():
    scene = load_scene("dns-tie-course")
    points = np.array(scene.pattern.control_points)
    return np.vstack([points, points[0] + [scene.pattern.wale_spacing, 0, 0]]), 0.5 * scene.yarn.diameter


def written(path, points, head="x, y, z"):
    rows = "\n".join(", ".join(f"{value:.15g}" for value in point) for point in points)
    path.write_text(f"{head}\n{rows}\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("turned", [(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)])
@pytest.mark.parametrize(
    ("head", "unit"), [("x, y, z", 1.0), ("# in m", 1.0), ("x (mm), y (mm), z (mm)", 1e3)]
)
def test_points_of_a_file_are_turned_and_made_symmetric(tmp_path, paper_points, turned, head, unit):
    points, radius = paper_points
    off = points.copy()
    off[3, 2] += 0.02 * radius
    path = written(tmp_path / "loop.csv", unit * (off * turned + [1.0, -2.0, 3.0]), head)
    actual, wale, moved = read_points(path)
    assert wale == pytest.approx(points[-1, 0])
    assert len(symmetries(Loop(actual, wale, COURSE, 0.1e-3))) == 4
    assert moved == pytest.approx(0.015 * radius, rel=1e-6), "to the mean of the four images"
    assert np.abs(np.diff(actual - points[:-1], axis=0)).max() == pytest.approx(0.005 * radius, rel=1e-6)


@pytest.mark.parametrize(
    ("spoil", "head", "reason"),
    [
        (lambda points: points[:4], "x, y, z", "has 4 rows"),
        (
            lambda points: np.where(np.arange(51).reshape(17, 3) == 7, np.nan, points),
            "x, y, z",
            "rows of numbers",
        ),
        (lambda points: points * [1, -1, 1], "x, y, z", "below the heads"),
        (lambda points: points[:, :2], "x, y", "the first row is x, y$"),
        (lambda points: points, "x (mm), y (m), z (m)", "the first row is x .mm., y .m., z .m."),
        (lambda points: points, "a, b, c", "columns x, y, z in m, .*: the first row is a, b, c"),
    ],
)
def test_file_that_is_no_loop_is_refused_in_one_line(tmp_path, paper_points, spoil, head, reason):
    with pytest.raises(ConfigurationError, match=reason) as refused:
        read_points(written(tmp_path / "loop.csv", spoil(paper_points[0]), head))
    assert "\n" not in str(refused.value)


def test_map_names_the_limits_of_loops_that_do_not_fit(plain_scene):
    scene = plain_scene.vary(
        {"geometry.samples": 20, "geometry.beta": 1e-5, "geometry.gamma": 1e-3, "geometry.beta_0": 20.0}
    )
    actual = loop_map(scene, np.array([5.0]), np.array([3.5, 6.0]))
    assert OUTCOMES[int(actual["outcome"][0, 0])] in ("row", "rows")
    assert 0.5 < actual["thickest"][0, 0] < 3.5 / 4, "four yarns stand side by side in a wale"
    assert actual["outcome"][0, 1] == 0
    assert actual["gap_error"][0, 1] < 0.01


@pytest.mark.parametrize(("course", "wale"), [(3.0, 6.5), (6.0, 6.0)])
def test_kept_map_has_loops_of_today(course, wale):
    kept = read_table(KEPT).set_index(["course", "wale"]).loc[(course, wale)]
    actual = loop_map(load_scene("sweep-wale-tie-course"), np.array([course]), np.array([wale]))
    assert kept["outcome"] == "found"
    assert float(actual["length"][0, 0]) == pytest.approx(kept["length"], rel=1e-4)
