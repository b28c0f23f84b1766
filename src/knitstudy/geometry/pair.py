"""Two straight yarns that cross: the smallest specimen in which yarns touch."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.geometry.pattern import XYZ, Crossings, metre
from knitstudy.geometry.spline import CatmullRom, Centreline

CONTROL_POINTS = 4
"""Control points of a straight yarn: the fewest that a curve has."""


@dataclass(frozen=True)
class YarnPair:
    """Two equally long yarns that cross in their middles, at the origin.

    The lower yarn lies along x below the plane z = 0; the upper one is turned from x to y by the angle and lies above
    the plane, so that the gap of their surfaces is the clearance.

    Attributes
    ----------
    radius : float
        Of both yarns. [m]
    angle : float
        Between the yarns. [degrees]
    length : float
        Of each yarn. [m]
    clearance : float
        Gap of the surfaces at the crossing, in radii.

    Raises
    ------
    GeometryError
        When the radius is not positive, the clearance negative, the angle not in (0, 90] or the yarns are not longer
        than two diameters.
    """

    radius: float
    angle: float
    length: float
    clearance: float = 0.0

    def __post_init__(self):
        if not self.radius > 0:
            raise GeometryError(f"yarn.diameter = {2 * self.radius} m: allowed is a positive number")
        if not self.clearance >= 0:
            raise GeometryError(f"pair.clearance = {self.clearance} radii: allowed is zero or more")
        if not 0 < self.angle <= 90:
            raise GeometryError(f"pair.angle = {self.angle} degrees: allowed is more than 0 and at most 90")
        if not self.length > 4 * self.radius:
            raise GeometryError(
                f"pair.length = {self.length} m: allowed is more than twice yarn.diameter = {2 * self.radius} m"
            )

    @property
    def rows(self):
        """Number of interlock rows: the two yarns are one."""
        return 1

    @property
    def directions(self):
        """Unit vectors along the lower and the upper yarn: (2, 3)."""
        turn = np.radians(self.angle)
        return np.array([[1.0, 0.0, 0.0], [np.cos(turn), np.sin(turn), 0.0]])

    @property
    def middles(self):
        """Middles of the two centrelines: (2, 3), m."""
        half = 0.5 * (2 + self.clearance) * self.radius
        return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])

    @cached_property
    def centrelines(self):
        """Centrelines of the lower and the upper yarn: tuple of two Centreline."""
        share = np.arange(CONTROL_POINTS)[:, None] / CONTROL_POINTS - 0.5
        return tuple(
            Centreline(CatmullRom(middle + share * self.length * along, self.length * along), 1)
            for middle, along in zip(self.middles, self.directions, strict=True)
        )

    @cached_property
    def crossings(self):
        """The one crossing: Crossings."""
        middles = self.middles
        return Crossings(
            row=np.array([0]),
            column=np.array([0]),
            zone=np.array([0]),
            yarn=np.array([[0, 1]]),
            arc_length=np.full((1, 2), 0.5 * self.length),
            point=middles[None],
            distance=middles[1:, 2] - middles[:1, 2],
        )

    def to_dataset(self):
        """The pair as a dataset: its sizes and its crossing, in SI units but for the angle."""
        return xr.Dataset(
            {
                "radius": ((), self.radius, metre("radius of the yarns")),
                "angle": ((), self.angle, {"units": "degree", "long_name": "between the yarns"}),
                "length": ((), self.length, metre("of each yarn")),
                "clearance": ((), self.clearance, {"units": "1", "long_name": "gap over the radius"}),
            }
            | self.crossings.to_variables(),
            coords={"xyz": XYZ},
            attrs={"specimen": "pair"},
        )

    @classmethod
    def from_dataset(cls, dataset):
        """The pair that a dataset of `to_dataset` describes.

        Raises
        ------
        DataFileError
            When a variable is missing.
        """
        needed = ("radius", "angle", "length", "clearance")
        missing = [name for name in needed if name not in dataset]
        if missing:
            raise DataFileError(
                f"geometry dataset: variables {missing} are missing; allowed is what YarnPair.to_dataset makes"
            )
        return cls(*(float(dataset[name]) for name in needed))
