"""The parts of three-dimensional pictures: projection, surfaces, and what happens where VTK cannot render."""

import logging
import subprocess

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from knitstudy.errors import ConfigurationError
from knitstudy.figures import picture, renderer
from knitstudy.figures.shapes import arrow, rod, sphere, tube
from knitstudy.figures.style import resolution, save
from knitstudy.figures.surface import Surface
from knitstudy.figures.view import FRONT, View


@pytest.fixture
def axes():
    return Figure(figsize=(2, 1)).add_axes((0, 0, 1, 1))


@pytest.fixture
def vtk(monkeypatch):
    """VTK as if nothing had been tried yet."""
    fresh = picture.Renderer()
    monkeypatch.setattr(picture, "VTK", fresh)
    monkeypatch.delenv(picture.CHOICE, raising=False)
    return fresh


def volume(surface: Surface) -> float:
    """Volume inside a closed surface by the divergence theorem; positive if faces look outward."""
    a, b, c, d = np.moveaxis(surface.points[surface.faces], 1, 0)
    return float(np.sum(np.cross(a, b) * c + np.cross(a, c) * d) / 6)


def test_front_view_keeps_x_and_y():
    np.testing.assert_allclose(FRONT.project([[1.0, 2.0, 3.0]]), [[1.0, 2.0]], atol=1e-15)
    assert FRONT.nearness(np.array([0.0, 0.0, 1.0])) > 0


def test_orbit_is_a_rotation_and_shows_the_right_side():
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


def test_window_has_the_shape_of_the_axes(axes, monkeypatch):
    monkeypatch.setenv(picture.CHOICE, "matplotlib")
    picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert (right - left) / (top - bottom) == pytest.approx(2)
    assert bottom < -1 < 1 < top


def test_only_faces_to_the_eye_are_painted_and_the_nearest_last(axes, monkeypatch):
    monkeypatch.setenv(picture.CHOICE, "matplotlib")
    balls = [sphere(np.array([0, 0, z]), 1e-3, colour) for z, colour in ((0.01, "#00ff00"), (0.0, "#ff0000"))]
    picture.show(axes, balls, FRONT)
    (painted,) = axes.collections
    colour = painted.get_facecolor()
    assert len(colour) < 0.6 * sum(len(ball.faces) for ball in balls)
    assert colour[-1, 1] > 0
    assert colour[0, 0] > 0
    assert colour[0, 1] == 0


def test_unknown_renderer_is_refused(axes, monkeypatch):
    monkeypatch.setenv(picture.CHOICE, "opengl")
    with pytest.raises(ConfigurationError, match="KNITSTUDY_RENDERER is 'opengl': allowed are 'vtk'"):
        picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)


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


@pytest.mark.parametrize(
    "failure",
    [
        subprocess.CalledProcessError(-11, "vtk", stderr="bad X server connection\n"),
        subprocess.TimeoutExpired("vtk", 300),
        OSError("no such interpreter"),
    ],
    ids=["crash", "hang", "missing"],
)
def test_failing_renderer_is_replaced_with_a_note(axes, monkeypatch, caplog, vtk, failure):
    calls = []

    def fail(*arguments, **options):
        calls.append(arguments)
        raise failure

    monkeypatch.setattr(renderer.subprocess, "Popen", fail)
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    assert len(calls) == 1  # given up after the first
    assert "drawn by matplotlib" in caplog.text
    assert [text.get_text() for text in axes.figure.texts] == ["drawn without a 3D renderer"]
    assert picture.is_fallback(axes.figure)


@pytest.fixture
def interpreter(tmp_path, monkeypatch):
    """Function that puts a shell script in the place of the interpreter that VTK is started with."""

    def replace(script):
        path = tmp_path / "python"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setattr(renderer.sys, "executable", str(path))

    return replace


def test_process_that_dies_does_not_take_this_one_along(axes, interpreter, vtk, caplog):
    """It ends with a segmentation fault, as VTK does without a display."""
    interpreter("echo no display >&2; kill -SEGV $$")
    picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    assert picture.is_fallback(axes.figure)
    assert "ended with status -11 no display" in caplog.text or "Broken pipe no display" in caplog.text


def test_process_that_takes_too_long_is_ended(axes, interpreter, vtk, monkeypatch):
    monkeypatch.setattr(renderer, "PATIENCE", 0.1)
    interpreter("exec sleep 60")
    picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    assert picture.is_fallback(axes.figure)


def test_one_process_renders_all_pictures(axes, interpreter, vtk, tmp_path):
    Image.new("RGBA", (4, 2), "red").save(tmp_path / "red.png")
    interpreter(
        f"echo started >> '{tmp_path}/log'\n"
        f"while read -r job picture; do cp '{tmp_path}/red.png' \"$picture\"; echo done; done"
    )
    for _ in range(2):
        picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    assert len(axes.images) == 2
    assert (tmp_path / "log").read_text() == "started\n"


def test_empty_picture_counts_as_failure(axes, monkeypatch, vtk):
    monkeypatch.setattr(vtk, "_picture", lambda job: np.zeros((*job.pixels[::-1], 4)))
    picture.show(axes, [sphere(np.zeros(3), 1e-3, "red")], FRONT)
    assert vtk.failed
    assert picture.is_fallback(axes.figure)
