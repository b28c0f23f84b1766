"""The parts of pictures of solids: projection, surfaces, the window, the process that renders, the resolution."""

import sys

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from knitstudy.errors import ConfigurationError
from knitstudy.figures import picture, renderer, shapes
from knitstudy.figures.renderer import FRONT, Picture, RenderingError, Surface, View
from knitstudy.figures.shapes import arrow, rod, sphere, tube
from knitstudy.figures.style import resolution, save


@pytest.fixture
def axes():
    return Figure(figsize=(2, 1)).add_axes((0, 0, 1, 1))


@pytest.fixture
def ball():
    return sphere(np.zeros(3), 1e-3, "red")


def volume(surface: Surface) -> float:
    """Volume inside a closed surface by the divergence theorem; positive if faces look outward."""
    a, b, c, d = np.moveaxis(surface.points[surface.faces], 1, 0)
    return float(np.sum(np.cross(a, b) * c + np.cross(a, c) * d) / 6)


def test_views_are_rotations():
    np.testing.assert_allclose(FRONT.project([[1.0, 2.0, 3.0]]), [[1.0, 2.0]], atol=1e-15)
    view = View.orbit(turn=90, tilt=0)
    np.testing.assert_allclose(view.basis @ view.basis.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(view.basis[2], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(View.orbit(0, 90 - 1e-9).basis[2], [0, 1, 0], atol=1e-9)


def test_surfaces_are_closed_and_look_outward():
    """Volumes of inscribed bodies: below the exact ones by the sag of 40 facets around, at most 1.5 %."""
    line = np.column_stack([np.linspace(0, 2, 9), np.zeros(9), np.zeros(9)])
    bodies = {
        "tube": (tube(line, 0.5, "red"), np.pi * 0.25 * 2),
        "rod": (rod(np.zeros(3), np.array([0, 0, 2.0]), 0.5, "red"), np.pi * 0.25 * 2),
        "sphere": (sphere(np.array([3.0, 1, 2]), 0.5, "red"), np.pi / 6),
    }
    for name, (surface, exact) in bodies.items():
        assert 0.985 * exact < volume(surface) < exact, name


def test_arrow_ends_at_its_tip():
    points = arrow(np.array([1.0, 0, 0]), np.array([0, 0, 2.0]), 0.05, "red").points
    np.testing.assert_allclose(points[np.argmax(points[:, 2])], [1, 0, 2], atol=1e-12)
    assert points[:, 2].min() == 0


def test_graded_tube_has_all_faces_of_a_tube_once():
    line = np.column_stack([np.linspace(0, 2, 5), np.zeros(5), np.zeros(5)])
    parts = shapes.graded_tube(line, 0.5, ["#ff0000", "#ff0000", "#0000ff", "#ff0000", "#ff0000"])
    assert [part.colour for part in parts] == ["#0000ff", "#ff0000"]
    faces = np.concatenate([part.faces for part in parts])
    whole = tube(line, 0.5, "#ff0000").faces
    np.testing.assert_array_equal(np.unique(faces, axis=0), np.unique(whole, axis=0))
    assert len(faces) == len(whole)
    assert len(parts[0].faces) == shapes.AROUND


def test_window_has_the_shape_of_the_axes(axes, ball, monkeypatch):
    monkeypatch.setattr(renderer, "rendered", lambda picture: np.zeros((*picture.pixels[::-1], 4)))
    picture.show(axes, [ball], FRONT)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert (right - left) / (top - bottom) == pytest.approx(2)
    assert bottom < -1 < 1 < top


@pytest.mark.parametrize("said", ["30", "1e3", "fine", "", "-300", "99999"])
def test_resolution_out_of_bounds_is_refused(said, monkeypatch):
    monkeypatch.setenv("KNITSTUDY_DPI", said)
    with pytest.raises(
        ConfigurationError, match=rf"KNITSTUDY_DPI is '{said}': allowed are whole numbers from 50"
    ):
        resolution()


def test_figures_have_the_resolution_that_is_asked_for(tmp_path, monkeypatch):
    for said, width in (("100", 200), (None, 600)):
        monkeypatch.delenv("KNITSTUDY_DPI", raising=False)
        if said:
            monkeypatch.setenv("KNITSTUDY_DPI", said)
        save(Figure(figsize=(2, 1)), [tmp_path / "a.png"], {}, "a test")
        assert Image.open(tmp_path / "a.png").size == (width, width // 2)


# ---- the process that renders ----


@pytest.fixture
def interpreter(tmp_path, monkeypatch):
    """Function that puts a shell script in the place of the interpreter that VTK is started with."""

    def replace(script):
        path = tmp_path / "python"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(path))

    renderer._process.cache_clear()
    yield replace
    renderer._process.cache_clear()


@pytest.mark.parametrize("script", ["kill -SEGV $$", "exit 1", "cat > /dev/null; echo no picture"])
def test_process_that_ends_does_not_take_this_one_along(ball, interpreter, script):
    """It ends with a segmentation fault, as VTK does where it finds no way to render."""
    interpreter(f"exec </dev/null; {script}")
    with pytest.raises(RenderingError, match="VTK cannot render here: its process ended with status"):
        renderer.rendered(Picture((ball,), FRONT, (-2, 2, -1, 1), (8, 4)))


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_rendered_sphere_is_round_and_in_its_place(opacity):
    """A pixel of 0.02 mm on the rim is 3 % of the shadow's area; its centre is found within half a pixel."""
    view, centre, radius = View.orbit(30, 20), np.array([1e-3, 2e-3, -1e-3]), 1.2e-3
    left, right, bottom, top = window = (-1.5, 4.5, 0.5, 3.5)
    surfaces = (sphere(centre, radius, "#0072B2", opacity),)
    try:
        image = renderer.rendered(Picture(surfaces, view, window, (300, 150)))
    except RenderingError:
        pytest.skip("VTK cannot render on this machine")
    covered = image[..., 3] > 0.25 * opacity * 255
    rows, columns = covered.shape
    pixel = (right - left) / columns
    assert covered.sum() * pixel**2 == pytest.approx(np.pi * 1.2**2, rel=0.03)
    y, x = (np.nonzero(covered)[i].mean() + 0.5 for i in (0, 1))
    found = [left + x * pixel, top - y * (top - bottom) / rows]
    np.testing.assert_allclose(found, 1e3 * view.project(centre), atol=0.01)
