"""Beams in contact beside solid yarns (Fig. 12b), and what each ingredient of their contact changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, cases_of, is_plain
from knitstudy.measures.response import comparison, secant_stiffness
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COLUMNS = [
    "model",
    "scene",
    "strain [1]",
    "force [N]",
    "secant stiffness [N/m]",
    "stiffness over DNS's [1]",
    "stiffness over that of the first beams [1]",
    "L2 distance of force to DNS [1]",
    "largest |u_z| [m]",
    "correlation of u_z with DNS [1]",
    "increments [1]",
    "Newton iterations [1]",
    "time [s]",
]


@TABLES.add(
    "beams",
    "Beams in contact and solid yarns",
    needs=("every", "scenes"),
    order=8,
)
def tabulate(every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model, and beams in contact, by direction.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    rows = [row for case in cases_of(every, scenes) if case.beams for row in _rows(case)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(case: Case) -> Iterator[dict]:
    dns = case.dns.history
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(history, dns),
            "stiffness over that of the first beams [1]": (
                secant_stiffness(history) / base if model in case.beams else np.nan
            ),
            "increments [1]": history.sizes["increment"] - 1,
            "Newton iterations [1]": int(history["newton_iterations"].sum()),
            "time [s]": history.attrs["wall_seconds"],
        }
