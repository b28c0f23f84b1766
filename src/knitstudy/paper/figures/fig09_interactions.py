"""Fig. 9: force (a) and out-of-plane motion (b) against strain with ties, rough contact and isotropic friction."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.measures.response import out_of_plane
from knitstudy.paper.figures.fig15_force_strain import Curve, draw_curves
from knitstudy.run.catalogue import FIGURES, solid
from knitstudy.use.style import DOUBLE, INTERACTIONS, MILLIMETRE, figure, panel_letter


@FIGURES.add(
    "fig09_interactions",
    "Fig. 9: force and out-of-plane motion with ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
    },
)
def draw(**histories: xr.Dataset) -> Figure:
    """Draw the reaction force, and the largest |u_z| along the centrelines, over strain."""
    drawing = figure(DOUBLE, 70.0)
    quantities = (
        ("reaction force", "N", lambda history: history["force"].to_numpy()),
        ("largest out-of-plane motion $|u_z|$", "mm", lambda history: MILLIMETRE * out_of_plane(history)),
    )
    for k, (quantity, unit, value) in enumerate(quantities):
        axes = drawing.add_axes((0.08 + 0.5 * k, 0.15, 0.27, 0.75))
        curves = [
            Curve(INTERACTIONS[name], history["strain"].to_numpy(), value(history))
            for name, history in histories.items()
        ]
        draw_curves(axes, curves, quantity, unit)
        panel_letter(axes, "ab"[k])
    return drawing
