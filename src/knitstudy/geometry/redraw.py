"""From the loop as it is drawn to one at another course spacing: what is held fixed, and the optimisation anew.

The control points are drawn for one course and one wale spacing. Another course spacing or yarn needs another loop, and
what stays of the drawn one is a reading of its own (``pattern.keep``):

- "shape": the points stay where they are drawn; rows only stand closer or wider.
- "wale_spacing": loops stand as far apart as drawn, and are stretched along the wales with the course spacing; what
  yarn they take follows. So a machine does it: needles give the wale spacing, and how deep they draw gives the rest.
- "length": a loop has the yarn that it is drawn with. It is stretched along the wales with the course spacing, and
  across them by as much as keeps that length: the wale spacing follows. So does a knit that is widened or narrowed.
"""

from dataclasses import replace

from scipy.optimize import brentq

from knitstudy.errors import GeometryError
from knitstudy.geometry.optimise import CONTACT_TOLERANCE, optimise
from knitstudy.geometry.survey import check_yarns, survey

LENGTH_TOLERANCE = 1e-4
"""Relative error of the length that is kept."""

MOST_OPTIMISATIONS = 6
"""In the search of the wale spacing that keeps the length; three are usual."""

WIDEST = 2.0
"""Stretch across the wales, and one over the least, among which the drawn length is looked for."""

FIRST_SLOPE = 0.5
"""Relative change of length over that of the width: half of a loop runs across the wales."""


def stretched(loop, across, along):
    """The loop with its points and spacings stretched across and along the wales; heights stay: Loop."""
    points = loop.control_points * [across, along, 1.0]
    spacings = {
        "wale_spacing": across * loop.wale_spacing,
        "course_spacing": along * loop.course_spacing,
    }
    return replace(loop, control_points=points, **spacings)


def redraw(drawn, ratio, keep, settings):
    """Optimise a drawn loop at another course spacing.

    Parameters
    ----------
    drawn : Loop
        At the spacings that it is drawn for, with the radius wanted.
    ratio : float
        Course spacing wanted over the drawn loop's.
    keep : {"shape", "wale_spacing", "length"}
        What stays of the drawn loop.
    settings : object
        Of `optimise`.

    Returns
    -------
    initial, loop : Loop
        Before and after the optimisation.
    optimum : Optimum
    surveys : tuple of two Survey
        Of both.

    Raises
    ------
    GeometryError
        When there is no such loop.
    """
    if keep == "length":
        initial, (loop, optimum) = _at_length(drawn, ratio, settings)
    else:
        rows_apart = replace(drawn, course_spacing=ratio * drawn.course_spacing)
        initial = stretched(drawn, 1.0, ratio) if keep == "wale_spacing" else rows_apart
        loop, optimum = optimise(initial, settings)
    surveys = survey(initial), survey(loop)
    check_yarns(surveys[1], loop, CONTACT_TOLERANCE)
    return initial, loop, optimum, surveys


def _at_length(drawn, ratio, settings):
    """The initial loop whose optimisation has the drawn length, and what that returns: secants on the width."""
    length = drawn.length

    def initial(across):
        return stretched(drawn, across, ratio)

    def excess(loop):
        return loop.length / length - 1

    bounds = 1 / WIDEST, WIDEST
    if excess(initial(bounds[0])) * excess(initial(bounds[1])) >= 0:
        raise GeometryError(
            f"no wale spacing within a factor of {WIDEST:g} of the drawn one keeps the drawn length of "
            f"{length:.4e} m: take a pattern.course_ratio nearer to 1"
        )
    across, slope = brentq(lambda each: excess(initial(each)), *bounds, xtol=1e-6), FIRST_SLOPE
    found = optimise(initial(across), settings)
    error = excess(found[0])
    for _ in range(MOST_OPTIMISATIONS - 1):
        if abs(error) <= LENGTH_TOLERANCE:
            return initial(across), found
        step = -error / slope
        found = optimise(initial(across + step), settings)
        across, change = across + step, excess(found[0]) - error
        slope, error = change / step or FIRST_SLOPE, error + change
    if abs(error) <= LENGTH_TOLERANCE:
        return initial(across), found
    raise GeometryError(
        f"the yarn in a loop misses the drawn length of {length:.4e} m by {error:.1e} of it, allowed is "
        f"{LENGTH_TOLERANCE:g}: take a pattern.course_ratio nearer to 1 or a smaller yarn.diameter"
    )
