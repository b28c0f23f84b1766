"""Fig. 10: how the yarns of the centre cell turn, contract, slide and spin at their crossings, against strain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import (
    DOUBLE,
    FAINT,
    MICROMETRE,
    PERCENT,
    figure,
    panel_letter,
    shared_legend,
    tint,
)
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import centre_cell, closest_neighbour, rotation_angle

LOWER, UPPER = "#0072B2", "#D55E00"

# How crossings are drawn, by zone: right ones lie thin on their wide mirror images.
DOTS = {"linewidth": 1.2, "marker": "o", "markersize": 2.5}
TRIANGLES = {"linewidth": 1.2, "linestyle": "--", "marker": "^", "markersize": 3}
ZONES = (
    ("left lower crossing", {"color": tint(LOWER), "linewidth": 4.0}),
    ("right lower crossing", {"color": LOWER, **DOTS}),
    ("left upper crossing", {"color": tint(UPPER), "linewidth": 4.0}),
    ("right upper crossing", {"color": UPPER, **TRIANGLES}),
)

SIDES = ("yarn of the lower row", "yarn of the upper row")

QUANTITIES: dict[str, Callable[[xr.Dataset], np.ndarray]] = {
    "rotation of\nthe section (°)": lambda contacts: np.degrees(rotation_angle(contacts)),
    "shortening between\ncrossings (%)": lambda contacts: PERCENT * closest_neighbour(contacts),
    "sliding along\nthe yarn (µm)": lambda contacts: MICROMETRE * np.abs(contacts["sliding"].to_numpy()),
    "spin of the contact\nabout the yarn (°)": lambda contacts: np.degrees(contacts["contact_spin"]),
}
"""Values (I, K, 2) of each row of panels, from above to below, by the label of the axis."""


@FIGURES.add(
    "fig10_kinematics",
    "Fig. 10: rotation, contraction, sliding and spin at the crossings of the centre cell",
    results={"contacts": solid("contacts", "isotropic-course")},
)
def draw(contacts: xr.Dataset) -> Figure:
    """Draw the two yarns of the centre cell side by side, the quantities one below the other.

    Raises DataFileError if the contacts hold no kinematics, since their history holds no motion of sections.
    """
    if "section_rotation" not in contacts:
        raise DataFileError(
            "contacts: section_rotation is missing; needed are contacts of a history with section_gradient: run the "
            "direct simulation anew"
        )
    drawing = figure(DOUBLE, 178.0, layout="constrained")
    panels = drawing.subplots(len(QUANTITIES), len(SIDES), sharex=True, sharey="row")
    strain, crossings = PERCENT * contacts["strain"].to_numpy(), centre_cell(contacts)
    for (label, quantity), row in zip(QUANTITIES.items(), panels, strict=True):
        values = np.asarray(quantity(contacts))[:, crossings]
        for side, axes in enumerate(row):
            axes.axhline(0, color=FAINT, linewidth=0.6, zorder=0)
            for (name, look), value in zip(ZONES, values[:, :, side].T, strict=True):
                axes.plot(strain, value, label=name, clip_on=False, **look)
        row[0].set_ylabel(label)
    for axes, letter, title in zip(panels[0], "ab", SIDES, strict=True):
        panel_letter(axes, letter, title)
    for axes in panels[-1]:
        axes.set(xlabel="applied strain (%)", xlim=(0, strain[-1]))
    drawing.align_ylabels(panels[:, 0])
    shared_legend(drawing, loc="outside lower center", ncols=len(ZONES))
    return drawing
