"""Which loops fit: a map over course and wale spacing in diameters of the yarn."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.geometry.fit import NoRoom, Wanted, fitted_loop
from knitstudy.geometry.survey import survey
from knitstudy.study.scene import Scene

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
        _, loop, _ = fitted_loop(Wanted(course, wale, 0.5, clearance), scene.geometry)
    except NoRoom as error:
        return OUTCOMES.index(error.limits[0]), error.share, *4 * (np.nan,)
    measured = survey(loop)
    error = abs(measured.gap / loop.radius / (clearance or np.nan) - 1)
    bend = loop.radius / measured.radius_of_curvature
    return 0, 1.0, measured.length, bend, error, measured.other_gap / loop.radius
