"""Table 3: what models cost as the domain grows, beside the paper's numbers, and how they grow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.discretisation import is_direct
from knitstudy.measures.domain import Series, domain_response, seconds_a_newton_iteration, series_of
from knitstudy.measures.paper_values import number_if_printed
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

UNKNOWNS, MEMORY, SECONDS = "degrees of freedom [1]", "memory growth [MB]", "time of a Newton iteration [s]"

KILOBYTE = 1e3

COLUMNS = [
    "model",
    "interaction",
    "cells in a row [1]",
    "scene",
    UNKNOWNS,
    "degrees of freedom, paper [1]",
    MEMORY,
    "memory, paper [MB]",
    "memory over its law [1]",
    "memory of an unknown [kB]",
    SECONDS,
    "time of a path [s]",
    "Newton iterations [1]",
    "increments [1]",
]

GROWTH = [
    "model",
    "interaction",
    "cells in a row [1]",
    "exponent of degrees of freedom [1]",
    "exponent of memory growth [1]",
    "exponent of the time of a Newton iteration [1]",
    "exponent of the time of a path [1]",
    "memory growth of 30 x 30 cells, by its law [MB]",
]

LARGEST = 30
"""Cells in a row of the paper's largest knit."""


@TABLES.add(
    "table3_domain_size",
    "Table 3: cost of square knits of rising size",
    needs=("domain", "scenes", "paper"),
    order=5,
)
def tabulate(
    domain: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], paper: pd.DataFrame
) -> pd.DataFrame:
    """Return one row for every size of every series.

    Parameters
    ----------
    domain : mapping of str to Dataset
        Histories by scene.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    """
    rows = [row for series in series_of(scenes.values()) for row in _rows(series, domain, paper)]
    return pd.DataFrame(rows, columns=COLUMNS)


@TABLES.add(
    "domain_growth",
    "Growth of cost with the size of the domain",
    needs=("domain", "scenes"),
    order=5.5,
)
def tabulate_growth(domain: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one row for every series: how unknowns, memory and time grow.

    Parameters
    ----------
    domain, scenes
        As of `tabulate`.
    """
    rows = []
    for series in series_of(scenes.values()):
        dof, memory, seconds = _costs(series, domain)
        laws = [series.growth(values) for values in (dof, memory, seconds)]
        rows.append(
            {
                "model": series.model,
                "interaction": series.interaction,
                "cells in a row [1]": ", ".join(map(str, series.cells)),
                "exponent of degrees of freedom [1]": laws[0].exponent,
                "exponent of memory growth [1]": laws[1].exponent,
                "exponent of the time of a Newton iteration [1]": laws[2].exponent,
                "exponent of the time of a path [1]": series.growth(_seconds(series, domain)).exponent,
                "memory growth of 30 x 30 cells, by its law [MB]": series.memory(dof, memory).at(
                    series.unknowns(dof).at(LARGEST)
                ),
            }
        )
    return pd.DataFrame(rows, columns=GROWTH)


def _seconds(series: Series, domain: Mapping[str, xr.Dataset]) -> list[float]:
    return [float(domain[scene.name].attrs["wall_seconds"]) for scene in series.scenes]


def _costs(series: Series, domain: Mapping[str, xr.Dataset]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return degrees of freedom (k,), memory growth (k,) [MB] and seconds (k,) of a Newton iteration."""
    histories = [domain[scene.name] for scene in series.scenes]
    return (
        np.array([float(history.attrs["dof"]) for history in histories]),
        np.array([memory_growth(history) for history in histories]) / MEGABYTE,
        np.array([seconds_a_newton_iteration(history) for history in histories]),
    )


def _rows(series: Series, domain: Mapping[str, xr.Dataset], paper: pd.DataFrame) -> Iterator[dict]:
    dof, memory, seconds = _costs(series, domain)
    law = series.memory(dof, memory)
    for place, (cells, scene) in enumerate(zip(series.cells, series.scenes, strict=True)):
        history = domain[scene.name]
        row = {
            "model": series.model,
            "interaction": series.interaction,
            "cells in a row [1]": int(cells),
            "scene": scene.name,
            UNKNOWNS: int(dof[place]),
            MEMORY: memory[place],
            "memory over its law [1]": memory[place] / law.at(dof[place]),
            "memory of an unknown [kB]": memory[place] * MEGABYTE / KILOBYTE / dof[place],
            SECONDS: seconds[place],
            "time of a path [s]": history.attrs["wall_seconds"],
            "Newton iterations [1]": int(history["newton_iterations"].sum()),
            "increments [1]": history.sizes["increment"] - 1,
        }
        yield row | (_of_paper(scene, paper) if is_direct(scene) else {})


def _of_paper(scene: Scene, paper: pd.DataFrame) -> dict:
    size = f"c{scene.pattern.loops}w{scene.pattern.rows}"
    if scene.interaction == "tie":
        return {
            "degrees of freedom, paper [1]": number_if_printed(
                paper, "fig12a", f"{size} tie", "degrees of freedom"
            )
        }
    return {
        "degrees of freedom, paper [1]": number_if_printed(paper, "3", size, "degrees of freedom"),
        "memory, paper [MB]": number_if_printed(paper, "3", size, "memory"),
    }


# ---- How the response of a square knit depends on its size


RESPONSE = [
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
def tabulate_response(
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
    return pd.DataFrame(rows, columns=RESPONSE)
