"""Fabrics: crossings that are found from curves, grips, pieces."""

import numpy as np
import pytest

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.geometry.fabric import Arc, Fabric, cut_cells, endless_cell, of_curves, pair, plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.geometry.spline import CatmullRom, Centreline
from knitstudy.geometry.yarn_spacing import closest_approach, crossings_in_plane, windows

RADIUS = 0.9e-3


@pytest.fixture(scope="module")
def loop(plain_scene):
    return initial_loop(plain_scene)


@pytest.mark.parametrize(("loops", "rows"), [(1, 1), (3, 2), (2, 4)])
def test_crossings_of_a_knit_are_those_of_one_cell_moved(loop, loops, rows):
    crossings = plain_knit(loop, loops, rows).crossings
    curve, rise = loop.in_radii().curve, loop.course_spacing / loop.radius
    cell = closest_approach(curve, rise, windows(crossings_in_plane(curve, rise), curve.period), 100)
    row, column, zone = (each.ravel() for each in np.indices((rows, loops, 4)))
    for name, expected in (("row", row), ("column", column), ("zone", zone)):
        np.testing.assert_array_equal(getattr(crossings, name), expected)
    np.testing.assert_array_equal(crossings.yarn, row[:, None] + [0, 1])
    moved = np.column_stack([column * loop.wale_spacing, row * loop.course_spacing, 0 * row])[:, None]
    np.testing.assert_allclose(
        crossings.point, cell.point[zone] * loop.radius + moved, atol=1e-9 * loop.radius
    )
    np.testing.assert_allclose(crossings.distance, cell.distance[zone] * loop.radius, rtol=1e-9)


def straight(start, end):
    """A straight yarn between two points, as an arc of a curve that goes on."""
    step = (np.asarray(end, dtype=float) - start) / 4
    line = Centreline(CatmullRom(start + np.arange(6)[:, None] * step, 6 * step), 1)
    return Arc(line, 0.0, float(4 * np.linalg.norm(step)))


def test_crossings_of_any_curves_are_common_perpendiculars():
    up = 2.1 * RADIUS
    first = straight([-0.02, 0, 0], [0.02, 0.001, 0.0005])
    others = [straight([x - 0.004, -0.01, up], [x + 0.005, 0.012, up]) for x in (-0.013, -0.002, 0.0101)]
    fabric = of_curves([first, *others], RADIUS)
    crossings = fabric.crossings
    np.testing.assert_array_equal(crossings.yarn, [[0, 1], [0, 2], [0, 3]])
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    for side in (0, 1):
        places = zip(crossings.yarn[:, side], crossings.arc_length[:, side : side + 1], strict=True)
        along = np.concatenate([fabric.centrelines[yarn].tangent(s) for yarn, s in places])
        np.testing.assert_allclose(np.einsum("ki,ki->k", apart, along), 0, atol=1e-12)


def test_a_yarn_crosses_itself():
    """A trochoid with three turns crosses itself in each, where its height has opposite signs."""
    t = np.linspace(-np.pi, np.pi, 24, endpoint=False)
    points = np.column_stack([2e-3 * t - 7e-3 * np.sin(t), -7e-3 * np.cos(t), 1.2 * RADIUS * np.sin(t)])
    yarn = Centreline(CatmullRom(points, [4e-3 * np.pi, 0, 0]), 3)
    found = of_curves([yarn], RADIUS).crossings
    assert found.yarn.tolist() == [[0, 0]] * 3
    np.testing.assert_allclose(found.arc_length.sum(axis=1), np.array([1, 3, 5]) / 3 * yarn.length, rtol=1e-6)
    assert np.all(np.abs(np.diff(found.point, axis=1)[:, 0, 2]) > 1.5 * RADIUS)


def test_yarns_that_pass_far_apart_do_not_cross():
    lines = [straight([-0.01, 0, 0], [0.01, 0, 0]), straight([0, -0.01, 4 * RADIUS], [0, 0.01, 4 * RADIUS])]
    assert len(of_curves(lines, RADIUS).crossings) == 0


def test_grips_of_a_knit(loop):
    knit = plain_knit(loop, 3, 2)
    held, driven = knit.grips["course"]
    assert held.yarn.tolist() == driven.yarn.tolist() == [0, 1, 2]
    assert not held.arc.any()
    held, driven = knit.grips["wale"]
    assert set(held.yarn) == {0}
    assert set(driven.yarn) == {2}
    assert len(knit.grip_ends("wale")[0]) == 6  # half a sinker at each end of the yarn
    assert len(knit.grip_ends("wale")[2]) == 6
    assert knit.grip_ends("course") == {}
    assert held.holds([0, 0, 1], [0.0, held.arc[1].mean(), 0.0]).tolist() == [True, True, False]


def test_cut_cells_have_the_yarn_of_an_endless_knit(loop):
    cells, cell = cut_cells(loop, 3, 2), endless_cell(loop, 3, 2)
    assert np.isclose(sum(line.length for line in cells.centrelines), 6 * loop.length)
    assert len(cells.crossings.zone) == len(cell.crossings.zone) == 24
    np.testing.assert_allclose(cells.crossings.point, cell.crossings.point)
    assert not cell.grips
    np.testing.assert_allclose(cell.periods, [[3 * loop.wale_spacing, 0, 0], [0, 2 * loop.course_spacing, 0]])


@pytest.mark.parametrize("angle", [12.0, 47.0, 90.0])
def test_the_crossing_of_a_pair(angle):
    fabric = pair(RADIUS, angle, 9e-3, 0.02)
    crossings = fabric.crossings
    np.testing.assert_allclose(
        crossings.point[0], [[0, 0, -1.01 * RADIUS], [0, 0, 1.01 * RADIUS]], atol=1e-15
    )
    np.testing.assert_allclose(crossings.arc_length, [[4.5e-3, 4.5e-3]])
    np.testing.assert_allclose(crossings.distance, 2.02 * RADIUS)


def test_a_fabric_comes_back_from_its_dataset(loop):
    for fabric in (plain_knit(loop, 2, 3), pair(RADIUS, 60.0, 9e-3, 0.02)):
        again = Fabric.from_dataset(fabric.to_dataset())
        np.testing.assert_array_equal(again.crossings.point, fabric.crossings.point)
        assert again.specimen == fabric.specimen


def test_what_is_no_fabric_is_refused(loop):
    with pytest.raises(GeometryError, match=r"pattern.rows = 0: allowed is a whole number from 1 on"):
        plain_knit(loop, 2, 0)
    with pytest.raises(GeometryError, match=r"pair.angle = 100.0 degrees"):
        pair(RADIUS, 100.0, 9e-3)
    dataset = plain_knit(loop, 1, 1).to_dataset()
    with pytest.raises(DataFileError, match=r"\['loops'\] are missing"):
        Fabric.from_dataset(dataset.drop_vars("loops"))
    with pytest.raises(DataFileError, match="its attribute specimen is 'sock'"):
        Fabric.from_dataset(dataset.assign_attrs(specimen="sock"))
