"""Cost and response of square knits of rising size."""

from __future__ import annotations

from math import nan

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.cost import MEGABYTE, Series, effort, memory_growth, series_of
from knitstudy.measures.estimate import UNKNOWN
from knitstudy.paper.paper_values import number_if_printed
from knitstudy.paper.unknowns import NONE, SIZES, counted_models
from knitstudy.run.catalogue import SQUARES, TABLES, Datasets, Scenes, one, several

KILOBYTE = 1e3

KNITS = several("simulation", *SQUARES, fewest=12)  # Fewer are not all of Table 3


@TABLES.add("table3_domain_size", "Cost of square knits of rising size", results={"domain": KNITS}, order=5)
def tabulate(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every size of every series."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        dof, memory, seconds = _costs(series, domain)
        over_law = memory / series.memory(dof, memory)(dof)
        for place, scene in enumerate(series.scenes):
            work = effort(domain[scene.name])
            row = {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": int(series.cells[place]),
                "scene": scene.name,
                "degrees of freedom [1]": int(dof[place]),
                "memory growth [MB]": memory[place],
                "memory over its law [1]": over_law[place],
                "memory of an unknown [kB]": memory[place] * MEGABYTE / KILOBYTE / dof[place],
                "time of a Newton iteration [s]": seconds[place],
                "time of a path [s]": work["time [s]"],
            }
            counts = "Newton iterations [1]", "Krylov iterations [1]", "increments [1]"
            rows.append(row | {name: work[name] for name in counts})
    return pd.DataFrame(rows)


@TABLES.add("cost_growth", "How cost grows with the size of a knit", results={"domain": KNITS}, order=5.1)
def tabulate_growth(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every series: exponents of power laws in cells in a row, with their standard errors."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        dof, memory, _ = _costs(series, domain)
        work = pd.DataFrame([effort(domain[scene.name]) for scene in series.scenes])
        costs = {"degrees of freedom": dof, "memory": memory, "time": work["time [s]"]}
        costs |= {name: work[f"{name} [1]"] for name in ("Newton iterations", "Krylov iterations")}
        row = {
            "model": series.model,
            "interaction": series.interaction,
            "cells in a row [1]": f"3 to {series.cells[-1]}",
        }
        for name, values in costs.items():
            # Direct solvers have no Krylov iterations
            grows = series.growth(values) if np.all(values) else UNKNOWN
            row |= {
                f"exponent of {name} [1]": grows.value,
                f"standard error, {name} [1]": grows.uncertainty,
            }
        rows.append(row)
    return pd.DataFrame(rows)


def _costs(series: Series, domain: Datasets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return degrees of freedom (k,), memory growth (k,) [MB] and seconds (k,) of a Newton iteration."""
    histories = [domain[scene.name] for scene in series.scenes]
    iterations = [max(int(history["newton_iterations"].sum()), 1) for history in histories]
    seconds = [float(history["seconds"].sum()) for history in histories]
    return (
        np.array([float(history.attrs["dof"]) for history in histories]),
        np.array([memory_growth(history) for history in histories]) / MEGABYTE,
        np.divide(seconds, iterations),
    )


# ---- Counts without a solution, for Tables 3 and 5


@TABLES.add(
    "counted_unknowns",
    "Tables 3 and 5: degrees of freedom of square knits",
    results={
        "geometry": one("geometry", "dns-tie-course"),
        "squares": several("simulation", *SQUARES, optional=True),
    },
    order=4.9,
)
def tabulate_unknowns(
    geometry: xr.Dataset, scenes: Scenes, paper: pd.DataFrame, squares: Datasets | None = None
) -> pd.DataFrame:
    """Return one row for every model and size of knits of cut cells, counted without a solution.

    Memory follows from its linear law in the unknowns where knits of several sizes were simulated; its uncertainty is
    the largest distance of these from the law.
    """
    models = counted_models(fabric_of(geometry), scenes["geometry"], paper)
    series = {of_model.stem: of_model for of_model in series_of(scenes[name] for name in squares or ())}
    rows = []
    for model in models:
        memory, uncertain = NONE, nan
        if (measured := series.get(f"domain-{model.stem}-course")) is not None:
            dof, grown, _ = _costs(measured, squares)
            memory = measured.memory(dof, grown)
            uncertain = np.abs(grown / memory(dof) - 1).max()
        for n in SIZES:
            of_paper = (paper, "3" if model.case.startswith("c") else "5", model.case.format(n=n))
            unknowns, law = model.unknowns(n), model.law(n)
            printed = number_if_printed(*of_paper, "degrees of freedom")
            rows.append(
                {
                    "model": model.name,
                    "cells in a row [1]": n,
                    "degrees of freedom [1]": round(unknowns),
                    "with multipliers [1]": model.multiplied(n),
                    "degrees of freedom, paper [1]": printed,
                    "the paper's law [1]": law,
                    "over the paper's [1]": unknowns / (printed if np.isnan(law) else law),
                    "memory growth, by its law [MB]": memory(unknowns),
                    "uncertainty of the memory [1]": uncertain,
                    "memory, paper [MB]": number_if_printed(*of_paper, "memory"),
                }
            )
    return pd.DataFrame(rows)
