"""Which loops fit: a map over course and wale spacing in diameters of the yarn.

``python benchmarks/loops.py`` (`make loops`) keeps the map in resources/loops.csv and draws docs/notes/loops.webp.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from keep import NOTES, save_picture
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fit import InfeasibleLoop, fitted_loop
from knitstudy.knit.geometry.loop import TIGHT, LoopTarget
from knitstudy.knit.geometry.loop_metrics import loop_metrics
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.behaviour import GEOMETRY
from knitstudy.run.committed_tables import keep_table
from knitstudy.run.configuration import load_scene
from knitstudy.use.style import INK, PAPER, SINGLE, figure, shared_legend, styled

KEPT = RESOURCES / "loops.csv"
SCENE = "sweep-wale-tie-course"  # Clearance and weights of the optimisation

COURSES = np.linspace(1.5, 8.0, 14)  # over the diameter
WALES = np.linspace(2.0, 9.0, 15)

OUTCOMES = ("found", "curvature", "row", "rows", "interlock")
"""A loop is found, or its limit is the curvature, yarn of the same row, of other rows, or the interlock itself."""

VARIABLES = {
    "outcome": f"number in the list {', '.join(OUTCOMES)}: whether there is a loop, or its first limit",
    "thickest": "thickest yarn that is found with these spacings over the wanted one",
    "length": "length of yarn in a loop over the diameter",
    "bend": "radius of the yarn over the smallest radius of curvature",
    "gap_error": "error of the smallest gap over the gap that is asked for",
    "other_gap": "smallest gap away from the crossings over the radius",
}


def loop_map(scene: Scene, courses: np.ndarray = COURSES, wales: np.ndarray = WALES) -> xr.Dataset:
    """Return what becomes of the loops of a grid of spacings, with the clearance and the weights of a scene."""
    found = np.array([[_entry(scene, c, w) for w in wales] for c in courses])
    one = {"units": "1"}
    return xr.Dataset(
        {
            name: (("course", "wale"), found[..., k], one | {"long_name": said})
            for k, (name, said) in enumerate(VARIABLES.items())
        },
        coords={"course": courses, "wale": wales},
    )


def _entry(scene: Scene, course: float, wale: float) -> tuple[float, ...]:
    """Return the variables of one loop of a yarn of diameter 1."""
    clearance = scene.pattern.clearance
    try:
        _, loop, _ = fitted_loop(LoopTarget(course, wale, 0.5, clearance), scene.geometry)
    except InfeasibleLoop as error:
        return OUTCOMES.index(error.limits[0]), error.share, *4 * (np.nan,)
    measured = loop_metrics(loop)
    error = abs(measured.gap / loop.radius / (clearance or np.nan) - 1)
    bend = loop.radius / measured.radius_of_curvature
    return 0, 1.0, measured.length, bend, error, measured.other_gap / loop.radius


LIMITS = {
    "curvature": ("yarn bends too tightly", "#D55E00", "x"),
    "row": ("yarns of one row touch", "#009E73", "|"),
    "rows": ("yarns of several rows touch", "#0072B2", "_"),
    "interlock": ("no interlock", "#8C8C8C", "."),
}
"""Label, colour and marker of what limits a loop that does not fit."""


@styled
def draw(feasible: xr.Dataset, scene: Scene) -> Figure:
    """Draw cells for loops that fit, coloured by their curvature, and marks for the others by their limit."""
    wale, course = np.meshgrid(feasible["wale"], feasible["course"])
    outcome = feasible["outcome"].to_numpy().astype(int)
    drawing = figure(1.4 * SINGLE, 1.25 * SINGLE, layout="constrained")
    axes = drawing.subplots()
    bend = np.where(outcome == 0, feasible["bend"], np.nan)
    cells = axes.pcolormesh(feasible["wale"], feasible["course"], bend, cmap="cividis", shading="nearest")
    drawing.colorbar(cells, ax=axes, label="yarn radius over smallest radius of curvature (1)")
    for name, (label, colour, marker) in LIMITS.items():
        lost = outcome == OUTCOMES.index(name)
        if lost.any():
            axes.scatter(wale[lost], course[lost], color=colour, s=18.0, marker=marker, lw=1.0, label=label)
    pattern = scene.pattern
    diameter = scene.yarn.diameter
    paper = pattern.wale_spacing / diameter, pattern.course_spacing / diameter
    look = {"color": INK, "linestyle": "none", "markersize": 6.0, "markerfacecolor": PAPER, "clip_on": False}
    axes.plot(*paper, "D", label="loop of the paper", **look)
    axes.plot(*TIGHT[::-1], "o", label="Peirce's loop, yarns touch", **look)
    axes.set(xlabel="wale spacing over yarn diameter (1)", ylabel="course spacing over yarn diameter (1)")
    shared_legend(drawing, loc="outside lower left", ncols=2)
    return drawing


if __name__ == "__main__":
    scene = load_scene(SCENE)
    found = loop_map(scene)
    table = found.to_dataframe().reset_index()
    table["outcome"] = [OUTCOMES[int(number)] for number in table["outcome"]]
    keep_table(table.round(6), KEPT, "make loops", [GEOMETRY])
    save_picture(draw(found, scene), NOTES / f"{KEPT.stem}.webp", {"feasible": found}, "Loops that fit")
    print(f"{(table['outcome'] == OUTCOMES[0]).sum()} of {len(table)} loops fit: {KEPT}")
