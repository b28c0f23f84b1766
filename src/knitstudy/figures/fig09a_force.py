"""Fig. 9a: reaction force against strain with ties, rough contact and isotropic friction."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import Curve, draw_curves
from knitstudy.figures.style import INTERACTIONS, styled
from knitstudy.measures.catalogue import solid


@FIGURES.add(
    "fig09a_force",
    "Fig. 9a: force against strain with ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
    },
)
@styled
def draw(tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset) -> Figure:
    """Draw the forces over strain.

    Parameters
    ----------
    tie, rough, isotropic : Dataset
        Histories of direct simulations (see docs/architecture.md).
    """
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    curves = [
        Curve(INTERACTIONS[name], history["strain"].to_numpy(), history["force"].to_numpy())
        for name, history in histories.items()
    ]
    return draw_curves(curves, "reaction force", "N")
