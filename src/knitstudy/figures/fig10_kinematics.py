"""Fig. 10: how the yarns of the centre cell turn, contract, slide and spin at their crossings, against strain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import DOUBLE, FAINT, MICROMETRE, PERCENT, figure, panel_letter, tint
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import centre_cell, closest_neighbour, rotation_angle

HEIGHT = 178.0  # of the figure [mm]
LOWER, UPPER = "#0072B2", "#D55E00"

ZONES = (
    ("left lower crossing", {"color": tint(LOWER), "linewidth": 4.0}),
    ("right lower crossing", {"color": LOWER, "linewidth": 1.2, "marker": "o", "markersize": 2.5}),
    ("left upper crossing", {"color": tint(UPPER), "linewidth": 4.0}),
    (
        "right upper crossing",
        {"color": UPPER, "linewidth": 1.2, "linestyle": "--", "marker": "^", "markersize": 3},
    ),
)
"""How crossings are drawn, by zone: right ones lie thin on their wide mirror images."""

SIDES = ("yarn of the lower row", "yarn of the upper row")


QUANTITIES: dict[str, Callable[[xr.Dataset], np.ndarray]] = {
    "rotation of\nthe section (°)": lambda contacts: np.degrees(rotation_angle(contacts)),
    "shortening between\ncrossings (%)": lambda contacts: PERCENT * closest_neighbour(contacts),
    "sliding along\nthe yarn (µm)": lambda contacts: MICROMETRE * np.abs(contacts["sliding"].to_numpy()),
    "spin of the contact\nabout the yarn (°)": lambda contacts: np.degrees(
        contacts["contact_spin"].to_numpy()
    ),
}
"""Values (I, K, 2) of each row of panels, from above to below, by the label of the axis."""


@FIGURES.add(
    "fig10_kinematics",
    "Fig. 10: rotation, contraction, sliding and spin at the crossings of the centre cell",
    results={"contacts": solid("contacts", "isotropic-course")},
)
def draw(contacts: xr.Dataset) -> Figure:
    """Draw the two yarns of the centre cell side by side, the quantities one below the other.

    Raises
    ------
    DataFileError
        If they hold no kinematics, since their history holds no motion of sections.
    """
    if "section_rotation" not in contacts:
        raise DataFileError(
            "contacts: section_rotation is missing; needed are contacts of a history with section_gradient: run the "
            "direct simulation anew"
        )
    drawing = figure(DOUBLE, HEIGHT)
    panels = drawing.subplots(len(QUANTITIES), len(SIDES), sharex=True, sharey="row")
    drawing.subplots_adjust(left=0.11, right=0.98, bottom=0.115, top=0.965, wspace=0.08, hspace=0.16)
    strain, crossings = PERCENT * contacts["strain"].to_numpy(), centre_cell(contacts)
    for (label, quantity), row in zip(QUANTITIES.items(), panels, strict=True):
        values = quantity(contacts)[:, crossings]
        for side, axes in enumerate(row):
            _draw_side(axes, strain, values[:, :, side])
        row[0].set_ylabel(label)
    drawing.align_ylabels(panels[:, 0])
    for axes, letter, title in zip(panels[0], "ab", SIDES, strict=True):
        panel_letter(axes, letter, title)
    for axes in panels[-1]:
        axes.set(xlabel="applied strain (%)", xlim=(0, strain[-1]))
    drawing.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower center", ncols=len(ZONES))
    return drawing


def _draw_side(axes: Axes, strain: np.ndarray, values: np.ndarray) -> None:
    """Draw one yarn's values (I, 4) over strain (I,) [%]."""
    axes.axhline(0, color=FAINT, linewidth=0.6, zorder=0)
    for (label, look), value in zip(ZONES, values.T, strict=True):
        axes.plot(strain, value, label=label, clip_on=False, **look)
