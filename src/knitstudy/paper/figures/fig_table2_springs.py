"""Springs of Table 2 against strain and force of a crossing, in the paper's own contact by mesh and resolved."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.paper.claims import COMPARABLE
from knitstudy.paper.tables.table2_meshes import (
    FACING,
    FORCE,
    HERTZ,
    PAPER,
    RESOLVED,
    SLIP,
    SPRINGS,
    STRAIN,
    WAYS,
)
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.style import (
    ACCENT,
    DOUBLE,
    FAINT,
    INK,
    PERCENT,
    Style,
    figure,
    panel_letter,
    shared_legend,
    tint,
)

KILONEWTON = 1e-3
LOOKS = {
    "0.45 mm": ("#E69F00", "-."),
    "0.30 mm": ("#0072B2", "--"),
    "0.20 mm": ("#009E73", "-"),
    RESOLVED: (INK, "-"),
}
LIMITS = ((3, 700), (3, 700), (20, 15000))  # of k_x, k_y and k_z [kN/m]
# What springs are drawn against, its unit, its label and its limits
CONTROLS = ((STRAIN, PERCENT, "strain (%)", (0, 5)), (FORCE, 1.0, "force of a crossing (N)", (0.05, 25)))


@FIGURES.add(
    "fig_table2_springs", "Table 2: springs of contact by mesh, strain and force", tables=("springs",)
)
def draw(springs: pd.DataFrame) -> Figure:
    """Draw k_x, k_y and k_z with friction, against strain above and force of a crossing below, by tension."""
    springs = springs[springs[FORCE] >= CONTROLS[1][-1][0]]
    drawing = figure(DOUBLE, 205.0, layout="constrained")
    panels = drawing.subplots(4, 3)
    rows = [(control, way) for control in CONTROLS for way in WAYS]
    for row, ((control, unit, label, limits), way) in enumerate(rows):
        for k, axis in enumerate("xyz"):
            axes = panels[row, k]
            _draw_panel(axes, springs[springs["tension"] == way], control, unit, k)
            scale = "log" if control == FORCE else "linear"
            axes.set(xlabel=label, xscale=scale, xlim=limits, yscale="log", ylim=LIMITS[k])
            panel_letter(axes, "abcdefghijkl"[3 * row + k], f"$k_{axis}$, {way} tension")
        panels[row, 0].set_ylabel("spring (kN/m)")
    shared_legend(drawing, loc="outside lower center", ncols=2, handlelength=2.8)
    return drawing


def _draw_panel(axes: Axes, springs: pd.DataFrame, control: str, unit: float, k: int) -> None:
    """Draw the springs of one axis in one tension against a control, the paper's value and Hertz's."""
    lines = [(contact, SLIP, *look) for contact, look in LOOKS.items()]
    if control == STRAIN:
        lines.append((RESOLVED, FACING, INK, ":"))
    for contact, name, colour, dash in lines:
        of = springs[springs["contact"] == contact].sort_values(control)
        kind = contact if contact == RESOLVED else f"penalty alone, {contact}"
        look: Style = {"color": colour, "linestyle": dash, "linewidth": 1.2}
        if len(of):
            axes.plot(unit * of[control], KILONEWTON * of[SPRINGS[name][k]], label=f"{kind}: {name}", **look)
    if control == FORCE and k == 2:
        of = springs[springs["contact"] == RESOLVED].sort_values(control)
        look = {"color": FAINT, "linestyle": (0, (1, 1)), "linewidth": 1.4}
        axes.plot(of[control], KILONEWTON * of[HERTZ], label="Hertz: force over approach", **look)
    for printed in KILONEWTON * springs[PAPER[k]].iloc[:1].to_numpy():
        axes.axhspan(printed / COMPARABLE, printed * COMPARABLE, color=tint(ACCENT, 0.15), zorder=0)
        axes.axhline(printed, color=ACCENT, linewidth=1.0, label=f"Table 2, within {COMPARABLE:g}", zorder=1)
