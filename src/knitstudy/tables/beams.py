"""Beams in contact beside solid yarns (Fig. 12b), and what each ingredient of their contact changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, cases_of, is_plain
from knitstudy.measures.comparison import COLUMNS as COMPARED
from knitstudy.measures.comparison import comparison
from knitstudy.measures.response import secant_stiffness
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COLUMNS = [
    "model",
    "scene",
    *COMPARED,
    "stiffness over that of the first beams [1]",
    "increments [1]",
    "Newton iterations [1]",
    "time [s]",
]


@TABLES.add(
    "beams",
    "Beams in contact and solid yarns",
    needs=("every", "scenes", "reference"),
    order=8,
)
def tabulate(
    every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model, and beams in contact, by direction.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [row for case in cases_of(every, scenes, reference) if case.beams for row in _rows(case)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(case: Case) -> Iterator[dict]:
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(history, case.dns.history, case.reference),
            "stiffness over that of the first beams [1]": (
                secant_stiffness(history) / base if model in case.beams else np.nan
            ),
            "increments [1]": history.sizes["increment"] - 1,
            "Newton iterations [1]": int(history["newton_iterations"].sum()),
            "time [s]": history.attrs["wall_seconds"],
        }
