"""Fig. 8: transverse contraction and out-of-plane motion in course tension, and the interfacial forces behind them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.measures.response import Z, transverse_contraction
from knitstudy.paper.figures.fig15_force_strain import Curve, draw_curves
from knitstudy.paper.figures.fig16_out_of_plane import colour_scale, elevated_yarns, elevation, elevation_bar
from knitstudy.run.catalogue import FIGURES, of_solid
from knitstudy.use.solids import (
    BAR,
    FRONT,
    HALO,
    Picture,
    View,
    bounds,
    draw_rows,
    scale_bar,
    tube,
)
from knitstudy.use.style import (
    ACCENT,
    FAINT,
    INCH,
    INK,
    INTERACTIONS,
    MILLIMETRE,
    PERCENT,
    panel_letter,
    place,
    tint,
)

OBLIQUE = View.orbit(turn=-28, tilt=24)
CURVES = 58.0  # height of (a) and (b) [mm]
LONGEST = 4.0  # length at which the largest force is drawn [mm of the knit]


@FIGURES.add(
    "fig08_out_of_plane",
    "Fig. 8: contraction, out-of-plane motion and interfacial forces",
    results=of_solid("isotropic-course", "geometry", "dns", "contacts"),
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw contraction and motion over strain, and the knit at full load with the forces on lower yarns."""
    radius = float(geometry["radius"])
    scale = colour_scale(elevation(dns))
    start, motion = dns["centreline"].to_numpy(), dns["centreline_displacement"].to_numpy()[-1]
    yarns = [dns["yarn"].to_numpy() == i for i in np.unique(dns["yarn"])]
    before = [tube(start[yarn], radius, tint(FAINT, 0.5), 0.35) for yarn in yarns]
    pale = [tube((start + motion)[yarn], radius, tint(FAINT, 0.35)) for yarn in yarns]
    shown = ((before + elevated_yarns(dns, radius, scale), FRONT), (pale, OBLIQUE))
    pictures = [Picture(surfaces, view, bounds(surfaces, view)) for surfaces, view in shown]
    drawing, panels = draw_rows([pictures], foot=BAR, above=CURVES)
    _draw_curves(drawing, dns)
    panel_letter(panels[0], "c", f"out-of-plane motion at {PERCENT * float(dns['strain'][-1]):.3g} % strain")
    panel_letter(panels[1], "d", "interfacial forces on the lower rows' yarns")
    for axes, (_, view) in zip(panels, shown, strict=True):
        scale_bar(axes, 5, view)
    elevation_bar(drawing, scale, 0.08, 0.36)
    draw_forces(panels[1], contacts, np.ones(contacts.sizes["crossing"]))
    return drawing


def _draw_curves(drawing: Figure, dns: xr.Dataset) -> None:
    """Draw transverse contraction, and the largest displacements to either side of the fabric, over strain."""
    u_z = MILLIMETRE * dns["centreline_displacement"].to_numpy()[..., Z]
    shrunk = [PERCENT * transverse_contraction(dns.isel(increment=slice(k + 1))) for k in range(len(u_z))]
    motions = {"to the front": u_z.max(axis=1), "to the back": -u_z.min(axis=1)}
    quantities = (
        ("transverse contraction", "%", {"middle third": np.array(shrunk)}),
        ("out-of-plane motion", "mm", motions),
    )
    for k, (quantity, unit, values) in enumerate(quantities):
        axes = place(
            drawing, 0.085 + 0.5 * k, INCH * drawing.get_figheight() - CURVES + 12, 0.29, CURVES - 18
        )
        curves = [
            Curve(replace(INTERACTIONS["isotropic"], label=name, marker=mark), dns["strain"].to_numpy(), u_z)
            for (name, u_z), mark in zip(values.items(), "^v", strict=False)
        ]
        draw_curves(axes, curves, quantity, unit)
        panel_letter(axes, "ab"[k])


def draw_forces(axes: Axes, contacts: xr.Dataset, sign: np.ndarray) -> None:
    """Draw forces at the end of the load where yarns touch or are tied, times a sign (K,); none where that is zero."""
    last = contacts.isel(increment=-1)
    force, spot = sign[:, None] * last["force"].to_numpy(), last["contact_centroid"].to_numpy()
    size = np.linalg.norm(force, axis=1)
    acting = (size > 0) & np.isfinite(spot).all(axis=1)
    if not acting.any():
        return
    scale = LONGEST / size[acting].max()
    tied = last["tied"].to_numpy().astype(bool)
    for which, colour, text in ((~tied, ACCENT, "contact with friction"), (tied, INK, "tied")):
        tail = MILLIMETRE * OBLIQUE.project(spot[acting & which])
        arm = scale * OBLIQUE.project(force[acting & which])
        look = {"color": colour, "width": 0.3, "zorder": 6, "path_effects": HALO, "label": text}
        axes.quiver(*tail.T, *arm.T, angles="xy", units="xy", scale_units="xy", scale=1, **look)
    title = f"longest arrow {size[acting].max():.3g} N"
    axes.legend(loc="lower center", bbox_to_anchor=(0.48, -0.03), ncols=2, title=title)
