"""Figs. 8 and 16: out-of-plane displacement along the yarns, contraction, and the interfacial forces behind them."""

from __future__ import annotations

from dataclasses import replace

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import (
    RMS_U_Z,
    Z,
    deformed_centrelines,
    out_of_plane_correlation,
    rms_out_of_plane,
    transverse_contraction,
)
from knitstudy.paper.figures import INTERACTIONS
from knitstudy.paper.figures.fig15_force_strain import Curve, draw_curves
from knitstudy.paper.scene_names import network, of_solid, solid
from knitstudy.run.catalogue import FIGURES, Scenes, StageResults
from knitstudy.use.solids import (
    BAR,
    FRONT,
    HALO,
    Picture,
    Surface,
    View,
    bounds,
    colour_bar,
    draw_rows,
    graded_tube,
    tube,
)
from knitstudy.use.style import (
    ACCENT,
    FAINT,
    INCH,
    INK,
    MILLIMETRE,
    PAPER,
    PERCENT,
    Style,
    panel_letter,
    place,
    tint,
)

THICKNESS = 0.62  # drawn over true diameter of the yarns, so that those behind are seen
SHOWN = ("tie", "isotropic")  # interactions, from above
COLOURS = "RdBu_r"  # diverging: no displacement is pale
LEVELS = 13  # steps of colour, an odd number: the middle one holds zero
CUT = 6.0  # distance of stations along a yarn, over the radius, that says that there is no yarn between them


def _results(direction: str) -> dict[str, StageResults]:
    """Return the results of a direction: both models with ties and with isotropic friction."""
    results = {"geometry": solid("geometry", f"tie-{direction}")}
    for kind in SHOWN:
        results[f"{kind}_dns"] = solid("simulation", f"{kind}-{direction}")
        results[f"{kind}_rom3d"] = network("rom3d", f"{kind}-{direction}")
    return results


@FIGURES.add(
    "fig16_out_of_plane",
    "Fig. 16: out-of-plane displacement along the yarns, course tension",
    results=_results("course"),
)
@FIGURES.add(
    "fig16_wale", "Fig. 16, wale tension: out-of-plane displacement along the yarns", results=_results("wale")
)
def draw_models(
    geometry: xr.Dataset, scenes: Scenes, reference: pd.DataFrame, **models: xr.Dataset
) -> Figure:
    """Draw the deformed yarns of both models at full load, true to scale, on one scale of colours."""
    knit = fabric_of(geometry)
    # One scale for all, so that the larger motion is seen as the larger one.
    scale = colour_scale(np.concatenate([elevation(history) for history in models.values()]))
    rows = []
    titles = []
    for kind in SHOWN:
        histories = models[f"{kind}_dns"], models[f"{kind}_rom3d"]
        rows.append([elevated_yarns(history, knit.radius, scale, THICKNESS) for history in histories])
        titles += _titles(kind, *histories, reference_of(reference, scenes[f"{kind}_dns"]), knit)
    window = bounds([surface for row in rows for surfaces in row for surface in surfaces])
    pictures = [[Picture(surfaces, FRONT, window, 5 * (row is rows[-1])) for surfaces in row] for row in rows]
    drawing, _ = draw_rows(pictures, head=14.5, foot=BAR, titles=titles)
    elevation_bar(drawing, scale, 0.25, 0.5)
    return drawing


def _titles(kind: str, dns: xr.Dataset, rom3d: xr.Dataset, true: Reference, knit: Fabric) -> list[str]:
    """Return model, interaction, largest motion, correlation with the DNS, and amplitude over the reference's.

    The largest motion is given between the crossings of the yarns, and on their cut ends beyond them.
    """
    titles = []
    for label, history, second in (
        ("DNS", dns, f"{PERCENT * float(dns['strain'][-1]):.3g} % strain"),
        ("3D ROM", rom3d, f"correlation {out_of_plane_correlation(rom3d, dns):.2f}"),
    ):
        amplitude = true.ratio(history, RMS_U_Z, rms_out_of_plane(history))
        third = f", amplitude {amplitude}" if amplitude.known else ""
        between = between_crossings(history, knit)
        motion = MILLIMETRE * np.abs(elevation(history))
        inner, ends = (np.max(motion[where], initial=0.0) for where in (between, ~between))
        largest = f"largest $|u_z|$ {inner:#.3g} mm, on cut ends {ends:#.3g} mm"
        titles.append(f"{label}, {INTERACTIONS[kind].label}\n{largest}\n{second}{third}")
    return titles


def between_crossings(history: xr.Dataset, knit: Fabric) -> np.ndarray:
    """Return whether stations (S,) lie between crossings of their piece of yarn, and not on an end beyond them."""
    yarn, s = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    crossings = knit.crossings
    between = np.zeros(len(yarn), dtype=bool)
    for number in np.unique(yarn):
        along = crossings.arc_length[crossings.yarn == number]
        if along.size:
            between |= (yarn == number) & (s >= along.min()) & (s <= along.max())
    return between


# ---- yarns coloured by their out-of-plane displacement ----


