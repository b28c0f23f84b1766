"""How far the 3D network is from solids by its joints, its sections, its springs and the radius of the ties."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from knitstudy.paper.claims import COMPARABLE, GOOD
from knitstudy.paper.scene_names import CASES, INTERACTIONS
from knitstudy.paper.tables.joints import DISTANCE, JOINTS, PRINTED
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.style import DOUBLE, FAINT, INK, PAPER, figure, panel_letter, place

LETTERS = "abcd"
PANEL, HEAD, FOOT, LEGEND = 46.0, 8.0, 12.0, 20.0  # heights [mm]
MARKERS = {"straight": "o", "curved": "s"}
RADIUS, SOLIDS, CLEARANCE = "radius of ties over R [1]", "solids", "clearance over R [1]"
COLOURS = ("#1A1A1A", "#0072B2", "#E69F00", "#009E73", "#CC79A7")
SPREAD = 0.13  # between kinds of solids at one joint


@FIGURES.add("fig_joints", "Joints, sections and springs of the 3D network", tables=("joints",), order=1.7)
def draw(joints: pd.DataFrame) -> Figure:
    """Draw a panel for every case: distances of networks to their solids by joint."""
    cases = [f"{INTERACTIONS[kind]}, {way}" for kind, way in (case.split("-") for case in CASES)]
    cases = [case for case in cases if (joints["case"] == case).any()]
    rows = -(-len(cases) // 2)
    drawing = figure(DOUBLE, rows * (HEAD + PANEL + FOOT) + LEGEND)
    kinds = list(dict.fromkeys(map(_kind, joints.to_dict("records"))))
    for k, case in enumerate(cases):
        row, column = divmod(k, 2)
        bottom = LEGEND + (rows - 1 - row) * (HEAD + PANEL + FOOT) + FOOT
        axes = place(drawing, 0.09 + 0.49 * column, bottom, 0.41, PANEL)
        _draw_case(axes, joints[joints["case"] == case], kinds)
        panel_letter(axes, LETTERS[k], case)
        if not column:
            axes.set_ylabel("L2 distance of the force (1)")
    handles = [
        Line2D([], [], color=COLOURS[k % len(COLOURS)], marker="o", linestyle="", label=kind)
        for k, kind in enumerate(kinds)
    ]
    handles += [
        Line2D([], [], color=INK, marker=marker, linestyle="", label=f"{law} sections")
        for law, marker in MARKERS.items()
    ]
    handles.append(
        Line2D(
            [], [], color=INK, marker="o", markerfacecolor=PAPER, linestyle="", label=f"springs of {PRINTED}"
        )
    )
    title = "solids; r: radius of ties, c: clearance"
    drawing.legend(handles=handles, title=title, loc="lower center", ncols=2)
    return drawing


def _kind(row: dict[str, object]) -> str:
    return f"{row[SOLIDS]}; r {row[RADIUS]:g} R, c {row[CLEARANCE]:g} R"


def _draw_case(axes: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    """Draw a mark for every network; lines where networks count as comparable and as in good agreement."""
    names = list(JOINTS.values())
    for row in table.to_dict("records"):
        kind = kinds.index(_kind(row))
        colour = COLOURS[kind % len(COLOURS)]
        axes.plot(
            names.index(row["joints"]) + SPREAD * (kind - (len(kinds) - 1) / 2),
            row[DISTANCE],
            marker=MARKERS[row["sections"]],
            color=colour,
            markerfacecolor=PAPER if row["springs"] == PRINTED else colour,
            linestyle="",
        )
    right = len(names) - 0.52
    for bar, word, x, side in (
        (COMPARABLE - 1, "comparable", right, "right"),
        (GOOD, "good agreement", -0.48, "left"),
    ):
        axes.axhline(bar, color=FAINT, linewidth=0.8, zorder=0)
        axes.text(x, bar, word, color=FAINT, ha=side, va="bottom")
    axes.set(yscale="log", xlim=(-0.5, len(names) - 0.5), ylim=(0.002, 2.0))
    axes.set_xticks(range(len(names)), names)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("")
