"""Out-of-plane motion of knits of whole yarns and of cells cut out of a knit (docs/notes/sensitivity.md)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.elevation import draw_elevations, elevation
from knitstudy.figures.renderer import MILLIMETRE
from knitstudy.measures.catalogue import one, solid


@FIGURES.add(
    "fig_cut_rows",
    "Where a knit is cut off: out-of-plane motion, course tension, isotropic friction",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "cut": one("simulation", "inputs-cut-isotropic-course"),
    },
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, cut: xr.Dataset) -> Figure:
    """Draw both at full load, displacements true to scale, coloured on one scale."""
    titles = []
    for name, history in (("whole yarns", dns), ("cells cut out", cut)):
        strain, force = float(history["strain"][-1]), float(history["force"][-1])
        largest = MILLIMETRE * float(np.abs(elevation(history)).max())
        titles.append(f"{name}\n{strain:.2%} strain: {force:.3g} N, largest $|u_z|$ {largest:.3g} mm")
    return draw_elevations([(dns, cut)], [titles], float(geometry["radius"]))
