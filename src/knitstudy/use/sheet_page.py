"""The page of a sheet: the curves of a fabric as a picture above its numbers, notes and files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from io import BytesIO
from itertools import cycle
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
from matplotlib.figure import Figure

from knitstudy.datasets import STRAINS, code_version
from knitstudy.use.measured_curve import force_over_strain, loss_of_cycle
from knitstudy.use.sheet_numbers import BOTH, PRESS
from knitstudy.use.style import INK, PERCENT, SINGLE, YARNS, figure, resolution, styled


def page_of(curves: pd.DataFrame, shown: Mapping[str, Any]) -> str:
    """Return the page as HTML: a picture of the curves of a sheet, and what the template shows by name."""
    picture = BytesIO()
    draw_loads(curves).savefig(picture, format="png", dpi=resolution())
    template = Path(__file__).with_name("sheet.html").read_text(encoding="utf-8")
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(template)
    return page.render(shown, picture=b64encode(picture.getvalue()).decode(), version=code_version())


@styled
def draw_loads(curves: pd.DataFrame) -> Figure:
    """Draw forces per width over strain: cycles in both directions with their loss, both at once, and shear."""
    drawing = figure(2 * SINGLE, 0.85 * SINGLE, layout="constrained")
    one, both, sheared = drawing.subplots(1, 3)
    dashes = cycle(("-", "--", ":", "-."))
    for load, curve in curves[curves["load"] != PRESS].groupby("load", sort=False):
        alone = load in STRAINS
        axes, dash = (sheared if load == "shear" else one, "-") if alone else (both, next(dashes))
        for way in (load,) if alone else STRAINS[:2]:
            forces = force_over_strain(curve, way)
            loss = loss_of_cycle(forces)
            label = f"{way}, loss {PERCENT * loss.share:.0f} %" if loss else way
            label += "" if alone else load.removeprefix(BOTH)
            colour = YARNS[2] if way == "wale" else INK
            axes.plot(PERCENT * forces.index, forces, dash, color=colour, label=label)
    for axes, title in ((one, "one way, free across"), (both, "both ways"), (sheared, "sheared")):
        axes.set(title=title, xlabel="strain (%)")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24))
    one.set_ylabel("force per width (N/m)")
    return drawing
