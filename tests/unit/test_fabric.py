"""Fabrics: crossings that are found from curves, grips, pieces."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.knit.geometry.crossings import crossings_of_loop, windows_of_loop
from knitstudy.knit.geometry.fabric import Grip, of_curves
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.specimens import cut_cells, endless_cell, plain_knit, yarn_pair
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.loading.solve import solve_load_path
from knitstudy.knit.mesh.mesher import sampled_sections
from knitstudy.knit.models.beam import build as beams_in_contact
from knitstudy.knit.models.spline_yarns import build as spline_yarns

RADIUS = 0.9e-3


@pytest.fixture(scope="module")
def loop(plain_scene):
    return initial_loop(plain_scene)


@pytest.mark.parametrize(("loops", "rows"), [(1, 1), (3, 2), (2, 4)])
def test_crossings_of_a_knit_are_those_of_one_cell_moved(loop, loops, rows):
    crossings = plain_knit(loop, loops, rows).crossings
    unit = loop.in_radii()
    lower, _, windows = windows_of_loop(unit)
    cell = crossings_of_loop(unit, lower, windows, 100)
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
    return line.part(0.0, 4 * np.linalg.norm(step))


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
    actual = of_curves([yarn], RADIUS).crossings
    assert actual.yarn.tolist() == [[0, 0]] * 3
    np.testing.assert_allclose(
        actual.arc_length.sum(axis=1), np.array([1, 3, 5]) / 3 * yarn.length, rtol=1e-6
    )
    assert np.all(np.abs(np.diff(actual.point, axis=1)[:, 0, 2]) > 1.5 * RADIUS)


def test_yarns_that_pass_far_apart_do_not_cross():
    lines = [straight([-0.01, 0, 0], [0.01, 0, 0]), straight([0, -0.01, 4 * RADIUS], [0, 0.01, 4 * RADIUS])]
    assert len(of_curves(lines, RADIUS).crossings) == 0


def test_zones_of_a_knit_lie_where_their_numbers_say(loop):
    knit = plain_knit(loop, 2, 3)
    place = knit.crossings.point.reshape(3, 2, 4, 2, 3)
    middle, centre = place.mean(axis=3), knit.cell[0] * (np.arange(2) + 0.5)[:, None]
    assert (middle[..., [0, 2], 0] < centre).all()
    assert (middle[..., [1, 3], 0] > centre).all()
    assert (middle[..., [2, 3], 1] > middle[..., [0, 1], 1]).all()
    in_front = place[..., 1, 2] > place[..., 0, 2]
    np.testing.assert_array_equal(in_front, np.broadcast_to([False, False, True, True], in_front.shape))


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


def test_a_fabric_comes_back_from_its_dataset(loop):
    for fabric in (
        plain_knit(loop, 2, 3),
        cut_cells(loop, 2, 3),
        endless_cell(loop, 1, 1),
        yarn_pair(RADIUS, 60.0, 9e-3, 0.02),
    ):
        again = fabric_of(fabric_dataset(fabric))
        np.testing.assert_array_equal(again.crossings.point, fabric.crossings.point)
        assert again.specimen == fabric.specimen


def test_rows_too_far_apart_to_cross_are_refused(loop):
    with pytest.raises(GeometryError, match="cross 0 times"):
        plain_knit(replace(loop, course_spacing=10 * loop.course_spacing), 1, 1)


def test_a_file_that_holds_no_fabric_is_refused(loop):
    dataset = fabric_dataset(plain_knit(loop, 1, 1))
    with pytest.raises(DataFileError, match=r"\['curve_points'\] are missing"):
        fabric_of(dataset.drop_vars("curve_points"))


@pytest.fixture(scope="module")
def weave():
    """Three warps and two wefts of a plain weave: sine waves that pass over and under each other."""
    pitch, height = 6e-3, 1.05 * RADIUS
    u = np.arange(16) / 16

    def wave(shift, along, across, sign):
        place = 2 * pitch * (u - 0.25)
        points = np.outer(place, along) + np.outer(np.full(16, shift), across)
        points[:, 2] = sign * height * np.cos(np.pi * place / pitch)
        return Centreline(CatmullRom(points, 2 * pitch * np.array(along)), 2)

    x, y = np.eye(3)[:2]
    warps = [wave(k * pitch, y, x, (-1) ** k) for k in range(3)]
    return of_curves([*warps, *(wave(k * pitch, x, y, -((-1) ** k)) for k in range(2))], RADIUS)


def test_models_take_any_fabric(weave, plain_scene):
    """Wefts of a weave that are pulled: tied solid yarns, and beams that touch with friction."""
    wefts = np.array([3, 4])
    ends = np.array([weave.centrelines[yarn].length for yarn in wefts])[:, None] * [1, 1]
    fabric = replace(weave, grips={"course": (Grip(wefts, 0 * ends), Grip(wefts, ends))})
    scene = plain_scene.vary({"load.strain": 0.01, "solver.increments": 1})
    solid = scene.vary({"fidelity": "spline_yarns", "mesh.spline_degree": 2})
    beams = scene.vary({"fidelity": "beam", "interaction": "isotropic", "contact.tied_edges": "none"})
    solids = solve_load_path(spline_yarns.build(solid, fabric, sampled_sections(fabric)))
    touching = solve_load_path(beams_in_contact.build(beams, fabric))
    assert float(solids["force"][-1]) == pytest.approx(float(touching["force"][-1]), rel=0.1), "of 25 N"
