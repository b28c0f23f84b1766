"""Claims of the paper under every reading of the paper and other values of inputs: a verdict a cell."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from knitstudy.paper.claims import CONTRADICTED, DIRECTION, NOT_RUN, REPRODUCED, UNDECIDABLE
from knitstudy.paper.claims.verdicts import Finding, under_readings
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.style import DOUBLE, FAINT, INK, PAPER, Style, figure

# Colour and letter of a verdict: colours differ in lightness as well.
VERDICTS = {
    REPRODUCED: ("#A6DBF5", "R"),
    DIRECTION: ("#F2C14E", "D"),
    CONTRADICTED: ("#C1440E", "C"),
    UNDECIDABLE: ("#D9D9D9", "?"),
}
UNTOUCHED = 0.3  # Opacity of cells that a reading does not change
ROW, HEAD, LEFT, LEGEND = 4.2, 62.0, 70.0, 17.0  # Of a row, above, for the readings, for the legend [mm]
LETTERS, LINE = 110, 3.6  # in a line of the text below the matrix; height of a line [mm]

# Claims that cannot be judged under a reading, by the choice or the input that it decides, or by its name.
CANNOT = {
    "friction": ("K7", "K13"),  # they compare several coefficients of friction
    "outer rows": ("K11",),  # it compares knits with and without tied rows
    "global": ("R1", "R2", "R3", "R6", "R7", "R8"),  # springs along z are negative (table2_springs): refused
}
HATCHED: Style = {"facecolor": PAPER, "edgecolor": FAINT, "linewidth": 0.0, "hatch": "//////"}


@FIGURES.add("fig_readings", "Verdicts under every reading of the paper", tables=("findings",))
def draw(claims: pd.DataFrame, readings: pd.DataFrame, findings: pd.DataFrame) -> Figure:
    """Draw readings that decide a claim down, and claims that such a reading decides across; name the others below."""
    base, *others = under_readings(findings, readings)
    run = [finding for finding in others if decided(finding)]
    shown = claims[claims["id"].isin(set().union(*map(decided, run)))]
    found = [base, *run]
    notes = _notes([finding for finding in others if finding not in run], claims, shown)
    foot = LEGEND + LINE * (1 + notes.count("\n"))
    height = HEAD + ROW * len(found) + foot
    drawing = figure(DOUBLE, height)
    axes = drawing.subplots()
    drawing.subplots_adjust(left=LEFT / DOUBLE, right=0.99, bottom=foot / height, top=1 - HEAD / height)
    for row, finding in enumerate(found):
        for column, claim in enumerate(shown["id"]):
            _draw_cell(axes, column, row, finding, claim)
    _label(axes, shown, found)
    drawing.text(0.01, LEGEND / height, notes, va="bottom")
    patches = [
        Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=f"{letter}  {name}")
        for name, (colour, letter) in VERDICTS.items()
    ]
    patches += [
        Patch(facecolor="none", edgecolor=INK, label="not as at the base"),
        Patch(facecolor=VERDICTS[REPRODUCED][0], alpha=UNTOUCHED, label="pale: numbers of the base"),
        Patch(**HATCHED, label="cannot be judged"),
    ]
    drawing.legend(handles=patches, loc="lower center", ncols=3, columnspacing=1.2, bbox_to_anchor=(0.5, 0.0))
    return drawing


def decided(finding: Finding) -> set[str]:
    """Return the claims that a reading touches and decides, or leaves undecidable."""
    return {claim for claim in finding.touched if finding.verdicts[claim] != NOT_RUN}


def cannot_be(finding: Finding, claim: str) -> bool:
    """Whether a claim cannot be judged under a reading, whatever is run."""
    return any(claim in CANNOT.get(key, ()) for key in (finding.reading.name, finding.reading.choice))


def _notes(left_out: Sequence[Finding], claims: pd.DataFrame, shown: pd.DataFrame) -> str:
    """Return in words which readings were not run and which claims no reading decides."""
    ids = [claim for claim in claims["id"] if claim not in set(shown["id"])]
    notes = ["White cells are not run in this study."]
    if left_out:
        names = "; ".join(finding.reading.reading.replace(" ", "\N{NO-BREAK SPACE}") for finding in left_out)
        notes.append(f"Readings without enough simulations in this study to decide a claim: {names}.")
    if ids:
        notes.append(f"Claims that no reading of this study decides by other numbers: {', '.join(ids)}.")
    return "\n".join(fill(note, LETTERS, break_on_hyphens=False) for note in notes)


def _draw_cell(axes: Axes, column: int, row: int, finding: Finding, claim: str) -> None:
    """Draw a verdict; pale where the reading changes none of its numbers, framed where it is decided otherwise."""
    verdict = finding.verdicts[claim]
    if verdict == NOT_RUN:
        if cannot_be(finding, claim):
            axes.add_patch(Rectangle((column, row), 1, 1, **HATCHED))
        return
    colour, letter = VERDICTS[verdict]
    own = claim in finding.touched or not row
    look: Style = {
        "facecolor": colour,
        "edgecolor": PAPER,
        "linewidth": 0.8,
        "alpha": 1 if own else UNTOUCHED,
    }
    axes.add_patch(Rectangle((column, row), 1, 1, **look))
    if own:
        ink = PAPER if verdict == CONTRADICTED else INK
        axes.text(column + 0.5, row + 0.52, letter, ha="center", va="center", color=ink)
    if claim in finding.turned:
        axes.add_patch(Rectangle((column, row), 1, 1, facecolor="none", edgecolor=INK, zorder=3))


def _label(axes: Axes, claims: pd.DataFrame, found: Sequence[Finding]) -> None:
    """Write readings at the rows and claims above the columns; draw a line where inputs begin."""
    axes.set(xlim=(0, max(len(claims), 1)), ylim=(len(found), 0))
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
