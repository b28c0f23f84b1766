"""Fig. 15a: reaction force against strain in course direction with ties, of the three models."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.curves import PERCENT, Curve, name_ends
from knitstudy.figures.style import MODELS, SINGLE, figure, styled
from knitstudy.tables.response import secant_stiffness

WIDTH, HEIGHT = 1.35 * SINGLE, 82.0


@styled
def draw(dns: xr.Dataset, rom3d: xr.Dataset, rom2d: xr.Dataset) -> Figure:
    """Draw force against strain; the legend gives secant stiffnesses over the one of the DNS.

    Parameters
    ----------
    dns, rom3d, rom2d : Dataset
        Histories (see docs/architecture.md).
    """
    histories = {"dns": dns, "rom3d": rom3d, "rom2d": rom2d}
    drawing = figure(WIDTH, HEIGHT)
    axes = drawing.add_axes((0.12, 0.14, 0.76, 0.83))
    for model, history in histories.items():
        ratio = secant_stiffness(history) / secant_stiffness(dns)
        look = MODELS[model]
        text = look.label if model == "dns" else f"{look.label}, {ratio:.2f} times as stiff"
        axes.plot(PERCENT * history["strain"], history["force"], label=text, clip_on=False, **look.line)
    axes.set(xlabel="strain in course direction (%)", ylabel="reaction force (N)")
    axes.set_xlim(0, PERCENT * max(float(history["strain"].max()) for history in histories.values()))
    axes.set_ylim(0, None)
    axes.legend(loc="upper left", handlelength=3.2)
    name_ends(
        axes, [Curve(MODELS[model], each["strain"], each["force"]) for model, each in histories.items()], "N"
    )
    return drawing
