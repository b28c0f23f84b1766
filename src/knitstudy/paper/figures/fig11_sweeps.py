"""Fig. 11: largest out-of-plane motion against course spacing and yarn diameter, by the quantity that is held fixed."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.measures.reference import SOLID_YARNS
from knitstudy.paper.columns import rows_of
from knitstudy.paper.figures import INTERACTIONS
from knitstudy.paper.sweeps import DIAMETER, HELD, RESULTS, SPACING, Sweep, sweeps_of
from knitstudy.run.catalogue import FIGURES, Datasets, Scenes
from knitstudy.use.style import DOUBLE, INK, MILLIMETRE, Style, figure, panel_letter, shared_legend

COLOURS = {"wale_spacing": INK, "length": "#0072B2", "shape": "#D9740B"}  # by the quantity that is held fixed
LOOKS = {"isotropic": ("-", "o"), "tie": ("--", "s")}  # dash and marker by interaction, a row each
BARS: Style = {"linewidth": 1.2, "elinewidth": 0.6, "capsize": 1.8, "clip_on": False}
CHECKS = {True: "D", False: "^"}  # marker of other discretisations: whether of solid yarns


@FIGURES.add(
    "fig11_sweeps", "Fig. 11: out-of-plane motion against course spacing and yarn diameter", results=RESULTS
)
def draw(drawn: Datasets, sweeps: Datasets, scenes: Scenes, reference: pd.DataFrame) -> Figure:
    """Draw the largest |u_z| at full strain over both, with friction above and with ties below."""
    spacings, diameters = (
        sweeps_of(key, rows_of(scenes, {**drawn, **sweeps}), reference) for key in (SPACING, DIAMETER)
    )
    spacing = MILLIMETRE * spacings[0].points[0].scene.value("pattern.course_spacing")
    columns = (("course spacing (mm)", spacings, spacing), ("yarn diameter (mm)", diameters, MILLIMETRE))
    drawing = figure(DOUBLE, 125.0, layout="constrained")
    panels = drawing.subplots(2, 2, sharex="col", sharey="row")
    for k, (label, series, unit) in enumerate(columns):
        for row, (kind, axes) in enumerate(zip(LOOKS, panels[:, k], strict=True)):
            for sweep in series:
                if sweep.interaction == kind:
                    _draw_series(axes, sweep, unit)
            panel_letter(axes, "abcd"[2 * row + k], INTERACTIONS[kind].label)
        panels[1, k].set_xlabel(label)
    for axes in panels[:, 0]:  # limits of a row hold for all that it shows
        axes.set(ylim=(0, None), ylabel="largest out-of-plane motion (mm)")
    shared_legend(drawing, loc="outside lower left", ncols=3, handlelength=2.5)
    return drawing


def _draw_series(axes: Axes, series: Sweep, unit: float) -> None:
    """Draw the motions of a sweep over its values, in a unit."""
    motions = [point.u_z.of(lambda value: MILLIMETRE * value) for point in series.points]
    dash, marker = LOOKS[series.interaction]
    look: Style = {"color": COLOURS[series.keep], **BARS}
    if series.main:
        look |= {"linestyle": dash, "marker": marker, "markersize": 3.5}
        look["label"] = HELD[series.keep]
    else:
        marker = CHECKS[series.made_of.startswith(SOLID_YARNS)]
        look |= {"linestyle": "none", "marker": marker, "markersize": 5.0, "markerfacecolor": "none"}
        look["label"] = series.made_of
    off = np.nan_to_num([motion.uncertainty for motion in motions])
    axes.errorbar(
        [unit * point.value for point in series.points], [motion.value for motion in motions], off, **look
    )
