"""The loops of one repeat of a knit: one of a plain knit, r rows of k loops of others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.knit.geometry.stitches import PLAIN, sides
from knitstudy.mechanics.arrays import Floats

IN_FRONT = np.array([False, False, True, True])  # the upper yarn, by zone of a knit stitch's crossings


@dataclass(frozen=True)
class Loop:
    """Control points of the loops of one repeat and the spacings at which they stand.

    Raises GeometryError when a length is not positive, rows or loops stand closer than a diameter, the clearance is
    negative, or stitches are no rectangle of K and P that the control points can be divided by.
    """

    # (P, 3) from the sinker's centre, x = 0, to the one before that where the row repeats itself, row after row. [m]
    control_points: Floats
    wale_spacing: float  # distance w of neighbouring loops along x. [m]
    course_spacing: float  # distance c of neighbouring rows along y. [m]
    radius: float  # R of the yarn. [m]
    clearance: float = 0.0  # gap c0 between yarns at the crossings that the optimisation aims at, in radii
    stitches: tuple[str, ...] = PLAIN  # rows of K and P, the bottom row first (`knit.geometry.stitches`)

    def __post_init__(self) -> None:
        object.__setattr__(self, "control_points", np.array(self.control_points, dtype=float))
        self.control_points.setflags(write=False)
        diameter = 2 * self.radius
        wider = f"more than yarn.diameter = {diameter} m"
        for name, value, fits, allowed in (
            ("yarn.diameter", f"{diameter} m", self.radius > 0, "a positive number"),
            ("pattern.clearance", f"{self.clearance} radii", self.clearance >= 0, "zero or more"),
            ("pattern.wale_spacing", f"{self.wale_spacing} m", self.wale_spacing > diameter, wider),
            ("pattern.course_spacing", f"{self.course_spacing} m", self.course_spacing > diameter, wider),
        ):
            if not fits:
                raise GeometryError(f"{name} = {value}: allowed is {allowed}")
        count, loops = len(self.control_points), sides(self.stitches).size
        if count % loops:
            raise GeometryError(f"pattern.control_points: {count} points cannot describe {loops} loops")
        _ = self.curve  # the control points are checked where they become a curve

    @property
    def rows(self) -> int:
        """Rows r of the repeat, each of one yarn."""
        return len(self.stitches)

    @property
    def columns(self) -> int:
        """Loops k of a row of the repeat."""
        return len(self.stitches[0])

    @property
    def advance(self) -> Floats:
        """Vector from a row's first loop to the one where the row repeats itself: (3,), m."""
        return np.array([self.columns * self.wale_spacing, 0.0, 0.0])

    @property
    def curve(self) -> CatmullRom:
        """Centreline of the first row as a periodic curve. [m]"""
        return self.image(0)

    @property
    def curves(self) -> list[CatmullRom]:
        """Centrelines of all rows. [m]"""
        return [self.image(row) for row in range(self.rows)]

    def image(self, row: int) -> CatmullRom:
        """Centreline of a row, counted on through the next repeats, as a periodic curve. [m]"""
        turns, row = divmod(row, self.rows)
        points = self.control_points.reshape(self.rows, -1, 3)[row]
        return CatmullRom(points + turns * (self.rows * self.rise), self.advance)

    @property
    def rise(self) -> Floats:
        """Vector from a row to the next one: (3,), m."""
        return np.array([0.0, self.course_spacing, 0.0])

    @property
    def target(self) -> float:
        """Distance 2R + c0 of two centrelines at a crossing. [m]"""
        return (2 + self.clearance) * self.radius

    @property
    def length(self) -> float:
        """Arc length of yarn in a loop, the mean of all. [m]"""
        return float(sum(curve.segment_lengths().sum() for curve in self.curves) / (self.rows * self.columns))

    @property
    def upper_in_front(self) -> Floats:
        """Whether the upper row's yarn passes in front: (r, k, 4), by row and column of the lower loop, and zone."""
        above = np.roll(sides(self.stitches), -1, axis=0)[..., None]
        return np.where(above > 0, IN_FRONT, ~IN_FRONT)

    def in_radii(self) -> Loop:
        """The same loop with the radius as unit of length."""
        factor = 1 / self.radius
        spacings = self.wale_spacing * factor, self.course_spacing * factor
        return Loop(self.control_points * factor, *spacings, 1.0, self.clearance, self.stitches)


def whole_loop(quarter: Floats, wale_spacing: float) -> Floats:
    """All control points (4 k, 3) of a loop from the points of a quarter (k + 1, 3): sinker to middle of the leg.

    Examples
    --------
    >>> quarter = np.array([[0.0, 0.0, 0.5], [0.2, 0.1, 0.3], [0.5, 0.5, 0.0]])
    >>> whole_loop(quarter, wale_spacing=2.0).shape
    (8, 3)
    """
    turned = [wale_spacing / 2, 0, 0] + quarter[-2::-1] * [-1, -1, 1]
    half = np.vstack([quarter, turned])
    mirrored = [wale_spacing, 0, 0] + half[-2:0:-1] * [-1, 1, 1]
    return np.vstack([half, mirrored])
