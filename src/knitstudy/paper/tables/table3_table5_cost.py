"""Tables 3 and 5: cost and response of square knits of rising size, and cost of the models."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.estimate import UNKNOWN
from knitstudy.measures.factor import factor_size
from knitstudy.measures.reference import discretisation
from knitstudy.measures.response import MEGABYTE
from knitstudy.paper.cases import (
    MODELS,
    OVER_REFERENCE,
    REPORTED,
    UNCERTAIN,
    Case,
    cases_of,
    label_of,
    number,
    number_if_printed,
    reported,
)
from knitstudy.paper.columns import (
    DOF,
    EFFORT,
    GROWTH,
    INCREMENTS,
    KRYLOV,
    MEMORY,
    NEWTON,
    SCENE,
    TIME,
    Column,
    Simulation,
    beam_length,
    rows_of,
    tabulated,
)
from knitstudy.paper.scene_names import KNIT, SQUARES
from knitstudy.paper.square_knits import (
    CELLS,
    COUNTED,
    FACTOR,
    FACTOR_MULTIPLIED,
    FRONT,
    MULTIPLIED,
    NONE,
    SIZES,
    Series,
    counted_models,
    series_of,
)
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

KNITS = several("simulation", *SQUARES, fewest=10)  # Fewer are not all of Table 3

PER_ITERATION = Column(
    "time of a Newton iteration",
    "s",
    lambda history: float(history["seconds"].sum()) / max(int(history["newton_iterations"].sum()), 1),
)


def _costs(series: Series) -> pd.DataFrame:
    """Return a row for every size of a series: degrees of freedom, memory and its law, and time."""
    costs = tabulated(series.rows, (SCENE, DOF, GROWTH, PER_ITERATION, TIME, NEWTON, KRYLOV, INCREMENTS))
    law = series.memory(costs[DOF.head].to_numpy(), costs[GROWTH.head].to_numpy())
    costs.insert(3, "memory over its law [1]", costs[GROWTH.head] / law(costs[DOF.head]))
    return costs


@TABLES.add("table3_domain_size", "Cost of square knits of rising size", results={"domain": KNITS}, order=5)
def tabulate_size(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every size of every series."""
    parts = []
    for series in series_of(rows_of(scenes, domain).values()):
        costs = _costs(series).rename(columns={TIME.head: "time of a path [s]"})
        costs.insert(4, "memory of an unknown [kB]", costs[GROWTH.head] * MEGABYTE / 1e3 / costs[DOF.head])
        head = {"model": series.model, "interaction": series.interaction, "cells in a row [1]": series.cells}
        parts.append(pd.concat([pd.DataFrame(head), costs], axis=1))
    return pd.concat(parts, ignore_index=True)


