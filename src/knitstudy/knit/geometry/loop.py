"""The loops of one repeat of a knit: one of a plain knit, r rows of k loops of others; and loops as they are drawn.

A loop is drawn as x = w t / (2 pi) + a sin 2t, y = -h/2 cos t, z = -b cos 2t, as long as Peirce's loop (1947,
"Geometrical principles applicable to the design of functional fabrics", Textile Research Journal 17).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.knit.geometry.stitches import PLAIN, drawn_from_plain, sides
from knitstudy.mechanics.core.arrays import Bools, Floats

IN_FRONT = np.array([False, False, True, True])  # the upper yarn, by zone of a knit stitch's crossings


@dataclass(frozen=True)
class Loop:
    """Control points of the loops of one repeat and the spacings at which they stand.

    Raises GeometryError when stitches are no rectangle of K and P that the control points can be divided by.
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
        count = len(self.control_points)
        loops = sides(self.stitches).size
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
    def upper_in_front(self) -> Bools:
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


POINTS = 16  # control points of a drawn loop
DRAWN_SAMPLES = 1000  # of a drawn curve, between which control points are spaced evenly
OVERLAP, HEIGHT = 2.0, 0.54  # of a drawn loop, in diameters: h over c, and b
BULGE, BULGES = (0.08, 0.35), 28  # range of a over w, and values between which a length is interpolated
TIGHT = (3.364, 4.0)  # course and wale spacing over the diameter of Peirce's loop whose yarns touch
THIN = 0.3  # of that diameter, for which loops of thinner yarns are drawn: else they do not reach each other


def peirce_length(course: float, wale: float, diameter: float) -> float:
    """Return the length of yarn in Peirce's loop, whose arcs lie in the plane and touch: all in one unit.

    Examples
    --------
    >>> round(peirce_length(course=0.9, wale=1.1, diameter=0.25), 3)  # one unit for all
    4.385
    """
    return 2 * course + wale + 5.94 * diameter


@dataclass(frozen=True)
class LoopTarget:
    """Input of a fit: spacings and radius as of `Loop`, and the length of a loop if it is given [m]."""

    course: float
    wale: float
    radius: float
    clearance: float
    length: float | None = None
    stitches: tuple[str, ...] = PLAIN
    deep: float = 1.0  # depth of drawn loops over the usual one: an inlay keeps loops apart

    @property
    def tight(self) -> float:
        """Diameter of the yarns of Peirce's loop that touch at these spacings. [m]"""
        return min(self.course / TIGHT[0], self.wale / TIGHT[1])

    @property
    def rest_length(self) -> float:
        """Length of Peirce's loop, which the length term of Eq. (1) aims at. [m]"""
        return peirce_length(self.course, self.wale, min(2 * self.radius, self.tight))

    def drawn(self, length: float | None = None) -> Loop:
        """Return the loop as it is drawn: of a length [m], or as long as Peirce's as far as `BULGE` allows.

        Raises GeometryError where no drawn loop has the length.
        """
        diameter = min(max(2 * self.radius, THIN * self.tight), self.tight)
        t = np.linspace(0, 2 * np.pi, DRAWN_SAMPLES + 1)
        height = self.course + OVERLAP * diameter
        depth = HEIGHT * diameter * self.deep

        def curve(bulge: float) -> tuple[Floats, Floats]:
            x = self.wale * (t / (2 * np.pi) + bulge * np.sin(2 * t))
            points = np.column_stack([x, -0.5 * height * np.cos(t), -depth * np.cos(2 * t)])
            return points, np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))

        bulges = np.linspace(*BULGE, BULGES)
        lengths = [curve(bulge)[1][-1] for bulge in bulges]
        if length is not None and not lengths[0] <= length <= lengths[-1]:
            between = f"from {lengths[0]:.4g} to {lengths[-1]:.4g} m"
            raise GeometryError(
                f"pattern.loop_length is {length:.4g} m, but loops of these spacings are drawn {between}"
            )
        length = length or peirce_length(self.course, self.wale, diameter)
        points, s = curve(np.interp(length, lengths, bulges))
        at = np.arange(POINTS // 4 + 1) / POINTS * s[-1]
        quarter = np.column_stack([np.interp(at, s, points[:, axis]) for axis in range(3)])
        quarter[-1, :2] = self.wale / 4, 0.0
        points = drawn_from_plain(whole_loop(quarter, self.wale), self.wale, self.course, self.stitches)
        return Loop(points, self.wale, self.course, self.radius, self.clearance, self.stitches)
