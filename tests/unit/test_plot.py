"""Pictures of single results: two histories in one picture, and units on the axes."""

import numpy as np
import synthetic
import xarray as xr
from refusals import refusal

from knitstudy.use.plot import draw


def test_histories_are_drawn_beside_each_other():
    forms = ["external", "internal", "hourglass", "penalty", "friction", "stabilisation"]
    energy = xr.DataArray(np.zeros((3, 6)), dims=("increment", "form"), coords={"form": forms})
    both = [synthetic.history(scene=name).assign(energy=energy) for name in "ab"]
    (axes,) = draw(*both).axes
    assert [line.get_label() for line in axes.get_lines()] == ["a", "b"]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a", "b"]
    assert axes.get_ylabel() == "reaction force (N)"


def test_other_results_are_drawn_alone(knit):
    geometry = synthetic.geometry(knit)
    with refusal("'geometry' cannot be drawn in one picture"):
        draw(geometry, geometry)
