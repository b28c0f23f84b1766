"""Construction of a fabric as textile engineers give it: density of stitches, tightness, cover, mass, thickness.

The tightness factor is the root of the tex over the loop length (Munden 1962, "Dimensional stability of plain-knit
fabrics", Journal of the Textile Institute 53). The cover is the share of the plane that yarns hide.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import nan, pi

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import endless_cell
from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.response import deformed_centrelines
from knitstudy.measures.summary import Quantity
from knitstudy.mechanics.core.arrays import Floats

GRID = 300  # places in either direction at which a cell is looked at: the cover is within 0.003
STEP = 0.1  # distance of points along yarns, in radii
SAMPLES = 200  # points of a drawn yarn in a stitch
AT_REST = "not known before its rest (knitstudy run)"
# Numbers of drawn loops that belong to the thickness of the yarn, beside its diameter
OF_DRAWN = ("cover", "thickness", "gap", "other gap", "R over the smallest radius of curvature")


def tex_of(diameter: float, density: float) -> float:
    """Return the tex [g/km] of a round yarn of a diameter [m] and a density with the air in it [kg/m3].

    Examples
    --------
    >>> round(tex_of(0.205e-3, 909.0), 1)
    30.0
    """
    return 1e6 * density * pi * diameter**2 / 4


def drawn(geometry: xr.Dataset, tex: Floats | float = nan) -> list[Quantity]:
    """Return the construction of the loops of a geometry as they are drawn; nothing where it has none."""
    if "loops" not in geometry:
        return []
    fabric = fabric_of(geometry)
    if not len(fabric.periods):
        assert fabric.loop is not None, "a knit has a loop"
        fabric = endless_cell(fabric.loop, fabric.loop.columns, fabric.loop.rows)
    lines = fabric.centrelines[:-1]  # the last one is the image of the first
    width, height = float(fabric.periods[0, 0]), float(fabric.periods[1, 1])
    loops = round(width / float(geometry["wale_spacing"]))
    places = [line.position(np.linspace(0, line.length, SAMPLES * loops)) for line in lines]
    length = np.array([line.length for line in lines])
    rows = round(height / float(geometry["course_spacing"]))
    return construction(places, length, (width, height, loops, rows), fabric.radius, tex)


def of_yarn(numbers: Iterable[Quantity], scene: Scene) -> list[Quantity]:
    """Return numbers of drawn loops with those of the yarn of the scene, where a thinner one is drawn."""
    if scene.value("geometry.diameter_share") in (None, 1):
        return [*numbers]
    known: dict[str, Quantity] = {name: Quantity(name, AT_REST) for name in OF_DRAWN}
    known["yarn diameter"] = Quantity("yarn diameter", scene.yarn.diameter, "m")
    return [known.get(number.name, number) for number in numbers]


def yarn_in_a_stitch(geometry: xr.Dataset, stitches: int) -> float:
    """Return the mean length of yarn in a stitch [m] of an endless knit, whose cell has a number of stitches."""
    lines = fabric_of(geometry).centrelines[:-1]
    return sum(line.length for line in lines) / stitches


def at_rest(
    history: xr.Dataset, loops: int, rows: int, radius: Floats | float, tex: Floats | float = nan
) -> list[Quantity]:
    """Return the construction of a cell of beams, of loops times rows stitches, where its load path begins.

    Nothing of other histories, which begin with the loops as drawn.
    """
    if "cell_width" not in history.attrs:
        return []
    width, height = float(history.attrs["cell_width"]), float(history.attrs["cell_height"])
    place = deformed_centrelines(history, 0)
    yarn = history["yarn"].to_numpy()
    own = [np.flatnonzero(yarn == number) for number in np.unique(yarn)]
    # A yarn goes on from its last node to the image of its first one.
    places = [np.vstack([place[nodes], place[nodes[0]] + [width, 0.0, 0.0]]) for nodes in own]
    last = history["arc_length"].to_numpy()
    length = np.array([float(last[nodes[-1]]) * len(nodes) / (len(nodes) - 1) for nodes in own])
    return construction(places, length, (width, height, loops, rows), radius, tex)


def construction(
    lines: Sequence[Floats],
    length: Floats,
    size: tuple[float, float, int, int],
    radius: Floats | float,
    tex: Floats | float,
) -> list[Quantity]:
    """Return numbers of a cell in the units of a mill; without the tex [g/km] of the yarn those that need none.

    `lines` are points (k, 3) of its Y yarns up to the image of the first of them, `length` (Y,) the yarn in it [m],
    `size` its width and height [m], and its stitches across and along; needles that float or tuck count. Radius and tex
    are those of all yarns, or of each (Y,). As many yarns as stitches along are knitted, the longest; others laid in.
    """
    width, height, loops, rows = size
    dense = [_dense(line, STEP * float(np.min(radius))) for line in lines]
    points = np.concatenate(dense)
    own = np.repeat(np.broadcast_to(radius, len(lines)), [len(line) for line in dense])
    knitted = np.argsort(np.broadcast_to(length, len(lines)))[-rows:]
    each = float(np.broadcast_to(length, len(lines))[knitted].sum()) / (loops * rows)
    density = loops * rows / (width * height)
    own_tex = np.unique(np.broadcast_to(tex, len(lines))[knitted])
    numbers = [
        Quantity("wales per cm", 1e-2 * loops / width, "1/cm"),
        Quantity("courses per cm", 1e-2 * rows / height, "1/cm"),
        Quantity("stitch density", 1e-4 * density, "1/cm2"),
        Quantity("length of yarn in a stitch", 1e3 * each, "mm"),
        Quantity("cover", cover(points[:, :2], own, (width, height)), "1"),
        Quantity("thickness", 1e3 * float(np.max(points[:, 2] + own) - np.min(points[:, 2] - own)), "mm"),
        Quantity(
            "tightness factor",
            float(np.sqrt(own_tex[0]) / (1e2 * each)) if len(own_tex) == 1 else nan,
            "sqrt(tex)/cm",
        ),
        Quantity("mass per area", 1e-3 * float(np.sum(tex * length)) / (width * height), "g/m2"),
    ]
    return [number for number in numbers if not np.isnan(float(number.value))]


def _dense(line: Floats, step: float) -> Floats:
    """Return points on straight pieces between the points (k, 3) of a line, a step apart at most [m]."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    wanted = np.linspace(0, s[-1], int(s[-1] / step) + 2)
    return np.column_stack([np.interp(wanted, s, component) for component in line.T])


def cover(points: Floats, radius: Floats | float, size: tuple[float, float]) -> float:
    """Return the share of a cell of a size [m] within a radius of points (k, 2) along yarns, or of their images.

    The radius is that of all, or one of every point (k,).

    Examples
    --------
    >>> straight = np.column_stack([np.linspace(0, 1, 100, endpoint=False), np.full(100, 0.3)])
    >>> round(cover(straight, radius=0.1, size=(1.0, 0.5)), 2)  # diameter over spacing
    0.4
    """
    wrapped = np.mod(points, size)
    wrapped[wrapped >= size] = 0.0  # of rounding
    middles = [side * (np.arange(GRID) + 0.5) / GRID for side in size]
    places = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 2)
    own = np.broadcast_to(radius, len(points))
    hidden = np.zeros(len(places), dtype=bool)
    for each in np.unique(own):
        distance, _ = cKDTree(wrapped[own == each], boxsize=size).query(places)
        hidden |= distance <= each
    return float(hidden.mean())