def elevation(history: xr.Dataset) -> np.ndarray:
    """Return u_z (S,) at full load along the yarns [m]."""
    return history["centreline_displacement"].to_numpy()[-1, :, Z]


def elevated_yarns(
    history: xr.Dataset, radius: float, scale: ScalarMappable, thickness: float = 1.0
) -> list[Surface]:
    """Return the yarns of a radius [m] at full load, displacements true to scale, drawn as thick as a share of it."""
    place = deformed_centrelines(history)
    colours = np.array([to_hex(colour) for colour in scale.to_rgba(MILLIMETRE * elevation(history))])
    yarn, s = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    ends = (np.diff(yarn) != 0) | (np.diff(s) > CUT * radius)
    surfaces = []
    for piece in np.split(np.arange(len(yarn)), np.flatnonzero(ends) + 1):
        surfaces += graded_tube(place[piece], thickness * radius, colours[piece])
    return surfaces


def colour_scale(u_z: np.ndarray) -> ScalarMappable:
    """Return colours in steps over values of u_z (...,) [m], in mm, as far on either side of zero as u_z needs."""
    largest = MILLIMETRE * float(np.abs(u_z).max()) or 1.0
    step = 10 ** np.floor(np.log10(largest)) / 10
    end = step * np.ceil(largest / step)
    return ScalarMappable(
        BoundaryNorm(np.linspace(-end, end, LEVELS + 1), matplotlib.colormaps[COLOURS].N), COLOURS
    )


def elevation_bar(drawing: Figure, scale: ScalarMappable, left: float, width: float) -> None:
    """Draw the colours of u_z below all panels, from a share of the figure's width on and so wide."""
    bar = colour_bar(drawing, scale, "out-of-plane displacement $u_z$ (mm)", left, width, format="%.3g")
    low, high = scale.get_clim()
    bar.set_ticks(np.linspace(low, high, 5).tolist())


# ---- Fig. 8: contraction, motion and interfacial forces

OBLIQUE = View.orbit(turn=-28, tilt=24)
CURVES = 58.0  # height of (a) and (b) [mm]
LONGEST = 4.0  # length at which the largest force is drawn [mm of the knit]
SMALL = 0.2  # forces below so much of the largest are dots: their arrows would be shorter than their heads


@FIGURES.add(
    "fig08_out_of_plane",
    "Fig. 8: contraction, out-of-plane motion and interfacial forces",
    results=of_solid("isotropic-course", "geometry", "dns", "contacts"),
)
def draw_motion(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw contraction and motion over strain, and the knit at full load with the forces on lower yarns."""
    radius = float(geometry["radius"])
    scale = colour_scale(elevation(dns))
    start = dns["centreline"].to_numpy()
    end = deformed_centrelines(dns)
    yarns = [dns["yarn"].to_numpy() == i for i in np.unique(dns["yarn"])]
    before = [tube(start[yarn], radius, tint(FAINT, 0.5), 0.35) for yarn in yarns]
    pale = [tube(end[yarn], radius, tint(FAINT, 0.35)) for yarn in yarns]
    shown = ((before + elevated_yarns(dns, radius, scale), FRONT), (pale, OBLIQUE))
    pictures = [Picture(surfaces, view, bounds(surfaces, view), 5) for surfaces, view in shown]
    motion_at = f"out-of-plane motion at {PERCENT * float(dns['strain'][-1]):.3g} % strain"
    titles = motion_at, "interfacial forces on the lower rows' yarns"
    drawing, panels = draw_rows([pictures], foot=BAR, above=CURVES, titles=titles, letters="cd")
    _draw_curves(drawing, dns)
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
    force = sign[:, None] * last["force"].to_numpy()
    spot = last["contact_centroid"].to_numpy()
    size = np.linalg.norm(force, axis=1)
    acting = (size > 0) & np.isfinite(spot).all(axis=1)
    if not acting.any():
        return
    least = SMALL * size[acting].max()
    small, acting = acting & (size < least), acting & (size >= least)
    scale = LONGEST / size[acting].max()
    tied = last["tied"].to_numpy().astype(bool)
    for which, colour, text in ((~tied, ACCENT, "contact with friction"), (tied, INK, "tied")):
        tail = MILLIMETRE * OBLIQUE.project(spot[acting & which])
        arm = scale * OBLIQUE.project(force[acting & which])
        look: Style = {"color": colour, "width": 0.3, "zorder": 6, "path_effects": HALO, "label": text}
        axes.quiver(*tail.T, *arm.T, angles="xy", units="xy", scale_units="xy", scale=1, **look)
    if small.any():
        dots: Style = {"color": FAINT, "edgecolor": PAPER, "linewidth": 0.8, "s": 16, "zorder": 6}
        axes.scatter(*(MILLIMETRE * OBLIQUE.project(spot[small])).T, **dots)
    title = (
        f"longest arrow {size[acting].max():.3g} N{f'; dots: less than {least:.2g} N' if small.any() else ''}"
    )
    axes.legend(loc="lower center", bbox_to_anchor=(0.53, -0.03), ncols=2, title=title)
