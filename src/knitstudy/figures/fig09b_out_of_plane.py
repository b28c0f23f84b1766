"""Fig. 9b: largest out-of-plane motion against strain with ties, rough contact and isotropic friction."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import Curve, draw_curves
from knitstudy.figures.style import INTERACTIONS, styled
from knitstudy.measures.catalogue import solid
from knitstudy.measures.response import out_of_plane


@FIGURES.add(
    "fig09b_out_of_plane",
    "Fig. 9b: out-of-plane motion with ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
    },
)
@styled
def draw(tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset) -> Figure:
    """Draw the largest |u_z| along the centrelines over strain.

    Parameters
    ----------
    tie, rough, isotropic : Dataset
        Histories of direct simulations (see docs/architecture.md).
    """
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    curves = [
        Curve(INTERACTIONS[name], history["strain"].to_numpy(), MILLIMETRE * out_of_plane(history))
        for name, history in histories.items()
    ]
    return draw_curves(curves, "largest out-of-plane motion $|u_z|$", "mm")
