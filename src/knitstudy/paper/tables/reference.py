"""The reference: limits of direct simulations by independent discretisations, and the convergence of each of these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from math import inf, isfinite, nan
from typing import Any

import pandas as pd

from knitstudy.measures.estimate import Common, Limit, common_limit
from knitstudy.measures.reference import RefinementSeries, refinement_series_of
from knitstudy.measures.response import LARGEST_U_Z, QUANTITIES, RMS_U_Z, STRAINS, increment_at
from knitstudy.paper.columns import cells_of
from knitstudy.paper.scene_names import INTERACTIONS
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

REFERENCE_SCENES = several("simulation", "reference-*")  # Increments end at `STRAINS`
RESULTS = {"histories": REFERENCE_SCENES, "contacts": several("contacts", "reference-*")}
# Labels of a row; ``problem`` is the digest of the physical problem.
LABELS = ["problem", "knit", "interaction", "direction", "strain [1]", "quantity", "unit"]

COLUMNS = [
    *LABELS,
    *("value", "uncertainty", "relative uncertainty [1]", "uncertainty from extrapolation"),
    *("uncertainty from disagreement", "mostly from", "discretisations"),
]

# Columns of the values of single simulations, from which the limits follow.
VALUES = ["scene", "strain [1]", "quantity", "unit", "value"]

Refined = list[tuple[RefinementSeries, dict[str, float]]]  # Refinement series with the values of their scenes


@TABLES.add("reference", "The reference: limits of independent discretisations", results=RESULTS, order=16)
def tabulate(histories: Datasets, contacts: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a problem, strain and quantity; one discretisation is enough where others have two.

    The unit is that of the value and of its uncertainties.
    """
    return limits(values_of(histories, contacts), scenes)


@TABLES.add(
    "reference_convergence", "Convergence of the discretisations to the reference", results=RESULTS, order=17
)
def tabulate_series(histories: Datasets, contacts: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a problem, strain, quantity and discretisation, from the coarsest to the finest values."""
    rows = []
    for head, refined in _refined(values_of(histories, contacts), scenes):
        for series, values in refined:
            limit = series.limit(values)
            row = {
                "discretisation": series.name,
                "resolutions": series.described,
                "values": ", ".join(f"{values[scene.name]:.6g}" for scene in series.scenes),
                "limit": limit.value,
                "uncertainty": limit.uncertainty,
                "assumed order [1]": series.order,
                "observed order [1]": limit.order,
            }
            rows.append(head | row)
    return pd.DataFrame(rows)


def values_of(histories: Datasets, contacts: Datasets) -> pd.DataFrame:
    """Return one row a scene, strain at which an increment ends, and quantity that is finite."""
    rows = []
    for name in (name for name in histories if name in contacts):
        places = {strain: increment_at(histories[name], strain) for strain in STRAINS}
        for quantity, (unit, values) in QUANTITIES.items():
            quantity_values = values(histories[name], contacts[name])
            rows += [
                (name, strain, quantity, unit, float(quantity_values[at]))
                for strain, at in places.items()
                if at is not None and isfinite(quantity_values[at])
            ]
    return pd.DataFrame(rows, columns=VALUES)


def limits(values: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return the reference, as `tabulate` does, from values of single simulations (`values_of`).

    Discretisations of one problem may agree by chance: the relative distance of quantities of one kind at one strain is
    the largest of these. A single discretisation has the largest distance between discretisations of other problems.
    """
    known: list[tuple[dict[str, Any], Common, Refined]] = []
    apart: dict[tuple[Any, ...], float] = {}
    single = []
    for head, series in _refined(values, scenes):
        if len(series) > 1:
            known.append((head, common := common_limit(_limits(series)), series))
            share = common.disagreement / abs(common.value or inf)
            for of in ((head["problem"], *_kind(head)), (head["quantity"], head["strain [1]"])):
                apart[of] = max(apart.get(of, 0.0), share)
        else:
            single.append((head, series))
    shares = [apart[head["problem"], *_kind(head)] for head, *_ in known]
    for head, series in single:
        if elsewhere := apart.get((head["quantity"], head["strain [1]"])):
            (limit,) = _limits(series)
            known.append((head, Common(limit.value, limit.uncertainty, 0.0), series))
            shares.append(elsewhere)
    rows = [
        _row(head, replace(common, disagreement=share * abs(common.value)), series)
        for (head, common, series), share in zip(known, shares, strict=True)
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _kind(head: dict[str, Any]) -> tuple[str, float]:
    """Return the kind of a quantity, both of u_z being one, and its strain."""
    quantity = head["quantity"]
    return LARGEST_U_Z if quantity == RMS_U_Z else quantity, head["strain [1]"]


def _limits(refined: Refined) -> list[Limit]:
    return [series.limit(values) for series, values in refined]


def _row(row: dict[str, Any], common: Common, refined: Refined) -> dict[str, Any]:
    return row | {
        "value": common.value,
        "uncertainty": common.uncertainty,
        "relative uncertainty [1]": common.uncertainty / abs(common.value) if common.value else nan,
        "uncertainty from extrapolation": common.extrapolation,
        "uncertainty from disagreement": common.disagreement,
        "mostly from": common.origin,
        "discretisations": "; ".join(f"{series.name} {series.described}" for series, _ in refined),
    }


def _refined(values: pd.DataFrame, scenes: Scenes) -> Iterator[tuple[dict[str, Any], Refined]]:
    """Yield the labels of each row, and its refinement series whose simulations all have a value."""
    by_row = {
        key: dict(zip(of["scene"], of["value"], strict=True))
        for key, of in values.groupby(["quantity", "strain [1]"])
    }
    simulated = set(values["scene"])
    problems = refinement_series_of(scenes[name] for name in scenes if name in simulated)
    for (problem, every), quantity, strain in product(problems.items(), QUANTITIES, STRAINS):
        known = by_row.get((quantity, strain), {})
        refined = []
        for series in every:
            names = [scene.name for scene in series.scenes]
            if known.keys() >= set(names):
                refined.append((series, {name: known[name] for name in names}))
        if any(any(of.values()) for _, of in refined):
            scene = refined[0][0].scenes[0]
            (unit, _) = QUANTITIES[quantity]
            yield (
                {
                    "problem": problem,
                    "knit": cells_of(scene.value("pattern")),
                    "interaction": INTERACTIONS[scene.interaction],
                    "direction": scene.value("load.direction"),
                    "strain [1]": strain,
                    "quantity": quantity,
                    "unit": unit,
                },
                refined,
            )
