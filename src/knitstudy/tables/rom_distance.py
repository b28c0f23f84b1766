"""How far models are from the reference: direct simulations on their meshes, and reduced models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, cases_of
from knitstudy.measures.comparison import COLUMNS as COMPARED
from knitstudy.measures.comparison import comparison
from knitstudy.measures.discretisation import is_direct, made_of
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES


@TABLES.add(
    "rom_distance",
    "Models and the reference",
    needs=("every", "scenes", "reference"),
    order=1,
)
def tabulate(
    every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a model of each of the four cases, the direct simulation on another mesh among them.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [row for case in cases_of(every, scenes, reference) for row in _rows(case)]
    return pd.DataFrame(rows, columns=COLUMNS)


COLUMNS = ["model", "scene", "discretisation", *COMPARED]


def _rows(case: Case) -> Iterator[dict]:
    for model in (case.dns, *case.others, *case.reduced):
        yield {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            "discretisation": made_of(model.scene) if is_direct(model.scene) else "beams",
            **comparison(model.history, case.dns.history, case.reference),
        }
