"""Fig. 16: out-of-plane displacement along the yarns, of the DNS and of the 3D reduced model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import RMS_U_Z, Z, out_of_plane_correlation, rms_out_of_plane
from knitstudy.run.catalogue import FIGURES, Results, network, solid
from knitstudy.use.solids import (
    BAR,
    FRONT,
    Picture,
    Surface,
    bounds,
    colour_bar,
    draw_rows,
    graded_tube,
    scale_bar,
)
from knitstudy.use.style import MILLIMETRE, PERCENT, panel_letter

THICKNESS = 0.62  # drawn over true diameter of the yarns, so that those behind are seen
SHOWN = ("tie", "isotropic")  # interactions, from above
COLOURS = "RdBu_r"  # diverging: no displacement is pale
LEVELS = 13  # steps of colour, an odd number: the middle one holds zero
CUT = 6.0  # distance of stations along a yarn, over the radius, that says that there is no yarn between them


def _results(direction: str) -> dict[str, Results]:
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
    "fig16_wale",
    "Fig. 16, wale tension: out-of-plane displacement along the yarns",
    results=_results("wale"),
)
def draw(
    geometry: xr.Dataset, scenes: Mapping[str, Scene], reference: pd.DataFrame, **models: xr.Dataset
) -> Figure:
    """Draw the deformed yarns of both models, a row with a scale of colours for each interaction."""
    rows, titles = [], []
    for kind in SHOWN:
        rows.append((models[f"{kind}_dns"], models[f"{kind}_rom3d"]))
        titles += _titles(kind, *rows[-1], reference_of(reference, scenes[f"{kind}_dns"]))
    return draw_elevations(rows, titles, float(geometry["radius"]), THICKNESS)


def _titles(kind: str, dns: xr.Dataset, rom3d: xr.Dataset, true: Reference) -> list[str]:
    """Return model, interaction, largest motion, correlation with the DNS, and amplitude over the reference's."""
    titles = []
    for label, history, second in (
        ("DNS", dns, f" at {PERCENT * float(dns['strain'][-1]):.3g} % strain"),
        ("3D ROM", rom3d, f", correlation with the DNS {out_of_plane_correlation(rom3d, dns):.2f}"),
    ):
        amplitude = true.ratio(history, RMS_U_Z, rms_out_of_plane(history))
        third = f"\namplitude {amplitude} of the reference's" if amplitude.known else ""
        titles.append(f"{label}, {INTERACTIONS[kind]}\n{_largest(history)}{second}{third}")
    return titles


def _largest(history: xr.Dataset) -> str:
    return f"largest $|u_z|$ {MILLIMETRE * np.abs(elevation(history)).max():#.3g} mm"


# ---- yarns coloured by their out-of-plane displacement ----


def draw_elevations(
    rows: Sequence[Sequence[xr.Dataset]], titles: Sequence[str], radius: float, thickness: float = 1.0
) -> Figure:
    """Return a figure of knits at full load, displacements true to scale, every row coloured on a scale of its own.

    Parameters
    ----------
    rows : sequence of sequences of Dataset
        Two histories a row.
    titles : sequence of str
        Of the panels, row by row.
    radius : float
        Radius of the yarns [m].
    thickness : float
        Drawn over true diameter of the yarns.
    """
    scales = [colour_scale(np.concatenate(list(map(elevation, row)))) for row in rows]
    yarns = [
        [elevated_yarns(history, radius, scale, thickness) for history in row]
        for row, scale in zip(rows, scales, strict=True)
    ]
    window = bounds([surface for row in yarns for surfaces in row for surface in surfaces])
    pictures = [[Picture(surfaces, FRONT, window) for surfaces in row] for row in yarns]
    drawing, panels = draw_rows(pictures, head=14.5, foot=BAR)
    for axes, letter, title in zip(panels, "abcdefgh", titles, strict=False):
        panel_letter(axes, letter, title)
    for axes in panels[-2:]:
        scale_bar(axes, 5, FRONT)
    share = 1 / len(scales)
    for number, (scale, panels_of) in enumerate(zip(scales, ("a, b", "c, d", "e, f", "g, h"), strict=False)):
        elevation_bar(drawing, scale, (number + 0.1) * share, 0.8 * share, f"({panels_of})  ")
    return drawing


def elevation(history: xr.Dataset) -> np.ndarray:
    """Return u_z (S,) at full load along the yarns [m]."""
    return history["centreline_displacement"].to_numpy()[-1, :, Z]


def elevated_yarns(
    history: xr.Dataset, radius: float, scale: ScalarMappable, thickness: float = 1.0
) -> list[Surface]:
    """Return the yarns of a radius [m] at full load, displacements true to scale, drawn as thick as a share of it."""
    place = history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()[-1]
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


def elevation_bar(
    drawing: Figure, scale: ScalarMappable, left: float, width: float, panels: str = ""
) -> None:
    """Draw the colours of u_z below all panels, from a share of the figure's width on and so wide."""
    bar = colour_bar(
        drawing, scale, f"{panels}out-of-plane displacement $u_z$ (mm)", left, width, format="%.3g"
    )
    bar.set_ticks(np.linspace(scale.norm.vmin, scale.norm.vmax, 5))
