"""Loops at other course spacings and of other yarns: what stays of the drawn one, and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.geometry.lay_out import initial_loop, lay_out, redraw
from knitstudy.study.configuration import load_scene

POINTS = 16
COARSE = 12
"""Samples a Bezier curve: closest points are refined from them, fewer only cost less."""


@pytest.fixture(scope="module")
def scene():
    return load_scene("sweep-wale-tie-course").replace("geometry.samples", COARSE)


@pytest.fixture(scope="module")
def drawn(scene):
    return initial_loop(scene)


def varied(scene, ratio, keep):
    return scene.vary({"pattern.course_ratio": ratio, "pattern.keep": keep})


def test_drawn_shape_stays_in_the_plane_when_rows_stand_closer(drawn, scene):
    settings = SimpleNamespace(**scene.geometry.model_dump() | {"free": ("z",) * POINTS})
    initial, loop, _, _ = redraw(drawn, 0.9, "shape", settings)
    np.testing.assert_array_equal(initial.control_points, drawn.control_points)
    np.testing.assert_allclose(
        loop.control_points[:, :2], drawn.control_points[:, :2], atol=1e-15
    )  # in radii and back
    assert loop.course_spacing == 0.9 * drawn.course_spacing


def test_loop_that_cannot_be_made_is_named_with_its_keys_and_a_remedy(scene):
    impossible = varied(scene, 1.3, "length")
    named = r"course_ratio 1\.3, pattern\.keep 'length': no wale spacing .*: take a pattern\.course_ratio nearer to 1"
    with pytest.raises(GeometryError, match=named) as refused:
        lay_out(impossible)
    assert "\n" not in str(refused.value)