@TABLES.add("cost_growth", "How cost grows with the size of a knit", results={"domain": KNITS}, order=5.1)
def tabulate_growth(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every series: exponents of power laws in cells in a row, with their standard errors."""
    rows = []
    for series in series_of(rows_of(scenes, domain).values()):
        costs = _costs(series)
        row: dict[str, Any] = {"model": series.model, "interaction": series.interaction}
        row["cells in a row [1]"] = f"3 to {series.cells[-1]}"
        for column in (DOF, GROWTH, TIME, NEWTON, KRYLOV):
            name = column.name.removesuffix(" growth")
            values = costs[column.head].tolist()
            # Direct solvers have no Krylov iterations
            grows = series.growth(values) if np.all(values) else UNKNOWN
            row[f"exponent of {name} [1]"] = grows.value
            row[f"standard error, {name} [1]"] = grows.uncertainty
        rows.append(row)
    return pd.DataFrame(rows)


# ---- Counts without a solution, for Tables 3 and 5


@TABLES.add(
    COUNTED,
    "Tables 3 and 5: degrees of freedom and memory of square knits",
    results={"geometry": KNIT, "squares": several("simulation", *SQUARES, optional=True)},
    order=4.9,
)
def tabulate_unknowns(
    geometry: xr.Dataset, scenes: Scenes, paper: pd.DataFrame, squares: Datasets | None = None
) -> pd.DataFrame:
    """Return one row for every model and size of knits of cut cells, counted without a solution.

    The memory of a direct solver is that of its largest front and of its factor (`measures.factor`). Memory of runs
    follows from its linear law in the unknowns where knits of several sizes were simulated; its uncertainty is the
    largest distance of these from the law.
    """
    series = {of_model.stem: of_model for of_model in series_of(rows_of(scenes, squares or {}).values())}
    rows = []
    for model in counted_models(fabric_of(geometry), paper):
        memory, uncertain = NONE, nan
        if (measured := series.get(f"domain-{model.stem}-course")) is not None:
            costs = _costs(measured)
            memory = measured.memory(costs[DOF.head].to_numpy(), costs[GROWTH.head].to_numpy())
            uncertain = np.abs(costs["memory over its law [1]"] - 1).max()
        for n in SIZES:
            of_paper = (paper, "3" if model.case.startswith("c") else "5", model.case.format(n=n))
            unknowns, law = model.unknowns(n), model.law(n)
            printed = number_if_printed(*of_paper, "degrees of freedom")
            own, *with_multipliers = map(factor_size, model.graphs(n))
            rows.append(
                {
                    "model": model.name,
                    CELLS: n,
                    DOF.head: round(unknowns),
                    MULTIPLIED: model.multiplied(n),
                    "degrees of freedom, paper [1]": printed,
                    "the paper's law [1]": law,
                    "over the paper's [1]": unknowns / (printed if np.isnan(law) else law),
                    FRONT: own.front_bytes / MEGABYTE,
                    FACTOR: own.factor_bytes / MEGABYTE,
                    FACTOR_MULTIPLIED: with_multipliers[0].factor_bytes / MEGABYTE
                    if with_multipliers
                    else nan,
                    "memory, paper [MB]": number_if_printed(*of_paper, "memory"),
                    "memory growth of runs, by its law [MB]": memory(unknowns),
                    "uncertainty of that growth [1]": uncertain,
                }
            )
    return pd.DataFrame(rows)


# ---- Table 5: models with ties and with isotropic friction, and the paper's numbers for ties

BEAM = "beam, 2 nodes, 1 point"

THEIRS = {
    "mesh size": "mesh size, paper [m]",
    "degrees of freedom": "degrees of freedom, paper [1]",
    "memory": "memory, paper [MB]",
}
COLUMNS = [
    *("model", "scene", "element", "element, paper", "mesh size [m]", "mesh size, paper [m]"),
    *("degrees of freedom [1]", "degrees of freedom, paper [1]", "DNS's degrees of freedom over these [1]"),
    *("memory growth [MB]", "memory peak [MB]", "memory, paper [MB]", "increments [1]"),
    *("Newton iterations [1]", "time [s]", "DNS's time over this [1]"),
    *(OVER_REFERENCE, UNCERTAIN),
]


@TABLES.add(
    "table5_cost", "Table 5: cost of the models", results={"models": several("simulation", *MODELS)}, order=7
)
def tabulate_cost(
    models: Datasets, paper: pd.DataFrame, scenes: Scenes, reference: pd.DataFrame
) -> pd.DataFrame:
    """Return size, memory and time of the main models of each case, with their distance from the reference.

    Memory growth is the largest resident memory above that of the process just before the simulation. Degrees of
    freedom are counted as in the paper, before ties and joints are eliminated. Ratios are to the direct simulation with
    the paper's element where a case has it, else to the main one.
    """
    rows = [row for case in cases_of(rows_of(scenes, models), reference) for row in _rows(case, paper)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(case: Case, paper: pd.DataFrame) -> Iterator[dict[str, Any]]:
    direct = [case.by_hexahedra or case.dns]
    direct += [case.dns] if case.dns is not direct[0] else []
    for fidelity in REPORTED:
        for model in direct if fidelity == "dns" else filter(None, [case.main.get(fidelity)]):
            yield _row(fidelity, model, direct[0], case, paper)


def _row(
    fidelity: str, model: Simulation, first: Simulation, case: Case, paper: pd.DataFrame
) -> dict[str, Any]:
    history = model.history
    cost = model.history.attrs
    dns = first.history.attrs
    ratio = case.ratio(model)
    values = {
        "model": f"{label_of(model.scene)}; {case.label}",
        "scene": model.scene.name,
        "element": discretisation(model.scene.value("mesh")) if fidelity == "dns" else BEAM,
        "mesh size [m]": model.scene.metres("mesh.size") if fidelity == "dns" else beam_length(history),
        DOF.head: model[DOF],
        "DNS's degrees of freedom over these [1]": dns["dof"] / cost["dof"],
        MEMORY.head: model[MEMORY],
        "memory peak [MB]": cost["memory_peak"] / MEGABYTE,
        **model.cells(EFFORT),
        "DNS's time over this [1]": dns["wall_seconds"] / cost["wall_seconds"],
        OVER_REFERENCE: ratio.value,
        UNCERTAIN: ratio.uncertainty,
    }
    if (case.interaction, case.direction) == ("tie", "course") and (fidelity != "dns" or model is first):
        for quantity, column in THEIRS.items():
            values[column] = number(paper, "5", REPORTED[fidelity], quantity)
        values["element, paper"] = reported(paper, "5", REPORTED[fidelity], "mesh size")["note"]
    return values
