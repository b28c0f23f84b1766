"""Table 5: what the three models cost with ties and with isotropic friction, beside the paper's numbers for ties."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, Simulation, cases_of
from knitstudy.measures.comparison import OVER_REFERENCE, UNCERTAIN
from knitstudy.measures.cost import MEGABYTE, element_length
from knitstudy.measures.discretisation import discretisation
from knitstudy.measures.names import NAMES
from knitstudy.measures.printed import REPORTED, number, reported
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

BEAM = "beam, 2 nodes, 1 point"


@TABLES.add(
    "table5_cost",
    "Table 5: cost of the models",
    needs=("every", "paper", "scenes", "reference"),
    order=7,
)
def tabulate(
    every: Mapping[str, xr.Dataset],
    paper: pd.DataFrame,
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
) -> pd.DataFrame:
    """Return size, memory and time of the main models of each case.

    Memory growth is the largest resident memory above that of the process just before the simulation. The
    degrees of freedom are counted as the paper does, before ties and joints are eliminated.

    Parameters
    ----------
    every : mapping of str to Dataset
        Histories of knits by scene (see docs/architecture.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``: what cost is to be seen beside.
    """
    rows = [row for case in cases_of(every, scenes, reference) for row in _rows(case, paper)]
    return pd.DataFrame(rows, columns=COLUMNS)


COLUMNS = [
    "model",
    "scene",
    "element",
    "element, paper",
    "mesh size [m]",
    "mesh size, paper [m]",
    "degrees of freedom [1]",
    "degrees of freedom, paper [1]",
    "DNS's degrees of freedom over these [1]",
    "memory growth [MB]",
    "memory peak [MB]",
    "memory, paper [MB]",
    "increments [1]",
    "Newton iterations [1]",
    "time [s]",
    "DNS's time over this [1]",
    OVER_REFERENCE,
    UNCERTAIN[OVER_REFERENCE],
]


def _rows(case: Case, paper: pd.DataFrame) -> Iterator[dict]:
    models = {"dns": case.dns, **case.main}
    for fidelity in REPORTED:
        if fidelity in models:
            yield _row(fidelity, models[fidelity], case, paper)


def _row(fidelity: str, model: Simulation, case: Case, paper: pd.DataFrame) -> dict:
    history, cost, dns = model.history, model.history.attrs, case.dns.history.attrs
    ratio = case.reference.force_ratio(history)
    theirs = _reported(paper, fidelity) if case.interaction == "tie" and case.direction == "course" else {}
    values = {
        "model": f"{NAMES[fidelity]}; {case.label}",
        "scene": model.scene.name,
        "element": discretisation(model.scene) if fidelity == "dns" else BEAM,
        "mesh size [m]": model.scene.value("mesh.size") if fidelity == "dns" else element_length(history),
        "degrees of freedom [1]": int(cost["dof"]),
        "DNS's degrees of freedom over these [1]": dns["dof"] / cost["dof"],
        "memory growth [MB]": cost["memory_growth"] / MEGABYTE,
        "memory peak [MB]": cost["memory_peak"] / MEGABYTE,
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
        "time [s]": cost["wall_seconds"],
        "DNS's time over this [1]": dns["wall_seconds"] / cost["wall_seconds"],
        OVER_REFERENCE: ratio.value,
        UNCERTAIN[OVER_REFERENCE]: ratio.uncertainty,
    }
    return values | theirs


def _reported(paper: pd.DataFrame, fidelity: str) -> dict:
    case = REPORTED[fidelity]
    return {
        "element, paper": reported(paper, "5", case, "mesh size")["note"],
        "mesh size, paper [m]": number(paper, "5", case, "mesh size"),
        "degrees of freedom, paper [1]": int(number(paper, "5", case, "degrees of freedom")),
        "memory, paper [MB]": number(paper, "5", case, "memory"),
    }
