"""How much the optimised loop depends on the weights of Eqs. (1) and (3), which the paper does not print."""

import numpy as np
import pandas as pd

from knitstudy.geometry.lay_out import initial_loop
from knitstudy.geometry.redraw import redraw

WEIGHTS = ("alpha", "beta", "gamma", "beta_0")


def sensitivity(scene, factors=(0.1, 10.0)):
    """Optimise the loop of a scene with each weight in turn multiplied by factors.

    Parameters
    ----------
    scene : Scene
    factors : sequence of float

    Returns
    -------
    pandas.DataFrame
        A row a variant, the scene's own weights first: weight, factor, moved (largest distance, over R, by which
        a control point differs from the first row's), interlock_angle and leg_angle in degrees, lengthening
        (share of the initial length), contact_error and bend (largest |D - 2R - c0| and curvature times R).

    Raises
    ------
    GeometryError
        When a variant has no valid optimum.
    """
    variants = [("none", 1.0)] + [(weight, factor) for weight in WEIGHTS for factor in factors]
    _, reference, _, _ = _redrawn(scene)
    return pd.DataFrame(_row(scene, reference, *variant) for variant in variants)


def _redrawn(scene):
    return redraw(initial_loop(scene), scene.pattern.course_ratio, scene.pattern.keep, scene.geometry)


def _row(scene, reference, weight, factor):
    if weight != "none":
        scene = scene.replace(f"geometry.{weight}", factor * getattr(scene.geometry, weight))
    initial, loop, _, (_, measured) = _redrawn(scene)
    moved = np.linalg.norm(loop.control_points - reference.control_points, axis=1).max()
    return {
        "weight": weight,
        "factor": factor,
        "moved": moved / loop.radius,
        "interlock_angle": measured.interlock_angle,
        "leg_angle": measured.leg_angle,
        "lengthening": measured.length / initial.length - 1,
        "contact_error": np.abs(measured.distance - loop.target).max() / loop.radius,
        "bend": loop.radius / measured.radius_of_curvature,
    }
