"""What the optimisation of a loop refuses, and the pieces that it is made of."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.geometry.lay_out import initial_loop, lay_out
from knitstudy.geometry.optimise import free_components, optimise, squared_join_curvature
from knitstudy.geometry.survey import check_yarns, survey
from knitstudy.study.configuration import load_knits


@pytest.fixture(scope="module")
def scene():
    return next(iter(load_knits().values()))


def with_weights(scene, **weights):
    return scene.vary({f"geometry.{name}": weight for name, weight in weights.items()})


@pytest.mark.parametrize("free", [["z"], ["z", "q"]])
def test_unknown_components_are_refused(free):
    with pytest.raises(GeometryError, match=r"geometry\.free"):
        free_components(free, 2)


def test_join_curvature_is_that_of_a_circle_through_a_regular_polygon():
    # A regular polygon of edge sigma turns by phi: (2/sigma) cos(theta/2) is 1 over its circumradius sin.
    sigma, phi = 0.7, 0.3
    square, _ = squared_join_curvature(np.array([np.cos(phi)]), np.array([sigma]))
    assert np.sqrt(square[0]) == pytest.approx(2 / sigma * np.sin(phi / 2), rel=1e-12)


def test_join_curvature_is_c1_where_its_branches_meet():
    cosine = -np.cos(np.pi / 4 + np.array([1e-7, -1e-7]))  # theta on both sides of pi/4
    square, slope = squared_join_curvature(cosine, np.ones(2))
    np.testing.assert_allclose(square[0], square[1], rtol=1e-6)
    np.testing.assert_allclose(slope[0], slope[1], rtol=1e-6)


def test_join_curvature_of_a_folded_polygon_is_finite_and_above_all_others():
    square, slope = squared_join_curvature(np.array([-1.0, -0.9, 0.0]), np.ones(3))
    assert np.isfinite(square).all()
    assert np.isfinite(slope).all()
    assert square[0] > square[1] > square[2]


@pytest.mark.parametrize("height", [0, -1], ids=["flat", "inside out"])
def test_loops_that_do_not_interlock_are_refused(scene, height):
    loop = initial_loop(scene)
    with pytest.raises(GeometryError, match="interlock"):
        optimise(loop.with_points(loop.control_points * [1, 1, height]), scene.geometry)


def test_weight_too_small_to_part_the_yarns_is_refused(scene):
    with pytest.raises(GeometryError, match=r"crossing zone .* geometry\.alpha"):
        lay_out(with_weights(scene, alpha=1e-5))


def test_yarn_too_thick_for_the_loop_is_refused(scene):
    thick = scene.replace("yarn.diameter", 4.0e-3)
    with pytest.raises(GeometryError, match="optimisation"):
        lay_out(thick)


@pytest.fixture(scope="module")
def surveyed(scene):
    loop = initial_loop(scene)
    return loop, survey(loop)


def test_yarn_that_would_fold_is_refused(surveyed):
    loop, measured = surveyed
    with pytest.raises(GeometryError, match="radius of curvature"):
        check_yarns(replace(measured, radius_of_curvature=0.99 * loop.radius), loop, 0.0)


@pytest.mark.parametrize(("gap", "other_gap"), [(-0.002, 0.5), (0.01, -1e-6)])
def test_yarns_that_overlap_are_refused(surveyed, gap, other_gap):
    loop, measured = surveyed
    overlapping = replace(measured, gap=gap * loop.radius, other_gap=other_gap * loop.radius)
    with pytest.raises(GeometryError, match="yarns overlap"):
        check_yarns(overlapping, loop, 0.001)


def test_initial_yarns_interpenetrate_as_in_figure_1a(surveyed):
    loop, measured = surveyed
    assert measured.penetration > 0.2 * loop.radius
    with pytest.raises(GeometryError, match="yarns overlap"):
        check_yarns(measured, loop, 0.001)
