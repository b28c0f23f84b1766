"""Fig. 11a: largest out-of-plane motion against course spacing, by what is held fixed."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import styled
from knitstudy.figures.sweep import draw_sweep
from knitstudy.measures.catalogue import DRAWN, of_case, several
from knitstudy.measures.sweeps import SPACING, refused, sweeps_of
from knitstudy.study.scene import Scene


@FIGURES.add(
    "fig11a_course_spacing",
    "Fig. 11a: out-of-plane motion against course spacing",
    results={
        "drawn": several("simulation", *of_case("tie-course", DRAWN), *of_case("isotropic-course", DRAWN)),
        "sweeps": several("simulation", "sweep-*"),
    },
    files=("reference", "loops"),
    scenes=True,
)
@styled
def draw(
    drawn: Mapping[str, xr.Dataset],
    sweeps: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    loops: pd.DataFrame,
) -> Figure:
    """Draw the largest |u_z| at full strain over the course spacing.

    Parameters
    ----------
    drawn, sweeps : mapping of str to Dataset
        Histories by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference, loops : DataFrame
        ``resources/reference/reference.csv`` and ``loops.csv``.
    """
    series = sweeps_of(SPACING, drawn | sweeps, scenes, reference)
    spacing = MILLIMETRE * series[0].points[0].scene.pattern.course_spacing
    lost = refused(loops, "course ratio [1]", spacing)
    return draw_sweep(series, lost, "course spacing (mm)", lambda point: spacing * point.value)
