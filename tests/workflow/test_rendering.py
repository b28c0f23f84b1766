"""VTK as it is on this machine: what it renders is where the projection says."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from knitstudy.figures import picture
from knitstudy.figures.shapes import sphere
from knitstudy.figures.view import View


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_rendered_sphere_is_round_and_in_its_place(monkeypatch, opacity):
    """A pixel of 0.02 mm on the rim is 3 % of the shadow's area; its centre is found within half a pixel."""
    renderer = picture.Renderer()
    monkeypatch.setattr(picture, "VTK", renderer)
    monkeypatch.delenv(picture.CHOICE, raising=False)
    axes = Figure(figsize=(1, 0.5)).add_axes((0, 0, 1, 1))
    view, centre, radius = View.orbit(30, 20), np.array([1e-3, 2e-3, -1e-3]), 1.2e-3
    picture.show(axes, [sphere(centre, radius, "#0072B2", opacity)], view, (-1, 4, 0.5, 3.5))
    if renderer.failed:
        pytest.skip("VTK cannot render on this machine")
    (image,) = axes.images
    left, right, bottom, top = image.get_extent()
    covered = np.asarray(image.get_array(), dtype=float)[..., 3] > 0.25 * opacity
    rows, columns = covered.shape
    pixel = (right - left) / columns
    assert covered.sum() * pixel**2 == pytest.approx(np.pi * 1.2**2, rel=0.03)
    y, x = (np.nonzero(covered)[i].mean() + 0.5 for i in (0, 1))
    found = [left + x * pixel, top - y * (top - bottom) / rows]
    np.testing.assert_allclose(found, 1e3 * view.project(centre), atol=0.01)
