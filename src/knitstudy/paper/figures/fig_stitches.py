"""Knits of several stitches from the front and from the back, with the letters of their repeats."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.run.catalogue import FIGURES, several
from knitstudy.use.solids import FRONT, Picture, View, bounds, draw_rows, scale_bar, yarn_tubes
from knitstudy.use.style import DOUBLE, YARNS, panel_letter

BACK = View((0.0, 0.0, 1.0))
LOOPS, ROWS = 4, 4  # of a picture, at least
STUDIED = "stitches-"  # before the name of the knit


@FIGURES.add(
    "fig_stitches",
    "Knits of several stitches from the front and from the back",
    results={"knits": several("geometry", f"{STUDIED}*-course")},
)
def draw(knits: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the front of every knit above its back."""
    loops = [fabric_of(dataset).loop for dataset in knits.values()]
    pictures = []
    for loop in loops:
        knit = plain_knit(loop, LOOPS + -LOOPS % loop.columns, ROWS + -ROWS % loop.rows)
        tubes = yarn_tubes(knit, [YARNS[yarn % 2] for yarn in range(len(knit.centrelines))])
        pictures.append([Picture(tubes, view, bounds(tubes, view, below=0.6)) for view in (FRONT, BACK)])
    drawing, panels = draw_rows(list(zip(*pictures, strict=True)), DOUBLE)
    for k, (name, loop) in enumerate(zip(knits, loops, strict=True)):
        stitch = name.removeprefix(STUDIED).rpartition("-")[0]
        front, back = panels[k], panels[k + len(loops)]
        panel_letter(front, "abcdefgh"[k], f"{stitch}: {' / '.join(loop.stitches)}, front")
        panel_letter(back, "abcdefgh"[k], "back")
    scale_bar(panels[0], 1)
    return drawing
