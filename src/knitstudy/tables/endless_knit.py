"""What square knits tend to as they grow, and one cell of the endless knit between grips."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pandas as pd
import xarray as xr

from knitstudy.loading.load_path import DIRECTIONS
from knitstudy.measures.domain import Series, force_per_width, series_of
from knitstudy.measures.endless_knit import between_grips, cell_of, limit
from knitstudy.measures.response import increment_at
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COLUMNS = [
    "direction",
    "yarns",
    "strain [1]",
    "cells in a row [1]",
    "force over width of the largest knit [N/m]",
    "limit [N/m]",
    "uncertainty of the limit [N/m]",
    "cell",
    "force over width of the cell [N/m]",
    "between grips, over free across [1]",
    "force over width of the cell between grips [N/m]",
    "the same, over the limit [1]",
]


@TABLES.add(
    "endless_knit",
    "One cell of an endless knit beside tied square knits of rising size",
    needs=("squares", "cells", "scenes"),
    order=5.85,
)
def tabulate(
    squares: Mapping[str, xr.Dataset], cells: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return a row for the first and the last strain that all knits of a tied series and its cell were pulled to.

    Parameters
    ----------
    squares, cells : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    tied = [cell for name, cell in scenes.items() if name in cells and not cell.kind.interaction.touches]
    rows = []
    for series in series_of(scenes[name] for name in squares):
        if cell := cell_of(series, tied):
            rows += _rows(series, squares, cell, cells[cell.name])
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(
    series: Series, histories: Mapping[str, xr.Dataset], cell: Scene, history: xr.Dataset
) -> Iterator[tuple]:
    paths = [histories[scene.name] for scene in series.scenes]
    shared = [
        strain
        for strain in history["strain"].to_numpy()[1:]
        if all(increment_at(path, strain) is not None for path in paths)
    ]
    axis = DIRECTIONS.index(cell.load.deformation)
    for strain in dict.fromkeys([*shared[:1], *shared[-1:]]):
        forces = [
            force_per_width(path, scene, increment_at(path, strain))
            for scene, path in zip(series.scenes, paths, strict=True)
        ]
        tends_to, uncertain = limit(series.cells, forces)
        increment = increment_at(history, strain)
        free = float(history["force_per_width"][increment, axis])
        grips = between_grips(history, cell, increment)
        yield (
            cell.load.deformation,
            series.model,
            strain,
            ", ".join(map(str, series.cells)),
            forces[-1],
            tends_to,
            uncertain,
            cell.name,
            free,
            grips,
            grips * free,
            grips * free / tends_to,
        )
