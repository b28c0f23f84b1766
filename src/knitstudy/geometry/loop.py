"""One loop of a plain knit: the shape that is repeated, and the yarn that is bent into it."""

from dataclasses import dataclass, replace

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.geometry.spline import CatmullRom


@dataclass(frozen=True)
class Loop:
    """Control points of one loop and the spacings at which it is repeated.

    Attributes
    ----------
    control_points : ndarray (P, 3)
        From the sinker's centre, where x = 0, to the last point before the next sinker's centre. [m]
    wale_spacing, course_spacing : float
        Distance w of neighbouring loops along x, and c of neighbouring rows along y. [m]
    radius : float
        Radius R of the yarn. [m]
    clearance : float
        Gap c0 between yarns at the crossings that the optimisation aims at, in radii.

    Raises
    ------
    GeometryError
        When a length is not positive, rows or loops stand closer than a diameter, or the clearance is
        negative.
    """

    control_points: np.ndarray
    wale_spacing: float
    course_spacing: float
    radius: float
    clearance: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, "control_points", np.array(self.control_points, dtype=float))
        self.control_points.setflags(write=False)
        if not self.radius > 0:
            raise GeometryError(f"yarn.diameter = {2 * self.radius} m: allowed is a positive number")
        if not self.clearance >= 0:
            raise GeometryError(f"pattern.clearance = {self.clearance} radii: allowed is zero or more")
        for name in ("wale_spacing", "course_spacing"):
            spacing = getattr(self, name)
            if not spacing > 2 * self.radius:
                raise GeometryError(
                    f"pattern.{name} = {spacing} m: allowed is more than yarn.diameter = {2 * self.radius} m"
                )
        _ = self.curve  # the control points are checked where they become a curve

    @property
    def curve(self):
        """Centreline of one loop as a periodic curve. [m]"""
        return CatmullRom(self.control_points, [self.wale_spacing, 0.0, 0.0])

    @property
    def rise(self):
        """Vector from a row to the next one: (3,), m."""
        return np.array([0.0, self.course_spacing, 0.0])

    @property
    def target(self):
        """Distance 2R + c0 of two centrelines at a crossing. [m]"""
        return (2 + self.clearance) * self.radius

    @property
    def length(self):
        """Arc length of yarn in a loop. [m]"""
        return float(self.curve.segment_lengths().sum())

    def in_radii(self):
        """The same loop with the radius as unit of length."""
        return self.scaled(1 / self.radius, radius=1.0)

    def scaled(self, factor, radius=None):
        """The same loop with every length times a factor."""
        return Loop(
            self.control_points * factor,
            self.wale_spacing * factor,
            self.course_spacing * factor,
            self.radius * factor if radius is None else radius,
            self.clearance,
        )

    def with_points(self, control_points):
        """The same loop through other control points (P, 3). [m]"""
        return replace(self, control_points=control_points)
