"""Table 3: cost and response of square knits of rising size, beside the paper's numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd

from knitstudy.measures.catalogue import SQUARES, Datasets, Scenes, several
from knitstudy.measures.cost import (
    MEGABYTE,
    Series,
    domain_response,
    effort,
    memory_growth,
    series_of,
)
from knitstudy.measures.discretisation import is_direct
from knitstudy.measures.paper_values import number_if_printed
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

KILOBYTE = 1e3

UNKNOWNS, MEMORY = "degrees of freedom, paper [1]", "memory, paper [MB]"

COLUMNS = [
    *("model", "interaction", "cells in a row [1]", "scene", "degrees of freedom [1]", UNKNOWNS),
    *("memory growth [MB]", MEMORY, "memory over its law [1]", "memory of an unknown [kB]"),
    *("time of a Newton iteration [s]", "time of a path [s]", "Newton iterations [1]", "increments [1]"),
]

LARGEST = 30  # Cells in a row of the paper's largest knit
KNITS = several("simulation", *SQUARES, fewest=12)  # Fewer are not all of Table 3


@TABLES.add(
    "table3_domain_size", "Table 3: cost of square knits of rising size", results={"domain": KNITS}, order=5
)
def tabulate(domain: Datasets, scenes: Scenes, paper: pd.DataFrame) -> pd.DataFrame:
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
            rows.append(row | work | (_of_paper(scene, paper) if is_direct(scene) else {}))
    return pd.DataFrame(rows, columns=COLUMNS)


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


def _of_paper(scene: Scene, paper: pd.DataFrame) -> dict:
    size = f"c{scene.pattern.loops}w{scene.pattern.rows}"
    if scene.interaction == "tie":
        return {UNKNOWNS: number_if_printed(paper, "fig12a", f"{size} tie", "degrees of freedom")}
    return {
        UNKNOWNS: number_if_printed(paper, "3", size, "degrees of freedom"),
        MEMORY: number_if_printed(paper, "3", size, "memory"),
    }


@TABLES.add(
    "domain_growth", "Growth of cost with the size of the domain", results={"domain": KNITS}, order=5.5
)
def tabulate_growth(domain: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every series: how unknowns, memory and time grow."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        dof, memory, seconds = _costs(series, domain)
        paths = [float(domain[scene.name].attrs["wall_seconds"]) for scene in series.scenes]
        largest = series.memory(dof, memory)(series.unknowns(dof)(LARGEST))
        rows.append(
            {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": ", ".join(map(str, series.cells)),
                "exponent of degrees of freedom [1]": series.growth(dof),
                "exponent of memory growth [1]": series.growth(memory),
                "exponent of the time of a Newton iteration [1]": series.growth(seconds),
                "exponent of the time of a path [1]": series.growth(paths),
                "memory growth of 30 x 30 cells, by its law [MB]": largest,
            }
        )
    return pd.DataFrame(rows)


@TABLES.add(
    "domain_response",
    "Response of square knits of rising size",
    results={"domain": KNITS, "domain_contacts": several("contacts", *SQUARES)},
    order=5.7,
)
def tabulate_response(domain: Datasets, domain_contacts: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row for every size of every series; contacts are those of the direct simulations."""
    rows = []
    for series in series_of(scenes[name] for name in domain):
        found = [domain_response(scene, domain, domain_contacts) for scene in series.scenes]
        largest = found[-1]
        rows += [
            {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": int(cells),
                "scene": scene.name,
                "strain [1]": float(domain[scene.name]["strain"][-1]),
                "force over width [N/m]": response.force,
                "the same, over that of the largest knit [1]": response.force / largest.force,
                "largest |u_z| [m]": response.out_of_plane,
                "mean normal force in the centre cell [N]": response.normal,
                "the same, over that of the largest knit's [1]": response.normal / largest.normal,
            }
            for cells, scene, response in zip(series.cells, series.scenes, found, strict=True)
        ]
    return pd.DataFrame(rows)
