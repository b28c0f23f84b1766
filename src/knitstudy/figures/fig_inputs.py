"""One input at a time changed: verdicts on claims, and changes of force and out-of-plane motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import DOUBLE, FAINT, INK, INTERACTIONS, PAPER, PERCENT, figure, panel_letter
from knitstudy.measures.catalogue import VARIED, several, solid
from knitstudy.measures.claims.evidence import NOT_REPRODUCED, OPEN, REPRODUCED, Evidence
from knitstudy.measures.claims.verdicts import CLAIMS, INPUTS, WITHOUT_LIMIT, Finding, Variation, findings
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.study.scene import Scene

VERDICTS = {REPRODUCED: ("#56B4E9", "\u2713"), OPEN: ("#E6E6E6", "?"), NOT_REPRODUCED: ("#D55E00", "\u2717")}
"""Colour and sign of a verdict."""

SHORT = {
    "K1": "no contact at 0.05 %",
    "K2": "four zones from 1.95 % on",
    "K3": "force bends at contact",
    "K4": "symmetric bulge, contraction",
    "K5": "force: tie > rough > friction",
    "K6": "|u_z|: friction > tie",
    "K8": "yarns turn, slide and spin",
    "K11": "untied rows slide",
    "E1": "little is dissipated",
}
"""Claims in a few words, for the heads of columns."""

UNITS = {"1": "", "yarn radii": " R"}
ROW, HEAD, FOOT, LEFT = (
    5.0,
    40.0,
    12.0,
    57.0,
)  # height of a row, room above and below the rows and for their names [mm]
SMALL = 6.5  # size of letters in the rows


@FIGURES.add(
    "fig_inputs",
    "What hangs on inputs: one at a time at another value",
    results={
        "variations": several("simulation", *VARIED, fewest=4),
        "variations_contacts": several("contacts", *VARIED, fewest=4),
        "geometry": solid("geometry", "tie-course"),
    },
)
def draw(
    variations: Mapping[str, xr.Dataset],
    variations_contacts: Mapping[str, xr.Dataset],
    geometry: xr.Dataset,
    scenes: Mapping[str, Scene],
    paper: pd.DataFrame,
    reference: pd.DataFrame,
) -> Figure:
    """Draw a row a value: a matrix of verdicts, and beside it bars of the changes of force and of the largest |u_z|."""
    found = findings(Evidence(geometry, paper, reference, scenes, variations, variations_contacts))
    height = HEAD + ROW * len(found) + FOOT
    drawing = figure(DOUBLE, height)
    panels = drawing.subplots(1, 3, sharey=True, width_ratios=(1.9, 1, 1))
    edges = {"left": LEFT / DOUBLE, "bottom": FOOT / height, "top": 1 - HEAD / height, "right": 0.98}
    drawing.subplots_adjust(**edges, wspace=0.15)
    keys = [each.variation.key for each in found]
    for axes in panels:
        axes.spines["left"].set_visible(False)
        for row in range(1, len(found)):
            if keys[row] != keys[row - 1]:  # a line between different inputs
                axes.axhline(row, color=FAINT, linewidth=0.6, zorder=2)
    _draw_verdicts(panels[0], found)
    _draw_changes(panels[1], found, FORCE)
    panel_letter(panels[1], "b", "force")
    _draw_changes(panels[2], found, LARGEST_U_Z)
    panel_letter(panels[2], "c", "largest $|u_z|$")
    # Signs and bars are explained in the upper right corner.
    verdicts = [Patch(facecolor=colour, label=f"{sign} {name}") for name, (colour, sign) in VERDICTS.items()]
    verdicts.append(Patch(facecolor="none", edgecolor=INK, label="not as at the base"))
    bars = [Patch(facecolor=look.colour, label=look.label) for look in INTERACTIONS.values()]
    for handles, right in ((verdicts, 0.84), (bars, 1.0)):
        drawing.legend(handles=handles, loc="upper right", fontsize=SMALL, bbox_to_anchor=(right, 1.0))
    return drawing


def _draw_verdicts(axes: Axes, found: Sequence[Finding]) -> None:
    """Draw a cell for each value and claim, framed where the verdict differs from the base; assumed inputs are bold."""
    claims = [claim for claim in CLAIMS if any(claim in each.judged for each in found)]
    for row, finding in enumerate(found):
        for column, claim in enumerate(claims):
            if claim in finding.judged:
                colour, sign = VERDICTS[finding.judged[claim].verdict]
                look = {"facecolor": colour, "edgecolor": PAPER, "linewidth": 1.2}
                axes.add_patch(Rectangle((column, row), 1, 1, **look))
                axes.text(column + 0.5, row + 0.5, sign, ha="center", va="center", fontsize=SMALL)
            if claim in finding.turned:
                look = {"facecolor": "none", "edgecolor": INK, "linewidth": 1.2, "zorder": 3}
                axes.add_patch(Rectangle((column, row), 1, 1, **look))
    axes.set(xlim=(0, len(claims)), ylim=(len(found), 0))
    heads = [f"{claim}  {SHORT.get(claim, '')}".rstrip() for claim in claims]
    look = {"rotation": 60, "ha": "left", "rotation_mode": "anchor", "fontsize": SMALL}
    axes.set_xticks(np.arange(len(claims)) + 0.5, heads, **look)
    axes.xaxis.tick_top()
    names = [_name(each.variation, found[0].variation) for each in found]
    axes.set_yticks(np.arange(len(found)) + 0.5, names, fontsize=SMALL)
    for label, each in zip(axes.get_yticklabels(), found, strict=True):
        assumed = each.variation.key and each.variation.described.standing == "assumed"
        label.set_fontweight("bold" if assumed else "normal")
    axes.tick_params(length=0)
    axes.spines["bottom"].set_visible(False)
    axes.text(0.0, -0.35, "(a)", ha="right", va="bottom", fontsize=8.5)


def _draw_changes(axes: Axes, found: Sequence[Finding], quantity: str) -> None:
    """Draw a bar an interaction, the first above."""
    thick = 0.8 / len(INTERACTIONS)
    for number, (kind, look) in enumerate(INTERACTIONS.items()):
        changes = [PERCENT * each.changes.get((quantity, kind), np.nan) for each in found]
        axes.barh(np.arange(len(found)) + 0.1 + thick * (number + 0.5), changes, thick, color=look.colour)
    axes.axvline(0, color=INK, linewidth=0.7)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color=FAINT, alpha=0.35, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.set_xlabel("change to the base (%)", fontsize=SMALL)


def _name(variation: Variation, base: Variation) -> str:
    """Return the name of an input and its value, with the base's in brackets."""
    if not variation.key:
        return "base"
    usual = next(
        scene.value(variation.key) for scene in base.scenes.values() if scene.value(variation.key) is not None
    )
    unit = UNITS.get(variation.described.unit, f" {variation.described.unit}")
    return f"{INPUTS[variation.key]} {_said(variation.value)}{unit} ({_said(usual)})"


def _said(value: object) -> str:
    if value == WITHOUT_LIMIT:
        return "\u221e"
    return f"{value:g}" if isinstance(value, float | int) else str(value).replace("_", "-")
