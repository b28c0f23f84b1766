"""Claims of the paper under every reading of the paper and other values of inputs: a verdict a cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from knitstudy.paper.claims import CONTRADICTED, DIRECTION, NOT_RUN, REPRODUCED, UNDECIDABLE
from knitstudy.paper.claims.verdicts import Finding, under_readings
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.style import DOUBLE, INK, PAPER, figure

# Colour and letter of a verdict: colours differ in lightness as well.
VERDICTS = {
    REPRODUCED: ("#A6DBF5", "R"),
    DIRECTION: ("#F2C14E", "D"),
    CONTRADICTED: ("#C1440E", "C"),
    UNDECIDABLE: ("#D9D9D9", "?"),
    NOT_RUN: (PAPER, "\u2013"),
}
UNTOUCHED = 0.3  # Opacity of cells that a reading does not change
ROW, HEAD, FOOT, LEFT = 4.2, 58.0, 18.0, 70.0  # Height of a row, room above, below and for the readings [mm]


@FIGURES.add("fig_readings", "Verdicts under every reading of the paper", tables=("findings",))
def draw(claims: pd.DataFrame, readings: pd.DataFrame, findings: pd.DataFrame) -> Figure:
    """Draw readings down and claims across."""
    found = under_readings(findings, readings)
    height = HEAD + ROW * len(found) + FOOT
    drawing = figure(DOUBLE, height)
    axes = drawing.subplots()
    drawing.subplots_adjust(left=LEFT / DOUBLE, right=0.99, bottom=FOOT / height, top=1 - HEAD / height)
    for row, finding in enumerate(found):
        for column, claim in enumerate(claims["id"]):
            _draw_cell(axes, column, row, finding, claim)
    _label(axes, claims, found)
    patches = [
        Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=f"{letter}  {name}")
        for name, (colour, letter) in VERDICTS.items()
    ]
    patches.append(Patch(facecolor="none", edgecolor=INK, label="decided otherwise than at the base"))
    patches.append(
        Patch(facecolor=VERDICTS[REPRODUCED][0], alpha=UNTOUCHED, label="pale: numbers of the base")
    )
    drawing.legend(handles=patches, loc="lower center", ncols=3, bbox_to_anchor=(0.5, 0.0))
    return drawing


def _draw_cell(axes: Axes, column: int, row: int, finding: Finding, claim: str) -> None:
    """Draw a verdict; pale where the reading changes none of its numbers, framed where it is decided otherwise."""
    colour, letter = VERDICTS[finding.verdicts[claim]]
    own = claim in finding.touched or not row
    opacity = 1 if own else UNTOUCHED
    axes.add_patch(
        Rectangle((column, row), 1, 1, facecolor=colour, edgecolor=PAPER, linewidth=0.8, alpha=opacity)
    )
    if own:
        ink = PAPER if finding.verdicts[claim] == CONTRADICTED else INK
        axes.text(column + 0.5, row + 0.52, letter, ha="center", va="center", color=ink)
    if claim in finding.turned:
        axes.add_patch(Rectangle((column, row), 1, 1, facecolor="none", edgecolor=INK, zorder=3))


def _label(axes: Axes, claims: pd.DataFrame, found: Sequence[Finding]) -> None:
    """Write readings at the rows and claims above the columns; draw a line where inputs begin."""
    axes.set(xlim=(0, len(claims)), ylim=(len(found), 0))
    names = [f"{claim.id}  {claim.short}" for claim in claims.itertuples()]
    axes.set_xticks(np.arange(len(claims)) + 0.5, names, rotation=90)
    axes.xaxis.tick_top()
    axes.set_yticks(np.arange(len(found)) + 0.5, [row.reading.reading for row in found])
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    kinds = [row.reading.kind for row in found]
    for row in (1, *(i for i in range(1, len(kinds)) if kinds[i] != kinds[i - 1])):
        axes.axhline(row, color=INK, linewidth=0.8, zorder=2)
