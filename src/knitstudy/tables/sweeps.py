"""Sweeps of course spacing and yarn diameter (Fig. 11): one row a simulation."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.names import INTERACTIONS
from knitstudy.measures.response import at_strain
from knitstudy.measures.sweeps import DIAMETER, HELD, SPACING, Point, Series, series_of
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

SWEEPS = {SPACING: "course spacing", DIAMETER: "yarn diameter"}

COLUMNS = [
    "swept",
    "held fixed",
    "interaction",
    "made of",
    "scene",
    "course spacing [m]",
    "course spacing over drawn [1]",
    "yarn diameter [m]",
    "width of the knit [m]",
    "strain [1]",
    "largest |u_z| [m]",
    "uncertainty of that [m]",
    "largest |u_z| over diameter [1]",
    "force [N]",
]


@TABLES.add(
    "sweeps",
    "Other course spacings and yarn diameters",
    needs=("sweeps", "scenes", "reference"),
    order=13,
)
def tabulate(
    sweeps: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a simulation of each sweep; what has no known error has no uncertainty.

    Parameters
    ----------
    sweeps : mapping of str to Dataset
        Histories by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [
        _row(key, series, point, sweeps[point.scene.name])
        for key in SWEEPS
        for series in series_of(key, sweeps, scenes, reference)
        for point in series.points
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(key: str, series: Series, point: Point, history: xr.Dataset) -> dict:
    pattern, strain = point.scene.pattern, float(history["strain"][-1])
    values = (
        SWEEPS[key],
        HELD[series.keep],
        INTERACTIONS[series.interaction],
        series.made_of,
        point.scene.name,
        pattern.course_ratio * pattern.course_spacing,
        pattern.course_ratio,
        point.scene.yarn.diameter,
        float(history["displacement"][-1]) / strain,
        strain,
        point.u_z.value,
        point.u_z.uncertainty,
        point.over_diameter.value,
        at_strain(history, strain, history["force"].to_numpy()),
    )
    return dict(zip(COLUMNS, values, strict=True))
