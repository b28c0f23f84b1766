"""What a loop is like: lengths, gaps, curvature and the angles of the honeycomb that its contact points
span."""

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.geometry.yarn_spacing import (
    approaches,
    closest_approach,
    crossings_in_plane,
    smallest_radius_of_curvature,
    windows,
)

SAMPLES = 100
"""Samples a Bezier segment in the search of closest points, as in section 2.1 of the paper."""


@dataclass(frozen=True)
class Survey:
    """Measures of one loop in its knit.

    Attributes
    ----------
    length : float
        Arc length of yarn. [m]
    radius_of_curvature : float
        The smallest one. [m]
    distance : ndarray (4,)
        Shortest distance of the centrelines at each crossing. [m]
    gap : float
        Smallest gap between any pieces of yarn that are not neighbours along one yarn; negative where yarns
        penetrate each other. [m]
    other_gap : float
        The same without the closest points of the crossings. [m]
    interlock_angle, leg_angle : float
        Angle to x, in the plane, of the segment between the two contact points of one side of an interlock,
        and of the leg between two interlocks (Table 4 prints 66 and 80). [deg]
    """

    length: float
    radius_of_curvature: float
    distance: np.ndarray
    gap: float
    other_gap: float
    interlock_angle: float
    leg_angle: float

    @property
    def penetration(self):
        """Deepest penetration of two yarns, zero if there is none. [m]"""
        return max(0.0, -self.gap)


def survey(loop, samples=SAMPLES):
    """Measure a loop.

    Parameters
    ----------
    loop : Loop
    samples : int
        Samples a Bezier segment in the search of the crossings' closest points.

    Returns
    -------
    Survey
    """
    unit = loop.in_radii()
    curve, rise = unit.curve, unit.course_spacing
    found = closest_approach(curve, rise, windows(crossings_in_plane(curve, rise), curve.period), samples)
    near = approaches(unit)
    others = near.without(found.parameter)
    interlock, leg = honeycomb_angles(found.point.mean(axis=1), rise)
    shortest = min(found.distance.min(), near.distance.min(initial=np.inf))
    return Survey(
        length=unit.length * loop.radius,
        radius_of_curvature=smallest_radius_of_curvature(curve) * loop.radius,
        distance=found.distance * loop.radius,
        gap=float(shortest - 2) * loop.radius,
        other_gap=float(others.distance.min(initial=np.inf) - 2) * loop.radius,
        interlock_angle=interlock,
        leg_angle=leg,
    )


def honeycomb_angles(contact, rise):
    """Angles to x of the two kinds of inclined segments of Fig. 4, on the left side of the loop.

    Parameters
    ----------
    contact : ndarray (4, 3)
        Contact points of a cell by zone.
    rise : float
        Course spacing.

    Returns
    -------
    interlock, leg : float
        Between 0 and 90. [deg]
    """
    interlock = contact[2, :2] - contact[0, :2]
    leg = contact[0, :2] + [0.0, rise] - contact[2, :2]
    return tuple(float(np.degrees(np.arctan2(abs(y), abs(x)))) for x, y in (interlock, leg))


def check_yarns(surveyed, loop, tolerance):
    """No yarn folds, and none overlaps another one or itself.

    Parameters
    ----------
    surveyed : Survey
        Of the loop.
    loop : Loop
    tolerance : float
        Overlap allowed at the crossings, in radii: what the optimisation may miss its target by.

    Raises
    ------
    GeometryError
    """
    if surveyed.radius_of_curvature <= loop.radius:
        raise GeometryError(
            f"yarn.diameter = {2 * loop.radius} m: the loop's smallest radius of curvature is "
            f"{surveyed.radius_of_curvature:.4e} m, and the yarn's radius must be below it or the yarn folds"
        )
    gap, allowed = surveyed.gap / loop.radius, -tolerance
    if gap < allowed or surveyed.other_gap < 0:
        raise GeometryError(
            f"yarns overlap after the optimisation: the smallest gap is {gap:.4f} radii (allowed {allowed:g}) "
            f"and away from the crossings {surveyed.other_gap / loop.radius:.4f} (allowed 0): take a smaller "
            "yarn.diameter, wider spacings or other pattern.control_points"
        )
