"""How far reduced models are from their direct simulations, and these from themselves on another mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, cases_of
from knitstudy.measures.response import comparison, force_distance, out_of_plane_agreement
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES


@TABLES.add(
    "rom_distance",
    "Reduced models and their direct simulations",
    needs=("every", "scenes"),
    order=1,
)
def tabulate(every: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row a model of each of the four cases, the direct simulation on another mesh among them.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    return pd.DataFrame([row for case in cases_of(every, scenes) for row in _rows(case)], columns=COLUMNS)


COLUMNS = [
    "model",
    "scene",
    "strain [1]",
    "force [N]",
    "secant stiffness [N/m]",
    "stiffness over DNS's [1]",
    "L2 distance of force to DNS [1]",
    "distance over that of DNS's meshes [1]",
    "largest |u_z| [m]",
    "correlation of u_z with DNS [1]",
    "amplitude of u_z over DNS's [1]",
]


def _rows(case: Case) -> Iterator[dict]:
    dns = case.dns.history
    other_mesh = [case.other_mesh] if case.other_mesh else []
    between_meshes = force_distance(case.other_mesh.history, dns) if case.other_mesh else np.nan
    for model in (case.dns, *other_mesh, *case.reduced):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            **comparison(history, dns),
            "distance over that of DNS's meshes [1]": force_distance(history, dns) / between_meshes,
            "amplitude of u_z over DNS's [1]": out_of_plane_agreement(history, dns).amplitude,
        }
