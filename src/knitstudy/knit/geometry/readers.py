"""Fabrics from files: knits that other programs have laid out, or that this one has written.

A reader is a function from a path to a `Fabric`, registered under the ending of its files. A plugin adds one with
``READERS.register(Reader(".xyz", "what such a file holds", read))``.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from math import atan, cos, gamma, isfinite, pi, sin, sqrt
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from knitstudy.datasets import read_dataset, read_table
from knitstudy.errors import ConfigurationError, DataFileError, printable
from knitstudy.files import read_text
from knitstudy.knit.geometry.fabric import Fabric, of_curves
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.loop import TIGHT, LoopTarget
from knitstudy.knit.geometry.specimens import endless_cell
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.geometry.stitch_mesh import endless_cell_of_stitches
from knitstudy.knit.scene.knitout import read_repeat
from knitstudy.knit.scene.stitches import is_plain, size_of_repeat
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.registry import Registry

COLUMNS = ("yarn", "x [m]", "y [m]", "z [m]", "radius [m]")
"""Columns of a table of centrelines: points of a yarn follow each other, and all yarns have one radius."""

FEWEST = 4  # points of a yarn
DEEPEST = 0.5  # overlap of yarns that cross, over their radius, as `gates.overlap`
THICK = 0.01  # radius of a yarn that is questioned [m]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Reader:
    """A way to read fabrics."""

    name: str  # ending of the files
    meaning: str
    read: Callable[[Path], Fabric]


READERS: Registry[Reader] = Registry("ending of a fabric file")


def read_fabric(path: Path | str) -> Fabric:
    """Return the fabric in a file, by the reader of its ending.

    Raises ConfigurationError for an unknown ending, and DataFileError where the file holds no fabric.

    Examples
    --------
    >>> sorted(READERS.names())
    ['.csv', '.k', '.knitout', '.nc', '.tg3']
    """
    path = Path(path)
    return READERS.find(path.suffix.lower(), str(path)).read(path)


def centreline(points: Floats) -> Centreline:
    """Return the centreline of a yarn from its first to its last point (n, 3) [m]: a Catmull-Rom curve.

    Examples
    --------
    >>> float(round(centreline(np.outer([0.0, 1.0, 3.0], [1.0, 0.0, 0.0])).length, 6))
    3.0
    """
    ends = 2 * points[[0, -1]] - points[[1, -2]]  # beyond the ends, where the curve goes straight on
    every = np.concatenate([ends[:1], points, ends[1:]])
    whole = Centreline(CatmullRom(every[:-1], every[-1] - every[0]), 1)
    first, last = whole.arc_length(np.array([1.0, len(points)]))
    return whole.part(first, last)


def read_centrelines(path: Path) -> Fabric:
    """Return the fabric of a CSV table of centrelines (`COLUMNS`); strains refer to the extent of its curves.

    Lengths may be in mm as well, with the unit in the names of the columns.
    Raises DataFileError for texts in numbers, yarns of several radii, and centrelines that lie in each other's yarn.
    """
    return _fabric_of_table(path, read_table(path))


def read_texgen(path: Path) -> Fabric:
    """Return the fabric of a file of TexGen (.tg3): curves through all points of its yarns, or else the master nodes.

    Yarns that repeat themselves along x, and again along y, are a cell of an endless fabric; other repeats are left out
    with a warning. Yarns are round, with the area of their sections (`SECTION_AREAS`).
    Raises DataFileError as `read_centrelines`, where yarns are not of one section, and for sections of other types.
    """
    rows: list[tuple[float, ...]] = []
    repeats: set[tuple[float, ...]] = set()
    try:
        textile = ElementTree.fromstring(read_text(path))[0]
        if not (yarns := textile.findall("Yarn")):
            raise ValueError
        for number, yarn in enumerate(yarns):
            (area,) = {_section_area(path, section) for section in yarn.iter("Section")}
            radius = sqrt(area / pi)
            nodes = yarn.findall("SlaveNode") or yarn.findall("MasterNode")
            rows += [(number, *_vector(node.attrib["Position"]), radius) for node in nodes]
            repeats |= {_vector(of.attrib["value"]) for of in yarn.iter("Repeat")}
        unit = f"[{textile.get('GeometryScale', 'mm')}]"
        table = pd.DataFrame(rows, columns=[name.replace("[m]", unit) for name in COLUMNS])
    except (ElementTree.ParseError, ArithmeticError, LookupError, ValueError):
        fact = "holds no yarns of TexGen, each of one section with a width and a height"
        raise DataFileError(f"{path}: {fact}; save it with standard or full output") from None
    points = table.groupby("yarn")[list(table.columns[1:4])]
    periods = np.array(sorted(repeats, reverse=True))
    along_axes = periods.shape == (2, 3) and np.allclose(periods, periods * np.eye(2, 3))
    if along_axes and np.allclose(points.last() - points.first(), periods[0]):
        return _fabric_of_table(path, table, periods)
    log.warning(
        "%s: repeats are left out because they are not along x (as the yarns) and y: %s",
        printable(str(path)),
        repeats,
    )
    return _fabric_of_table(path, table)


def _vector(text: str) -> tuple[float, float, float]:
    """Return three numbers from a text with commas; ValueError of any other text."""
    x, y, z = map(float, text.split(","))
    if not isfinite(x + y + z):
        raise ValueError
    return x, y, z


def _lenticular_area(width: float, height: float, distortion: float) -> float:
    """Return the area between two arcs over one chord, which rise by half the height less and more the distortion.

    Raises ValueError where an arc is more than half a circle, or turned inside out.
    """
    area = 0.0
    for rise in (0.5 * height - distortion, 0.5 * height + distortion):
        if not 0 <= 2 * rise <= width:
            raise ValueError
        half_angle = 2 * atan(2 * rise / width)
        radius = 0.5 * width / sin(half_angle) if rise else 0.0
        area += radius**2 * (half_angle - sin(half_angle) * cos(half_angle))
    return area


def _power_ellipse_area(width: float, height: float, power: float) -> float:
    """Return the area of x = width / 2 cos(t), y = height / 2 sin(t)^power; raises ValueError unless power > 0."""
    if power <= 0:
        raise ValueError
    return 0.5 * width * height * sqrt(pi) * gamma(0.5 * power + 1) / gamma(0.5 * power + 1.5)


SECTION_AREAS: dict[str, tuple[Callable[..., float], tuple[str, ...]]] = {
    "CSectionEllipse": (lambda width, height: 0.25 * pi * width * height, ("Width", "Height")),
    "CSectionLenticular": (_lenticular_area, ("Width", "Height", "Distortion")),
    "CSectionPowerEllipse": (_power_ellipse_area, ("Width", "Height", "Power")),
    "CSectionRectangle": (lambda width, height: width * height, ("Width", "Height")),
}
"""Areas of the sections of TexGen that are understood, by type: a function and the attributes that it takes."""


def _section_area(path: Path, section: ElementTree.Element) -> float:
    """Return the area of a section; raises DataFileError for types not understood, ValueError for no numbers."""
    kind = section.get("type", "without a type")
    if kind not in SECTION_AREAS:
        fact = f"{path}: a yarn has a section {kind[:60]}, whose area is not known here"
        raise DataFileError(printable(f"{fact}; allowed are {', '.join(SECTION_AREAS)}"))
    area_of, names = SECTION_AREAS[kind]
    sizes = [float(section.attrib[name]) for name in names]
    if not (isfinite(sum(sizes)) and min(sizes[:2]) > 0):
        raise ValueError
    return area_of(*sizes)


def _points_and_radius(path: Path, table: pd.DataFrame) -> tuple[list[Floats], float, float]:
    """Return the points (P, 3) of every yarn and the radius of all [m], and the unit of the table in m."""
    unit, scale = ("mm", 1e-3) if "x [mm]" in table else ("m", 1.0)
    names = [name.replace("[m]", f"[{unit}]") for name in COLUMNS]
    if missing := [name for name in names if name not in table]:
        raise DataFileError(f"{path}: has no column {missing[0]!r}, only {', '.join(map(repr, table))}")
    numbers = table[names[1:]].apply(pd.to_numeric, errors="coerce")
    for row, column in np.argwhere(~np.isfinite(numbers.to_numpy()))[:1]:
        found = table[names[1 + column]].iloc[row]
        raise DataFileError(
            f"{path}: row {row + 2}, column {names[1 + column]} holds {found!r} but must be a number"
        )
    numbers *= scale
    radius = numbers[names[4]].unique()
    if len(radius) != 1 or not radius[0] > 0:
        raise DataFileError(
            f"{path}: column {names[4]} holds {radius.tolist()}; allowed is one positive number"
        )
    points = [numbers[names[1:4]].to_numpy()[at] for at in table.groupby("yarn", sort=False).indices.values()]
    return points, float(radius[0]), scale


def _fabric_of_table(path: Path, table: pd.DataFrame, periods: Floats | None = None) -> Fabric:
    """Return the fabric of a table, endless in two `periods` (2, 3) in the unit of the table."""
    points, radius, scale = _points_and_radius(path, table)
    if (short := min(map(len, points))) < FEWEST:
        raise DataFileError(f"{path}: a yarn has {short} points; allowed are {FEWEST} or more")
    if radius > THICK:
        log.warning(
            "%s: the radius of the yarns is %g m: are lengths in mm? Then call the columns x [mm] ...",
            printable(str(path)),
            radius,
        )
    if periods is None:
        fabric = of_curves([centreline(point) for point in points], radius)
    else:
        along, up = periods = scale * periods
        rows = [Centreline(CatmullRom(point[:-1], along), 1) for point in points]
        image = Centreline(CatmullRom(points[0][:-1] + up, along), 1, rows[0])
        size = along + up + [0, 0, 2 * radius]
        copy_of = np.append(np.arange(len(rows)), 0)
        shift = np.append(np.zeros((len(rows), 3)), [up], axis=0)
        more = {"specimen": "cell", "periods": periods, "cell": size[:2]}
        fabric = of_curves([*rows, image], radius, 0.0, size, copy_of, shift, **more)
    if len(apart := fabric.crossings.distance) and (least := apart.min() / radius) < 2 - DEEPEST:
        raise DataFileError(
            f"{path}: yarns overlap: centrelines are {apart.min():.4g} m apart where they cross, {2 - least:.2g} radii "
            f"less than a diameter; allowed are {DEEPEST} radii"
        )
    return fabric


OF_TIGHT = 0.8  # Diameter over that of yarns that touch in Peirce's loop, of a machine's knit as it is drawn


def read_machine_knit(path: Path) -> Fabric:
    """Return one repeat of a knitout file as a cell of an endless fabric, as it is drawn: no force is in balance.

    Wales are as far apart as its ``;;Gauge:`` and the needles in use say; courses and diameter follow from Peirce's
    loop.
    Raises ConfigurationError where the file cannot be knitted, or names no gauge.
    """
    repeat = read_repeat(path)
    stitches, wale = repeat.stitches, repeat.wale_spacing
    if wale is None:
        raise ConfigurationError(f"{path}: names no ;;Gauge:, needles per inch, which gives the wale spacing")
    course = wale * TIGHT[0] / TIGHT[1]
    diameter = OF_TIGHT * wale / TIGHT[1]
    target = LoopTarget(course, wale, 0.5 * diameter, 0.0, None, stitches)
    size = size_of_repeat(stitches)
    if is_plain(stitches):
        return endless_cell(target.drawn(), *size)
    return endless_cell_of_stitches(target, *size)


for _ending in (".k", ".knitout"):
    READERS.register(Reader(_ending, "instructions of a knitting machine (knitout)", read_machine_knit))
READERS.register(Reader(".csv", "points of the centrelines of all yarns", read_centrelines))
READERS.register(Reader(".tg3", "yarns of TexGen", read_texgen))
READERS.register(
    Reader(".nc", "a fabric that this program wrote", lambda path: fabric_of(read_dataset(path)))
)
