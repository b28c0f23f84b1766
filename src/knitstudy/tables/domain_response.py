"""How the response of a square knit depends on its size."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.domain import domain_response, series_of
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COLUMNS = [
    "model",
    "interaction",
    "cells in a row [1]",
    "scene",
    "strain [1]",
    "force over width [N/m]",
    "the same, over that of the largest knit [1]",
    "largest |u_z| [m]",
    "mean normal force in the centre cell [N]",
    "the same, over that of the largest knit's [1]",
]


@TABLES.add(
    "domain_response",
    "Response of square knits of rising size",
    needs=("domain", "domain_contacts", "scenes"),
    order=5.7,
)
def tabulate(
    domain: Mapping[str, xr.Dataset], domain_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row for every size of every series.

    Parameters
    ----------
    domain, domain_contacts : mapping of str to Dataset
        Histories by scene, and contacts of the direct simulations among them.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    rows = []
    for series in series_of(scenes.values()):
        found = [domain_response(scene, domain, domain_contacts) for scene in series.scenes]
        largest = found[-1]
        rows += [
            (
                series.model,
                series.interaction,
                int(cells),
                scene.name,
                float(domain[scene.name]["strain"][-1]),
                response.force,
                response.force / largest.force,
                response.out_of_plane,
                response.normal,
                response.normal / largest.normal,
            )
            for cells, scene, response in zip(series.cells, series.scenes, found, strict=True)
        ]
    return pd.DataFrame(rows, columns=COLUMNS)
