"""Fig. 8: transverse contraction and out-of-plane motion in course tension, and the interfacial forces behind them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.fig16_out_of_plane import colour_scale, elevated_yarns, elevation, elevation_bar
from knitstudy.figures.picture import BAR, HALO, bounds, draw_rows, scale_bar, tube, write
from knitstudy.figures.renderer import FRONT, MILLIMETRE, Picture, View
from knitstudy.figures.style import ACCENT, FAINT, INK, panel_letter, tint
from knitstudy.measures.catalogue import solid
from knitstudy.measures.response import transverse_contraction

OBLIQUE = View.orbit(turn=-28, tilt=24)
LONGEST = 4.0  # length at which the largest force is drawn [mm of the knit]


@FIGURES.add(
    "fig08_out_of_plane",
    "Fig. 8: contraction, out-of-plane motion and interfacial forces",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
    },
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the knit at full load: displacements true to scale over the undeformed knit, and forces on lower yarns."""
    radius, scale = float(geometry["radius"]), colour_scale(elevation(dns))
    place, motion = dns["centreline"].to_numpy(), dns["centreline_displacement"].to_numpy()[-1]
    yarns = [dns["yarn"].to_numpy() == i for i in np.unique(dns["yarn"])]
    before = [tube(place[yarn], radius, tint(FAINT, 0.5), 0.35) for yarn in yarns]
    pale = [tube((place + motion)[yarn], radius, tint(FAINT, 0.35)) for yarn in yarns]
    shown = ((before + elevated_yarns(dns, radius, scale), FRONT), (pale, OBLIQUE))
    pictures = [Picture(surfaces, view, bounds(surfaces, view)) for surfaces, view in shown]
    drawing, panels = draw_rows([pictures], foot=BAR)
    strain, contraction = float(dns["strain"][-1]), transverse_contraction(dns)
    panel_letter(panels[0], "a", f"{strain:.2%} strain, {contraction:.2%} transverse contraction")
    panel_letter(panels[1], "b", "interfacial forces on the lower rows' yarns")
    for axes, (_, view) in zip(panels, shown, strict=True):
        scale_bar(axes, 5, view)
    elevation_bar(drawing, scale, 0.08, 0.36)
    _draw_forces(panels[1], contacts)
    return drawing


def _draw_forces(axes: Axes, contacts: xr.Dataset) -> None:
    """Draw the force at the end of the load at every crossing that touches or is tied."""
    last = contacts.isel(increment=-1)
    force, place = last["force"].to_numpy(), last["contact_centroid"].to_numpy()
    size = np.linalg.norm(force, axis=1)
    acting = (size > 0) & np.isfinite(place).all(axis=1)
    if not acting.any():
        return
    scale = LONGEST / size[acting].max()
    tied = last["tied"].to_numpy().astype(bool)
    for which, colour, text in ((~tied, ACCENT, "contact with friction"), (tied, INK, "tied")):
        tail = MILLIMETRE * OBLIQUE.project(place[acting & which])
        arm = scale * OBLIQUE.project(force[acting & which])
        look = {"color": colour, "width": 0.006, "zorder": 6, "path_effects": HALO, "label": text}
        axes.quiver(*tail.T, *arm.T, angles="xy", scale_units="xy", scale=1, **look)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2)
    write(axes, (0.5, -0.09), f"longest arrow {size[acting].max():.3g} N", transform=axes.transAxes, va="top")
