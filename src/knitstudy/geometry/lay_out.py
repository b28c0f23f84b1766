"""The geometry stage: from a scene to the fabric that it simulates, with a report on the loop's optimisation."""

import numpy as np
import xarray as xr

from knitstudy.errors import GeometryError
from knitstudy.geometry.crossings import metre
from knitstudy.geometry.fabric import plain_knit, yarn_pair
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.redraw import redraw


def lay_out(scene):
    """Lay out the specimen of a scene; the loop of a knit is optimised first.

    Parameters
    ----------
    scene : Scene
        Read are, of a knit, its sections pattern, yarn (diameter) and geometry; of a pair, its section pair
        and the yarn's diameter.

    Returns
    -------
    xarray.Dataset
        ``Fabric.to_dataset()``, of a knit with the initial control points and, for both states
        "before" and "after", the terms of F, length, smallest radius of curvature, deepest penetration, gaps and
        angles.

    Raises
    ------
    GeometryError
        When no valid knit comes out.
    """
    if scene.specimen == "pair":
        pair = scene.pair
        return yarn_pair(scene.yarn.radius, pair.angle, pair.length, pair.clearance).to_dataset()
    pattern = scene.pattern
    try:
        initial, loop, optimum, surveys = redraw(
            initial_loop(scene), pattern.course_ratio, pattern.keep, scene.geometry
        )
    except GeometryError as error:
        raise GeometryError(
            f"yarn.diameter {scene.yarn.diameter:g} m, pattern.clearance {pattern.clearance:g} radii, "
            f"pattern.course_ratio {pattern.course_ratio:g}, pattern.keep {pattern.keep!r}: {error}; or a "
            "pattern.course_ratio nearer to 1, or a smaller pattern.clearance (docs/notes/geometry.md)"
        ) from error
    knit = plain_knit(loop, pattern.loops, pattern.rows)
    return knit.to_dataset().merge(report(initial, optimum, surveys))


def initial_loop(scene):
    """The loop of a scene as it is drawn, before its optimisation: Loop."""
    pattern = scene.pattern
    return Loop(
        np.asarray(pattern.control_points, dtype=float),
        pattern.wale_spacing,
        pattern.course_spacing,
        0.5 * scene.yarn.diameter,
        pattern.clearance,
    )


def report(initial, optimum, surveys):
    """What the optimisation changed: a dataset over the states "before" and "after".

    Parameters
    ----------
    initial : Loop
    optimum : Optimum
    surveys : tuple of two Survey
        Of the loop before and after.

    Returns
    -------
    xarray.Dataset
    """
    terms = list(optimum.after)
    values = [[state[term] for term in terms] for state in (optimum.before, optimum.after)]

    def measured(name, attributes):
        return ("state", [getattr(surveyed, name) for surveyed in surveys], attributes)

    degrees = {"units": "degree", "long_name": "angle to x in the plane"}
    return xr.Dataset(
        {
            "control_points_before": (
                ("point", "xyz"),
                initial.control_points,
                metre("before the optimisation"),
            ),
            "cost": (("state", "term"), values, {"units": "1", "long_name": "terms of F, unweighted, and F"}),
            "loop_length": measured("length", metre("arc length of yarn in a loop")),
            "radius_of_curvature": measured("radius_of_curvature", metre("the smallest one")),
            "penetration": measured("penetration", metre("deepest penetration of two pieces of yarn")),
            "gap": measured("gap", metre("smallest gap of pieces that are not neighbours along a yarn")),
            "other_gap": measured("other_gap", metre("the same, away from the crossings")),
            "crossing_distance": (
                ("state", "cell_zone"),
                [s.distance for s in surveys],
                metre("of centrelines"),
            ),
            "interlock_angle": measured("interlock_angle", degrees),
            "leg_angle": measured("leg_angle", degrees),
            "iterations": ((), optimum.iterations, {"units": "1", "long_name": "of the quasi-Newton method"}),
            "gradient": ((), optimum.gradient, {"units": "1", "long_name": "what remains of F's, relative"}),
        },
        coords={"state": ["before", "after"], "term": terms},
    )
