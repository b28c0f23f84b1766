"""Symmetries of a loop and the motions that keep them."""

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.geometry.loop import symmetric_motions, symmetries
from knitstudy.geometry.spline import CatmullRom

WALE = 12.0


def plain_points(count=16):
    t = 2 * np.pi * np.arange(count) / count
    return np.column_stack([WALE * t / (2 * np.pi) + 2.5 * np.sin(2 * t), -7 * np.cos(t), -np.cos(2 * t)])


def group_of(points):
    return symmetries(CatmullRom(points, [WALE, 0, 0]))


def test_plain_loop_has_mirror_and_half_turn():
    assert len(group_of(plain_points())) == 2


def test_higher_head_leaves_the_mirror_only():
    points = plain_points()
    points[8, 1] += 0.1
    assert len(group_of(points)) == 1


def test_loop_without_mirror_is_refused():
    points = plain_points()
    points[3, 0] += 0.1
    with pytest.raises(GeometryError, match=r"pattern\.control_points.*mirror"):
        group_of(points)


@pytest.mark.parametrize(("turned", "count"), [(True, 5), (False, 9)])
def test_one_motion_for_every_orbit_of_points(turned, count):
    points = plain_points()
    points[8, 1] += 0.0 if turned else 0.1
    free = np.tile([False, False, True], (16, 1))
    assert symmetric_motions(free, group_of(points)).shape == (16, 3, count)


def test_motions_are_independent_and_span_all_that_is_symmetric():
    motions = symmetric_motions(np.ones((16, 3), dtype=bool), group_of(plain_points()))
    # Sinker's y and z, x y z of three points, the leg's z: the rest is fixed by symmetry.
    assert np.linalg.matrix_rank(motions.reshape(48, -1)) == motions.shape[-1] == 12


def test_point_without_its_image_is_refused():
    free = np.zeros((16, 3), dtype=bool)
    free[2, 2] = True
    with pytest.raises(GeometryError, match=r"geometry\.free"):
        symmetric_motions(free, group_of(plain_points()))


def test_component_that_symmetry_holds_is_no_motion():
    free = np.zeros((16, 3), dtype=bool)
    free[[0, 8], 0] = True  # sinker and head cannot move along x
    with pytest.raises(GeometryError, match="no component"):
        symmetric_motions(free, group_of(plain_points()))
