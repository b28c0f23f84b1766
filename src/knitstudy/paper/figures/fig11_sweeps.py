"""Fig. 11: largest out-of-plane motion against course spacing and yarn diameter, by the quantity that is held fixed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.measures.reference import SOLID_YARNS
from knitstudy.paper.claims.sweeps import FEWEST
from knitstudy.paper.columns import rows_of
from knitstudy.paper.figures import INTERACTIONS
from knitstudy.paper.sweeps import ALONG, DIAMETER, HELD, RESULTS, SPACING, Sweep, sweeps_of
from knitstudy.run.catalogue import FIGURES, Datasets, Scenes
from knitstudy.use.style import DOUBLE, FAINT, INK, MILLIMETRE, Style, figure, panel_letter, shared_legend

# Colour and marker of what is held fixed: both rows, ties and friction, have the same marks.
LOOKS = {
    "wale_spacing": (INK, "s"),
    "length": ("#0072B2", "v"),
    "shape": ("#D9740B", "o"),
    ALONG: ("#009E73", "X"),
}
KINDS = ("isotropic", "tie")  # rows of panels, from above
BARS: Style = {"linewidth": 1.2, "elinewidth": 0.6, "capsize": 1.8, "clip_on": False}
CHECKS = {True: "D", False: "^"}  # marker of other discretisations: whether of solid yarns
COLUMNS = {
    SPACING: ("course spacing (mm)", ("wale_spacing", "length", "shape")),
    ALONG: ("spacing along x (mm)", (ALONG,)),
    DIAMETER: ("yarn diameter (mm)", ("wale_spacing", "length", "shape")),
}
"""Label of the axis, and the readings of what is held fixed, by the key that is swept."""
TOO_FEW = 3  # values through which no line is drawn, since it would look like a trend


@FIGURES.add(
    "fig11_sweeps", "Fig. 11: out-of-plane motion against course spacing and yarn diameter", results=RESULTS
)
def draw(drawn: Datasets, sweeps: Datasets, scenes: Scenes, reference: pd.DataFrame) -> Figure:
    """Draw the largest |u_z| at full strain over all three keys, with friction above and with ties below."""
    rows = rows_of(scenes, {**drawn, **sweeps})
    swept = {key: sweeps_of(key, rows, reference) for key in COLUMNS}
    spacing = MILLIMETRE * next(iter(rows.values())).scene.value("pattern.course_spacing")
    drawing = figure(DOUBLE, 128.0, layout="constrained")
    panels = drawing.subplots(2, 3, sharex="col", sharey="row", width_ratios=(1.25, 0.8, 1.25))
    for k, (key, (label, readings)) in enumerate(COLUMNS.items()):
        unit = spacing if key == SPACING else MILLIMETRE
        for row, (kind, axes) in enumerate(zip(KINDS, panels[:, k], strict=True)):
            # Along x, the drawn shape is stretched.
            here = [
                replace(sweep, keep=ALONG) if key == ALONG else sweep
                for sweep in swept[key]
                if sweep.interaction == kind
            ]
            for sweep in here:
                _draw_series(axes, sweep, unit)
            panel_letter(axes, "abcdef"[3 * row + k], INTERACTIONS[kind].label)
            _say_what_lacks(axes, here, readings)
        panels[1, k].set_xlabel(label)
        if not swept[key]:
            panels[1, k].set_xticks([])
    for axes in panels[:, 0]:  # limits of a row hold for all that it shows
        axes.set(ylim=(0, None), ylabel="largest out-of-plane motion (mm)")
    shared_legend(drawing, loc="outside lower left", ncols=3, handlelength=2.5)
    return drawing


def _draw_series(axes: Axes, series: Sweep, unit: float) -> None:
    """Draw the motions of a sweep over its values, in a unit; no line through fewer than three values."""
    motions = [point.u_z.of(lambda value: MILLIMETRE * value) for point in series.points]
    colour, marker = LOOKS[series.keep]
    look: Style = {"color": colour, "linestyle": "none", **BARS}
    if series.main:
        look |= {"linestyle": "-" if len(motions) >= TOO_FEW else "none", "marker": marker, "markersize": 4.0}
        look["label"] = HELD[series.keep]
    else:
        marker = CHECKS[series.made_of.startswith(SOLID_YARNS)]
        look |= {"marker": marker, "markersize": 5.0, "markerfacecolor": "none", "label": series.made_of}
    off = np.nan_to_num([motion.uncertainty for motion in motions])
    axes.errorbar(
        [unit * point.value for point in series.points], [motion.value for motion in motions], off, **look
    )


def _say_what_lacks(axes: Axes, series: Sequence[Sweep], readings: Sequence[str]) -> None:
    """Write which readings have too few values for a trend (`FEWEST` of claims K9 and K10), and which none."""
    points = {sweep.keep: len(sweep.points) for sweep in series if sweep.main}
    lacking = {
        HELD[keep]: f"{points[keep]} of {FEWEST} values" if keep in points else "not run"
        for keep in readings
        if points.get(keep, 0) < FEWEST
    }
    text = "\n".join(f"{name}: {what}" if len(readings) > 1 else what for name, what in lacking.items())
    axes.text(0.04, 0.04, text, transform=axes.transAxes, va="bottom", color=FAINT, zorder=0)
