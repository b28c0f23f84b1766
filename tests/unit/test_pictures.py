"""The parts of pictures of solids: projection, surfaces, the window, the process that renders, the resolution."""

import sys

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.figures import renderer
from knitstudy.figures.renderer import FRONT, Picture, RenderingError, Surface, View
from knitstudy.figures.shapes import rod, sphere, tube
from knitstudy.figures.style import resolution


@pytest.fixture
def ball():
    return sphere(np.zeros(3), 1e-3, "red")


def volume(surface: Surface) -> float:
    """Volume inside a closed surface by the divergence theorem; positive if faces look outward."""
    a, b, c, d = np.moveaxis(surface.points[surface.faces], 1, 0)
    return float(np.sum(np.cross(a, b) * c + np.cross(a, c) * d) / 6)


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


@pytest.mark.parametrize("said", ["30", "fine", "99999"])
def test_resolution_out_of_bounds_is_refused(said, monkeypatch):
    monkeypatch.setenv("KNITSTUDY_DPI", said)
    with pytest.raises(
        ConfigurationError, match=rf"KNITSTUDY_DPI is '{said}': allowed are whole numbers from 50"
    ):
        resolution()


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
