"""Loops as drawn: x = w t / (2 pi) + a sin 2t, y = -h/2 cos t, z = -b cos 2t, as long as Peirce's loop.

Peirce 1947, "Geometrical principles applicable to the design of functional fabrics", Textile Research Journal 17.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.loop import Loop, whole_loop
from knitstudy.knit.geometry.stitches import PLAIN, drawn_from_plain
from knitstudy.mechanics.arrays import Floats

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
        height, depth = self.course + OVERLAP * diameter, HEIGHT * diameter

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
