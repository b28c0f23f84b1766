"""Fig. 16: out-of-plane displacement along the yarns, of the DNS and of the 3D reduced model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE, scale_bar, triad
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.elevation import colour_bar, elevated_yarns, elevation, levels
from knitstudy.figures.picture import bounds, show
from knitstudy.figures.style import DOUBLE, figure, panel_letter, styled
from knitstudy.figures.view import FRONT
from knitstudy.measures.catalogue import network, solid
from knitstudy.measures.discretisation import INTERACTIONS, NAMES
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import RMS_U_Z, out_of_plane_correlation, rms_out_of_plane
from knitstudy.study.scene import Scene

FOOT, HEAD = 15.0, 11.0
"""Room for the colour bar below and for two lines of title above each panel [mm]."""

SILL = 3.0
"""Room below the knit for the scale bar [mm of the knit]."""

FIDELITIES = ("dns", "rom3d")

THICKNESS = 0.62
"""Drawn over true diameter of the yarns, so that those behind are seen."""


@FIGURES.add(
    "fig16_out_of_plane",
    "Fig. 16: out-of-plane displacement along the yarns, course tension",
    results={
        "geometry": solid("geometry", "tie-course"),
        "tie_course_dns": solid("simulation", "tie-course"),
        "tie_course_rom3d": network("rom3d", "tie-course"),
        "isotropic_course_dns": solid("simulation", "isotropic-course"),
        "isotropic_course_rom3d": network("rom3d", "isotropic-course"),
    },
    files=("reference",),
    scenes=True,
)
@FIGURES.add(
    "fig16_wale",
    "Fig. 16, wale tension: out-of-plane displacement along the yarns",
    results={
        "geometry": solid("geometry", "tie-wale"),
        "tie_wale_dns": solid("simulation", "tie-wale"),
        "tie_wale_rom3d": network("rom3d", "tie-wale"),
        "isotropic_wale_dns": solid("simulation", "isotropic-wale"),
        "isotropic_wale_rom3d": network("rom3d", "isotropic-wale"),
    },
    files=("reference",),
    scenes=True,
)
@styled
def draw(
    geometry: xr.Dataset, scenes: Mapping[str, Scene], reference: pd.DataFrame, **models: xr.Dataset
) -> Figure:
    """Draw the deformed yarns of both models, coloured on one scale, a row for each interaction.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage, for the yarn's radius.
    scenes : mapping of str to Scene
        Of the histories, by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    **models : Dataset
        Histories by interaction, direction and fidelity, for example ``tie_course_dns`` (see docs/architecture.md).
    """
    radius = float(geometry["radius"])
    cases = list(dict.fromkeys(name.rpartition("_")[0] for name in models))
    histories = [[models[f"{case}_{fidelity}"] for fidelity in FIDELITIES] for case in cases]
    norm = levels(np.concatenate([elevation(history) for row in histories for history in row]))
    surfaces = [[elevated_yarns(history, radius, norm, THICKNESS) for history in row] for row in histories]
    windows = [bounds(found, FRONT) for row in surfaces for found in row]
    low, high = np.min(windows, axis=0), np.max(windows, axis=0)
    window = (low[0], high[1], low[2] - SILL, high[3])
    panel = 0.485 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    height = len(cases) * (panel + HEAD) + FOOT
    drawing = figure(DOUBLE, height)
    letters = iter("abcdefgh")
    for row, (case, found) in enumerate(zip(cases, surfaces, strict=True)):
        bottom = (height - (row + 1) * (panel + HEAD)) / height
        for column, fidelity in enumerate(FIDELITIES):
            axes = drawing.add_axes((0.01 + 0.5 * column, bottom, 0.485, panel / height))
            show(axes, found[column], FRONT, window)
            true = reference_of(reference, scenes[f"{case}_dns"])
            panel_letter(axes, next(letters), _title(case, fidelity, *histories[row], true))
            if row == len(cases) - 1:
                scale_bar(axes, 5, (0.02, 0.0))
                triad(axes, FRONT, 2.5, (0.9, 0.0))
    colour_bar(drawing, norm, (0.25, 0.5), FOOT / height)
    return drawing


def _title(case: str, fidelity: str, dns: xr.Dataset, rom3d: xr.Dataset, true: Reference) -> str:
    """Return model, interaction, largest motion, correlation with the DNS, and amplitude over the reference's."""
    history = dns if fidelity == "dns" else rom3d
    largest = MILLIMETRE * float(np.abs(elevation(history)).max())
    said = f"{NAMES[fidelity]}, {INTERACTIONS[case.split('_')[0]]}: largest $|u_z|$ {largest:.3g} mm"
    amplitude = f"amplitude {true.ratio(history, RMS_U_Z, rms_out_of_plane(history))}"
    if fidelity == "dns":
        return f"{said}\nat {float(dns['strain'][-1]):.2%} strain, {amplitude}"
    return f"{said}\ncorrelation {out_of_plane_correlation(rom3d, dns):.2f}, {amplitude}"
