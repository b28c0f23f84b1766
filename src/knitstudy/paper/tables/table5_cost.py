"""Table 5: cost of the models with ties and with isotropic friction, and the paper's numbers for ties."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from knitstudy.measures.cost import MEGABYTE, effort, element_length
from knitstudy.measures.reference import discretisation
from knitstudy.paper.cases import MODELS, OVER_REFERENCE, UNCERTAIN, Case, Simulation, cases_of, label_of
from knitstudy.paper.paper_values import REPORTED, number, reported
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

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
    *(OVER_REFERENCE, UNCERTAIN[OVER_REFERENCE]),
]


@TABLES.add(
    "table5_cost", "Table 5: cost of the models", results={"models": several("simulation", *MODELS)}, order=7
)
def tabulate(models: Datasets, paper: pd.DataFrame, scenes: Scenes, reference: pd.DataFrame) -> pd.DataFrame:
    """Return size, memory and time of the main models of each case, with their distance from the reference.

    Memory growth is the largest resident memory above that of the process just before the simulation. Degrees of
    freedom are counted as in the paper, before ties and joints are eliminated. Ratios are to the direct simulation with
    the paper's element where a case has it, else to the main one.
    """
    rows = [row for case in cases_of(models, scenes, reference) for row in _rows(case, paper)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(case: Case, paper: pd.DataFrame) -> Iterator[dict]:
    direct = [case.by_hexahedra or case.dns]
    direct += [case.dns] if case.dns is not direct[0] else []
    for fidelity in REPORTED:
        for model in direct if fidelity == "dns" else filter(None, [case.main.get(fidelity)]):
            yield _row(fidelity, model, direct[0], case, paper)


def _row(fidelity: str, model: Simulation, first: Simulation, case: Case, paper: pd.DataFrame) -> dict:
    history, cost, dns = model.history, model.history.attrs, first.history.attrs
    ratio = case.reference.force_ratio(history)
    values = {
        "model": f"{label_of(model.scene)}; {case.label}",
        "scene": model.scene.name,
        "element": discretisation(model.scene) if fidelity == "dns" else BEAM,
        "mesh size [m]": model.scene.metres("mesh.size") if fidelity == "dns" else element_length(history),
        "degrees of freedom [1]": int(cost["dof"]),
        "DNS's degrees of freedom over these [1]": dns["dof"] / cost["dof"],
        "memory growth [MB]": cost["memory_growth"] / MEGABYTE,
        "memory peak [MB]": cost["memory_peak"] / MEGABYTE,
        **effort(history),
        "DNS's time over this [1]": dns["wall_seconds"] / cost["wall_seconds"],
        OVER_REFERENCE: ratio.value,
        UNCERTAIN[OVER_REFERENCE]: ratio.uncertainty,
    }
    if (case.interaction, case.direction) == ("tie", "course") and (fidelity != "dns" or model is first):
        for quantity, column in THEIRS.items():
            values[column] = number(paper, "5", REPORTED[fidelity], quantity)
        values["element, paper"] = reported(paper, "5", REPORTED[fidelity], "mesh size")["note"]
    return values
