"""Models compared with the reference, and interactions compared with each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures import response
from knitstudy.measures.cost import effort
from knitstudy.measures.reference import INTERACTIONS, is_direct, made_of
from knitstudy.paper.cases import COMPARED, MODELS, Case, cases_of, comparison, is_plain
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several, solid

OF_MODELS = ["model", "scene", "discretisation", *COMPARED]

OVER_FIRST = "stiffness over that of the first beams [1]"

OF_BEAMS = [
    *("model", "scene", *COMPARED, OVER_FIRST),
    *("increments [1]", "Newton iterations [1]", "time [s]"),
]


@TABLES.add(
    "rom_distance", "Models and the reference", results={"models": several("simulation", *MODELS)}, order=1
)
def tabulate_models(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model of each of the four cases: direct simulations and reduced models."""
    rows = [
        {
            "model": f"{case.name_of(model)}; {case.label}",
            "scene": model.scene.name,
            "discretisation": made_of(model.scene) if is_direct(model.scene) else "beams",
            **comparison(model.history, case.dns.history, case.reference),
        }
        for case in cases_of(models, scenes, reference)
        for model in (case.dns, *case.others, *case.reduced)
    ]
    return pd.DataFrame(rows, columns=OF_MODELS)


@TABLES.add(
    "beams", "Beams in contact and solid yarns", results={"models": several("simulation", *MODELS)}, order=8
)
def tabulate_beams(models: Datasets, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model: direct simulation, main 3D reduced model and beams in contact, by direction (Fig. 12b).

    Beams show what each ingredient of their contact changes.
    """
    cases = [case for case in cases_of(models, scenes, reference) if case.beams]
    return pd.DataFrame([row for case in cases for row in _rows_of_beams(case)], columns=OF_BEAMS)


def _rows_of_beams(case: Case) -> Iterator[dict]:
    plain = [model for model in case.beams if is_plain(model.scene)]
    base = response.secant_stiffness(plain[0].history) if plain else np.nan
    beside = [case.main["rom3d"]] if "rom3d" in case.main else []
    for model in (case.dns, *beside, *case.beams):
        history = model.history
        yield {
            "model": f"{case.name_of(model)}; {case.direction}",
            "scene": model.scene.name,
            **comparison(history, case.dns.history, case.reference),
            OVER_FIRST: response.secant_stiffness(history) / base if model in case.beams else np.nan,
            **effort(history),
        }


@TABLES.add(
    "interactions",
    "Ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
        "geometry": solid("geometry", "isotropic-course"),
    },
    order=2,
)
def tabulate_interactions(
    tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset, geometry: xr.Dataset
) -> pd.DataFrame:
    """Return one row an interaction (Figs. 8 and 9), at the largest strain that all have reached."""
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    strain, diameter = response.common_strain(histories.values()), 2 * float(geometry["radius"])
    rows = []
    for name, history in histories.items():
        u_z = response.at_strain(history, strain, response.out_of_plane(history))
        row = {
            "interaction": INTERACTIONS[name],
            "scene": history.attrs.get("scene", ""),
            "strain [1]": strain,
            "force [N]": response.at_strain(history, strain, history["force"].to_numpy()),
            "secant stiffness [N/m]": response.stiffness_at(history, strain),
            "stiffness over tie's [1]": response.stiffness_at(history, strain)
            / response.stiffness_at(tie, strain),
            "largest |u_z| [m]": u_z,
            "largest |u_z| over diameter [1]": u_z / diameter,
            "transverse contraction at full strain [1]": response.transverse_contraction(history),
        }
        rows.append(row | effort(history))
    return pd.DataFrame(rows)
