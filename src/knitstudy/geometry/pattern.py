"""The knit: n loops in each of m + 1 yarns, their centrelines and their crossings."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.geometry.loop import Loop
from knitstudy.geometry.spline import Centreline
from knitstudy.geometry.survey import SAMPLES
from knitstudy.geometry.yarn_spacing import ZONES, closest_approach, crossings_in_plane, windows

XYZ = ["x", "y", "z"]


@dataclass(frozen=True)
class Crossings:
    """All K = 4 n m crossings of a knit, ordered by row, column and zone.

    Side 0 is the lower row's yarn, side 1 the upper row's.

    Attributes
    ----------
    row, column, zone : ndarray of int (K,)
        Interlock row, loop column, and zone: 0 left lower, 1 right lower, 2 left upper, 3 right upper.
    yarn : ndarray of int (K, 2)
    arc_length : ndarray (K, 2)
        Of the closest points along their yarns. [m]
    point : ndarray (K, 2, 3)
        The closest points of the two centrelines. [m]
    distance : ndarray (K,)
        Distance of the two. [m]
    """

    row: np.ndarray
    column: np.ndarray
    zone: np.ndarray
    yarn: np.ndarray
    arc_length: np.ndarray
    point: np.ndarray
    distance: np.ndarray

    def to_variables(self):
        """The crossings as variables of a dataset, by name."""
        return {
            "row": (("crossing",), self.row, {"units": "1"}),
            "column": (("crossing",), self.column, {"units": "1"}),
            "zone": (("crossing",), self.zone, {"units": "1"}),
            "yarn": (("crossing", "side"), self.yarn, {"units": "1"}),
            "arc_length": (("crossing", "side"), self.arc_length, metre("along the yarn")),
            "point_of_contact": (("crossing", "side", "xyz"), self.point, metre("closest points")),
            "distance": (("crossing",), self.distance, metre("shortest distance of the centrelines")),
        }


@dataclass(frozen=True)
class Knit:
    """A plain knit of ``rows`` interlock rows, that is ``rows`` + 1 yarns of ``loops`` loops.

    Raises
    ------
    GeometryError
        When the numbers of loops and rows are not positive integers.
    """

    loop: Loop
    loops: int
    rows: int

    def __post_init__(self):
        for name in ("loops", "rows"):
            count = getattr(self, name)
            if not (isinstance(count, int | np.integer) and count >= 1):
                raise GeometryError(f"pattern.{name} = {count!r}: allowed is a whole number from 1 on")

    @property
    def radius(self):
        """Radius of the yarn. [m]"""
        return self.loop.radius

    @property
    def clearance(self):
        """Gap aimed at where yarns cross, in radii."""
        return self.loop.clearance

    @property
    def width(self):
        """Width of the knit in the course direction, from cut to cut. [m]"""
        return self.loops * self.loop.wale_spacing

    @property
    def height(self):
        """Height of the knit's rows in the wale direction. [m]"""
        return self.rows * self.loop.course_spacing

    @cached_property
    def centrelines(self):
        """Centrelines of the yarns, bottom yarn first: tuple of rows + 1 Centreline."""
        curve, rise = self.loop.curve, self.loop.rise
        first = Centreline(curve, self.loops)
        images = (Centreline(curve.shifted(i * rise), self.loops, first) for i in range(1, self.rows + 1))
        return (first, *images)

    @cached_property
    def crossings(self):
        """All crossings of the knit: Crossings."""
        loop = self.loop
        unit = loop.in_radii()
        window = windows(crossings_in_plane(unit.curve, unit.course_spacing), unit.curve.period)
        cell = closest_approach(unit.curve, unit.course_spacing, window, SAMPLES)
        row, column, zone = (i.ravel() for i in np.indices((self.rows, self.loops, ZONES)))
        parameter = cell.parameter[zone] + column[:, None] * unit.curve.period
        shift = np.column_stack([column * loop.wale_spacing, row * loop.course_spacing, np.zeros(len(row))])
        return Crossings(
            row=row,
            column=column,
            zone=zone,
            yarn=row[:, None] + [0, 1],
            arc_length=self.centrelines[0].arc_length(parameter),
            point=cell.point[zone] * loop.radius + shift[:, None],
            distance=cell.distance[zone] * loop.radius,
        )

    def to_dataset(self):
        """The knit as a dataset: control points, spacings and crossings, in SI units."""
        loop = self.loop
        return xr.Dataset(
            {
                "control_points": (
                    ("point", "xyz"),
                    loop.control_points,
                    metre("control points of one loop"),
                ),
                "wale_spacing": ((), loop.wale_spacing, metre("distance of neighbouring loops along x")),
                "course_spacing": ((), loop.course_spacing, metre("distance of neighbouring yarns along y")),
                "radius": ((), loop.radius, metre("radius of the yarn")),
                "clearance": (
                    (),
                    loop.clearance,
                    {"units": "1", "long_name": "gap aimed at, over the radius"},
                ),
                "loops": ((), self.loops, {"units": "1"}),
                "rows": ((), self.rows, {"units": "1", "long_name": "interlock rows; one yarn more"}),
            }
            | self.crossings.to_variables(),
            coords={"xyz": XYZ},
            attrs={"specimen": "knit"},
        )

    @classmethod
    def from_dataset(cls, dataset):
        """The knit that a dataset of `to_dataset` describes; its crossings are computed again.

        Raises
        ------
        DataFileError
            When a variable is missing.
        """
        needed = ("control_points", "wale_spacing", "course_spacing", "radius", "clearance", "loops", "rows")
        missing = [name for name in needed if name not in dataset]
        if missing:
            raise DataFileError(
                f"geometry dataset: variables {missing} are missing; allowed is what Knit.to_dataset makes"
            )
        spacing, rise, radius, clearance = (float(dataset[name]) for name in needed[1:5])
        loop = Loop(dataset["control_points"].values, spacing, rise, radius, clearance)
        return cls(loop, int(dataset["loops"]), int(dataset["rows"]))


def metre(long_name):
    """Attributes of a length."""
    return {"units": "m", "long_name": long_name}
