"""What square knits tend to as they grow, beside one cell of an endless knit (docs/periodic_cell.md)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from knitstudy.loading.load_path import DIRECTIONS
from knitstudy.measures.clamped_sheet import held_over_free
from knitstudy.measures.discretisation import is_cut, is_direct, made_of
from knitstudy.measures.domain import Series
from knitstudy.study.scene import Scene

MOST = 4
"""Knits, the largest ones, that a limit is sought through."""

SAME = ("yarn", "tie")
"""Sections of a scene that a cell shares with knits of the same yarns."""


def limit(cells: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Return what values tend to as knits grow, and how far that hangs on the knits and the law it is from.

    Edges are the 1 / n-th part of a knit, its corners the square of that.

    Parameters
    ----------
    cells, values : sequence, (k,)
        Cells in a row, from the smallest knit to the largest, and the value of each; three or more.

    Returns
    -------
    limit, uncertainty : float
        The middle of the least and the largest a of a + b / n through the largest two, three and four knits, and of
        a + b / n + c / n^2 through the largest four, and half of what lies between them.
    """
    part, values = 1 / np.asarray(cells, dtype=float)[-MOST:], np.asarray(values, dtype=float)[-MOST:]
    found = [np.polyfit(part[-count:], values[-count:], 1)[1] for count in range(2, len(part) + 1)]
    found.append(np.polyfit(part, values, 2)[2])
    return (min(found) + max(found)) / 2, (max(found) - min(found)) / 2


def cell_of(series: Series, cells: Iterable[Scene]) -> Scene | None:
    """Return the first of cells that is an endless knit of a series of solids, pulled like it and free across."""
    knit = series.scenes[0]
    for cell in cells if is_direct(knit) or is_cut(knit) else ():
        pulled = cell.load.deformation == knit.load.direction and cell.load.lateral == "free"
        alike = cell.interaction == knit.interaction and made_of(cell) == made_of(knit)
        if pulled and alike and cell.read(SAME) == knit.read(SAME):
            return cell
    return None


def between_grips(history: xr.Dataset, scene: Scene, increment: int) -> float:
    """Return by what the force of a cell grows in a large square knit, whose grips hold it across.

    The sheet is as stiff as the cell is on the mean of its way: in free tension it has the cell's force at that strain,
    and contracts as much.

    Parameters
    ----------
    history : Dataset
        Of a tied cell that is free across.
    scene : Scene
    increment : int
        At whose strain.
    """
    axis = DIRECTIONS.index(scene.load.deformation)
    order = [axis, 1 - axis, 2]
    way = history.isel(increment=slice(None, increment + 1))
    strain = way["strain"].to_numpy()
    mean = np.trapezoid(way["tangent_per_width"].to_numpy(), strain, axis=0) / strain[-1]
    membrane = 0.5 * (mean + mean.T)[np.ix_(order, order)]
    sides = np.array([scene.pattern.wale_spacing, scene.pattern.course_spacing])[order[:2]]
    return held_over_free(membrane, *sides, float(strain[-1]))
