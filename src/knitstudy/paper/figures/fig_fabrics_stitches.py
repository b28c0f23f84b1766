"""Fabrics of measured yarns, measured and predicted, and knits of several stitches from the front and the back."""

from __future__ import annotations

from itertools import product

from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.paper.tables.fabrics import CELLS, FITTED, measured, predicted
from knitstudy.run.catalogue import FIGURES, Datasets, several
from knitstudy.use.solids import FRONT, Picture, View, bounds, draw_rows, yarn_tubes
from knitstudy.use.style import DOUBLE, INK, YARNS, Style, figure, panel_letter, shared_legend

STITCHES = (FITTED, "garter", "rib", "seed")
MEASURED = (FITTED, "rib")


@FIGURES.add(
    "fig_fabrics",
    "Fabrics of measured yarns between clamps: measured and predicted",
    results={"cells": CELLS},
)
def draw_fabrics(cells: Datasets) -> Figure:
    """Draw a panel for every yarn and direction: measured points with deviations, curves and intervals predicted."""
    table = predicted(cells)
    yarns = list(dict.fromkeys(table["yarn"]))
    drawing = figure(DOUBLE, 0.42 * DOUBLE * len(yarns), layout="constrained")
    panels = drawing.subplots(len(yarns), 2, squeeze=False, sharex="col", sharey=True)
    for axes, (yarn, direction), letter in zip(
        panels.flat, product(yarns, DIRECTIONS), "abcdefgh", strict=False
    ):
        rows = table[(table["yarn"] == yarn) & (table["direction"] == direction)]
        for stitch, colour in zip(STITCHES, (INK, *YARNS), strict=False):
            curve = rows[rows["stitch"] == stitch]
            force = curve["force_per_width_N_mm"]
            axes.plot([0, *curve["strain"]], [0, *force], color=colour, label=f"{stitch}, predicted")
            axes.fill_betweenx(force, curve["lower"], curve["upper"], color=colour, alpha=0.2, lw=0)
            if stitch in MEASURED and len(curve):
                known = measured(stitch, yarn=yarn, direction=direction)
                strain, spread, force = (
                    known[name] for name in ("strain", "strain_sd", "force_per_width_N_mm")
                )
                points: Style = {"fmt": "o", "color": colour, "mfc": "none", "lw": 0.7}
                axes.errorbar(strain, force, xerr=spread, **points, label=f"{stitch}, measured")
        panel_letter(axes, letter, f"{yarn}, {direction}")
        axes.set(ylim=(0, 0.32), xlim=(0, None))
    for axes in panels[-1]:
        axes.set_xlabel("strain between clamps (1)")
    for axes in panels[:, 0]:
        axes.set_ylabel("force per width (N/mm)")
    shared_legend(drawing, loc="outside lower center", ncols=3)
    return drawing


# ---- Stitches

BACK = View((0.0, 0.0, 1.0))
LOOPS, ROWS = 4, 4  # of a picture, at least
STUDIED = "stitches-"  # before the name of the knit


@FIGURES.add(
    "fig_stitches",
    "Knits of several stitches from the front and from the back",
    results={"knits": several("geometry", f"{STUDIED}*-course")},
)
def draw_stitches(knits: Datasets) -> Figure:
    """Draw the front of every knit above its back."""
    loops = [loop for dataset in knits.values() if (loop := fabric_of(dataset).loop)]
    pictures: list[list[Picture]] = []
    for loop in loops:
        knit = plain_knit(loop, LOOPS + -LOOPS % loop.columns, ROWS + -ROWS % loop.rows)
        tubes = yarn_tubes(knit, [YARNS[yarn % 2] for yarn in range(len(knit.centrelines))])
        bar = 0.0 if pictures else 1.0
        pictures.append(
            [
                Picture(tubes, view, bounds(tubes, view, below=0.6), bar * (view is FRONT), directions=False)
                for view in (FRONT, BACK)
            ]
        )
    stitches = (name.removeprefix(STUDIED).rpartition("-")[0] for name in knits)
    titles = [
        f"{name}: {' / '.join(loop.stitches)}, front" for name, loop in zip(stitches, loops, strict=True)
    ]
    letters = 2 * "abcdefgh"[: len(loops)]
    titles += len(loops) * ["back"]
    return draw_rows(list(zip(*pictures, strict=True)), DOUBLE, titles=titles, letters=letters)[0]
