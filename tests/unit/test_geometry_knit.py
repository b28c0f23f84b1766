"""Loops, knits, their crossings and their files."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.files import read_dataset, write_dataset
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.geometry.pattern import Knit


@pytest.fixture(scope="module")
def knit(plain_scene):
    return Knit(initial_loop(plain_scene), loops=2, rows=3)


def test_rows_of_interlocks_lie_between_rows_of_yarn(knit):
    assert len(knit.centrelines) == 4
    rise = knit.centrelines[3].position(np.array([0.0])) - knit.centrelines[0].position(np.array([0.0]))
    np.testing.assert_allclose(rise, [[0, 3 * knit.loop.course_spacing, 0]], atol=1e-15)


def test_yarns_run_from_sinker_to_sinker(knit):
    yarn = knit.centrelines[0]
    ends = yarn.position(np.array([0, yarn.length]))
    np.testing.assert_allclose(ends[:, 0], [0, 2 * knit.loop.wale_spacing], atol=1e-12)
    np.testing.assert_allclose(yarn.tangent(np.array([0, yarn.length])), [[1, 0, 0]] * 2, atol=1e-9)
    assert yarn.length == pytest.approx(2 * knit.loop.length, rel=1e-12)


def test_four_crossings_a_cell_ordered_by_row_column_and_zone(knit):
    crossings = knit.crossings
    rows, columns, zones = np.indices((3, 2, 4)).reshape(3, -1)
    np.testing.assert_array_equal(crossings.row, rows)
    np.testing.assert_array_equal(crossings.column, columns)
    np.testing.assert_array_equal(crossings.zone, zones)
    np.testing.assert_array_equal(crossings.yarn, np.column_stack([rows, rows + 1]))


def test_crossing_points_lie_on_their_yarns(knit):
    crossings = knit.crossings
    for side in (0, 1):
        for yarn, centreline in enumerate(knit.centrelines):
            here = crossings.yarn[:, side] == yarn
            points = centreline.position(crossings.arc_length[here, side])
            np.testing.assert_allclose(points, crossings.point[here, side], atol=1e-12)


def test_closest_points_face_each_other(knit):
    crossings = knit.crossings
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), crossings.distance, rtol=1e-12)
    for side in (0, 1):
        tangent = knit.centrelines[0].tangent(crossings.arc_length[:, side])
        cosine = (apart * tangent).sum(axis=1) / crossings.distance
        np.testing.assert_allclose(
            cosine, 0, atol=1e-6
        )  # rounding of a distance leaves its root in the angle


def test_zones_are_left_and_right_lower_and_upper(knit):
    middle = knit.crossings.point.mean(axis=1).reshape(3, 2, 4, 3)
    centre = knit.loop.wale_spacing * (np.arange(2) + 0.5)[:, None]
    assert (middle[..., [0, 2], 0] < centre).all()
    assert (middle[..., [1, 3], 0] > centre).all()
    assert (middle[..., [2, 3], 1] > middle[..., [0, 1], 1]).all()


def test_upper_yarn_passes_behind_below_and_in_front_above(knit):
    height = knit.crossings.point[..., 2].reshape(3, 2, 4, 2)
    in_front = height[..., 1] > height[..., 0]
    np.testing.assert_array_equal(in_front, np.broadcast_to([False, False, True, True], in_front.shape))


def test_file_gives_the_same_knit(knit, tmp_path):
    path = tmp_path / "knit.nc"
    write_dataset(knit.to_dataset(), path)
    again = Knit.from_dataset(read_dataset(path))
    np.testing.assert_array_equal(again.loop.control_points, knit.loop.control_points)
    np.testing.assert_array_equal(again.crossings.point, knit.crossings.point)
    assert (again.loops, again.rows, again.loop.radius) == (2, 3, knit.loop.radius)


def test_every_variable_of_the_file_has_a_unit(knit):
    dataset = knit.to_dataset()
    assert all("units" in dataset[name].attrs for name in dataset.data_vars)


def test_file_without_radius_is_refused(knit):
    with pytest.raises(DataFileError, match="radius"):
        Knit.from_dataset(knit.to_dataset().drop_vars("radius"))


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("radius", 0.0, "yarn.diameter"),
        ("radius", -1e-3, "yarn.diameter"),
        ("radius", np.nan, "yarn.diameter"),
        ("clearance", -0.1, "pattern.clearance"),
        ("course_spacing", 1.7e-3, "pattern.course_spacing"),
        ("wale_spacing", 1.8e-3, "pattern.wale_spacing"),
    ],
)
def test_impossible_loops_are_refused(knit, key, value, named):
    with pytest.raises(GeometryError, match=named):
        replace(knit.loop, **{key: value})


@pytest.mark.parametrize(("loops", "rows", "named"), [(0, 1, "loops"), (1, 0, "rows"), (1.5, 1, "loops")])
def test_counts_are_whole_and_positive(knit, loops, rows, named):
    with pytest.raises(GeometryError, match=f"pattern.{named}"):
        Knit(knit.loop, loops, rows)


def test_loops_that_do_not_cross_are_no_knit(knit):
    apart = replace(knit.loop, course_spacing=10 * knit.loop.course_spacing)
    with pytest.raises(GeometryError, match="cross 0 times"):
        _ = Knit(apart, 1, 1).crossings
