"""The reference: limits of direct simulations by independent discretisations, and how each of these tends there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

import pandas as pd
import xarray as xr

from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.estimate import common_limit
from knitstudy.measures.reference import RefinementSeries, refinement_series_of
from knitstudy.measures.response import QUANTITIES, STRAINS, increment_at
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

SAID = ["problem", "knit", "interaction", "direction", "strain [1]", "quantity", "unit"]
"""What a row is of; ``problem`` is the digest by which models find it (`knitstudy.measures.discretisation`)."""

COLUMNS = [
    *SAID,
    "value",
    "uncertainty",
    "relative uncertainty [1]",
    "uncertainty from extrapolation",
    "uncertainty from disagreement",
    "mostly from",
    "ways",
]

VALUES = ["scene", "strain [1]", "quantity", "unit", "value"]
"""What single simulations give: limits are drawn from nothing else."""

OF_WAYS = [
    *SAID,
    "way",
    "resolutions",
    "values",
    "limit",
    "uncertainty",
    "assumed order [1]",
    "observed order [1]",
]


@TABLES.add(
    "reference",
    "The reference: limits of independent discretisations",
    needs=("ways", "ways_contacts", "scenes"),
    order=16,
)
def tabulate(
    ways: Mapping[str, xr.Dataset], ways_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row a problem, strain and quantity; problems with fewer than two ways have none.

    The unit is that of the value and of its uncertainties.

    Parameters
    ----------
    ways, ways_contacts : mapping of str to Dataset
        Histories and contacts of direct simulations whose increments end at `quantities.STRAINS`, by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    return limits(values_of(ways, ways_contacts), scenes)


@TABLES.add(
    "reference_ways",
    "How discretisations tend to the reference",
    needs=("ways", "ways_contacts", "scenes"),
    order=17,
)
def tabulate_ways(
    ways: Mapping[str, xr.Dataset], ways_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row a problem, strain, quantity and discretisation, from the coarsest to the finest values.

    Parameters
    ----------
    ways, ways_contacts, scenes
        As of `tabulate`.
    """
    values = values_of(ways, ways_contacts)
    rows = [_row_of(said, *of) for said, found in _found(values, scenes) for of in found]
    return pd.DataFrame(rows, columns=OF_WAYS)


def values_of(histories: Mapping[str, xr.Dataset], contacts: Mapping[str, xr.Dataset]) -> pd.DataFrame:
    """Return what simulations give: one row a scene, strain that an increment ends at, and quantity that is finite.

    Parameters
    ----------
    histories, contacts : mapping of str to Dataset
        By scene.
    """
    rows = []
    for name in (name for name in histories if name in contacts):
        places = {strain: increment_at(histories[name], strain) for strain in STRAINS}
        for quantity, (unit, values) in QUANTITIES.items():
            found = values(histories[name], contacts[name])
            rows += [
                (name, strain, quantity, unit, float(found[at]))
                for strain, at in places.items()
                if at is not None and isfinite(found[at])
            ]
    return pd.DataFrame(rows, columns=VALUES)


def limits(values: pd.DataFrame, scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return the reference, as `tabulate` does, from values of single simulations (`values_of`)."""
    rows = [_row(said, found) for said, found in _found(values, scenes) if len(found) > 1]
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(said: dict, found: list[tuple[RefinementSeries, dict[str, float]]]) -> dict:
    common = common_limit([way.limit(values) for way, values in found])
    return said | {
        "value": common.value,
        "uncertainty": common.uncertainty,
        "relative uncertainty [1]": common.uncertainty / abs(common.value) if common.value else float("nan"),
        "uncertainty from extrapolation": common.extrapolation,
        "uncertainty from disagreement": common.disagreement,
        "mostly from": common.origin,
        "ways": "; ".join(f"{way.name} {way.said}" for way, _ in found),
    }


def _row_of(said: dict, way: RefinementSeries, values: dict[str, float]) -> dict:
    limit = way.limit(values)
    return said | {
        "way": way.name,
        "resolutions": way.said,
        "values": ", ".join(f"{values[scene.name]:.6g}" for scene in way.scenes),
        "limit": limit.value,
        "uncertainty": limit.uncertainty,
        "assumed order [1]": way.order,
        "observed order [1]": limit.order,
    }


def _found(
    values: pd.DataFrame, scenes: Mapping[str, Scene]
) -> Iterator[tuple[dict, list[tuple[RefinementSeries, dict[str, float]]]]]:
    """Yield what each row is of, and the ways to it whose simulations all have a value."""
    simulated = set(values["scene"])
    by_row = {
        key: dict(zip(of["scene"], of["value"], strict=True))
        for key, of in values.groupby(["quantity", "strain [1]"])
    }
    for problem, ways in refinement_series_of(scenes[name] for name in scenes if name in simulated).items():
        for quantity, (unit, _) in QUANTITIES.items():
            for strain in STRAINS:
                known = by_row.get((quantity, strain), {})
                found = [
                    (way, {scene.name: known[scene.name] for scene in way.scenes})
                    for way in ways
                    if known.keys() >= {scene.name for scene in way.scenes}
                ]
                if found and any(any(of.values()) for _, of in found):
                    yield _said(found[0][0].scenes[0], problem, strain, quantity, unit), found


def _said(scene: Scene, problem: str, strain: float, quantity: str, unit: str) -> dict:
    return {
        "problem": problem,
        "knit": f"{scene.pattern.loops} x {scene.pattern.rows}",
        "interaction": INTERACTIONS[scene.interaction],
        "direction": scene.load.direction,
        "strain [1]": strain,
        "quantity": quantity,
        "unit": unit,
    }
