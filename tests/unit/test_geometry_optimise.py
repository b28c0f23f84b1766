"""Inputs that the optimisation of a loop refuses, and its parts."""

from dataclasses import replace

import numpy as np
import pytest
from calibrate import UNUSABLE, first_guess, read_problem, residuals, whole_loop
from refusals import refusal

from knitstudy.knit.geometry.lay_out import initial_loop, lay_out
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.loop_metrics import check_yarns, loop_metrics
from knitstudy.knit.geometry.optimise import optimise, squared_join_curvature
from knitstudy.knit.geometry.symmetry import symmetric_motions, symmetries
from knitstudy.run.configuration import CONFIG, knits_of, load_scene, load_scenes


@pytest.fixture(scope="module")
def scene():
    return next(iter(knits_of(load_scenes()).values()))


def test_join_curvature_is_that_of_a_circle_through_a_regular_polygon():
    # A regular polygon of edge sigma turns by phi: (2/sigma) cos(theta/2) is 1 over its circumradius sin.
    sigma, phi = 0.7, 0.3
    square, _ = squared_join_curvature(np.array([np.cos(phi)]), np.array([sigma]))
    assert np.sqrt(square[0]) == pytest.approx(2 / sigma * np.sin(phi / 2), rel=1e-12)


@pytest.mark.parametrize("height", [0, -1], ids=["flat", "inside out"])
def test_loops_that_do_not_interlock_are_refused(scene, height):
    loop = initial_loop(scene)
    with refusal("interlock"):
        optimise(replace(loop, control_points=loop.control_points * [1, 1, height]), scene.geometry)


def test_weight_too_small_to_part_the_yarns_is_refused(scene):
    with refusal(r"crossing zone .* geometry\.alpha"):
        lay_out(scene.replace("geometry.alpha", 1e-5))


@pytest.fixture(scope="module")
def metrics(scene):
    loop = initial_loop(scene)
    return loop, loop_metrics(loop)


def test_yarn_that_would_fold_is_refused(metrics):
    loop, measured = metrics
    with refusal("radius of curvature"):
        check_yarns(replace(measured, radius_of_curvature=0.99 * loop.radius), loop, 0.0)


@pytest.mark.parametrize(("gap", "other_gap"), [(-0.002, 0.5), (0.01, -1e-6)])
def test_yarns_that_overlap_are_refused(metrics, gap, other_gap):
    loop, measured = metrics
    overlapping = replace(measured, gap=gap * loop.radius, other_gap=other_gap * loop.radius)
    with refusal("yarns overlap"):
        check_yarns(overlapping, loop, 0.001)


COARSE = 12  # samples a Bezier curve: closest points are refined from them, fewer only cost less


def test_loop_that_cannot_be_made_is_named_with_its_keys_and_a_remedy():
    keys = {"pattern.course_ratio": 1.3, "pattern.keep": "length", "geometry.samples": COARSE}
    impossible = load_scene("sweep-wale-tie-course").vary(keys)
    named = r"course_ratio 1\.3, pattern\.keep 'length': no wale spacing .*: take a pattern\.course_ratio nearer to 1"
    with refusal(named):
        lay_out(impossible)


WALE = 12.0


def plain_points(count=16):
    t = 2 * np.pi * np.arange(count) / count
    return np.column_stack([WALE * t / (2 * np.pi) + 2.5 * np.sin(2 * t), -7 * np.cos(t), -np.cos(2 * t)])


def group_of(points):
    return symmetries(Loop(points, WALE, 10.0, 1.0))


def test_plain_loop_has_mirror_and_half_turn():
    assert len(group_of(plain_points())) == 4, "with the identity and the product of the two"


def test_loop_without_mirror_is_refused():
    points = plain_points()
    points[3, 0] += 0.1
    with refusal(r"pattern\.control_points.*mirror"):
        group_of(points)


def test_motions_are_independent_and_span_all_that_is_symmetric():
    motions = symmetric_motions(np.ones((16, 3), dtype=bool), group_of(plain_points()))
    # Sinker's y and z, x y z of three points, the leg's z: the rest is fixed by symmetry.
    assert np.linalg.matrix_rank(motions.reshape(48, -1)) == motions.shape[-1] == 12


def test_point_without_its_image_is_refused():
    free = np.zeros((16, 3), dtype=bool)
    free[2, 2] = True
    with refusal(r"geometry\.free"):
        symmetric_motions(free, group_of(plain_points()))


def test_quarter_makes_a_loop_with_mirror_and_half_turn():
    quarter = np.random.default_rng(5).normal(size=(5, 3))
    quarter[0, 0], quarter[-1, :2] = 0.0, (3.0, 0.0)
    assert len(group_of(whole_loop(quarter, WALE))) == 4


def test_residuals_keep_their_number_where_there_is_no_knit():
    problem, _ = read_problem(CONFIG)
    unknowns = first_guess(problem)
    apart = unknowns.copy()
    apart[1] *= 10  # rows too far from each other to cross
    assert (residuals(apart, problem) == UNUSABLE).all()
    assert residuals(apart, problem).shape == residuals(unknowns, problem).shape
