"""Errors and prices of all model settings on a knit, measured (docs/notes/accuracy.md).

`measure` takes a knit of the user; ``benchmarks/trade.py`` takes the knits of the sample. The reference value of a
quantity is the limit of solid yarns of rising degree; a run that fails, or exceeds its time, has an infinite error.
"""

from __future__ import annotations

import resource
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, replace
from functools import partial
from math import inf, nan
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pandas as pd

from knitstudy.datasets import read_table, write_table
from knitstudy.errors import ConfigurationError, DataFileError, message_of
from knitstudy.interruption import end_with_parent
from knitstudy.knit.loading.run import Progress
from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.estimate import Estimate, limit_of_degrees
from knitstudy.measures.questions import QUESTIONS, answers, known
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import MEGABYTE, memory_growth
from knitstudy.run.advice import COLUMNS, ERROR, MEMORY, OF_OWN, OWN, SECONDS, measured_rows
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import SampleCase, Trade
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate

FEW = 3  # Knits of the highest degree that say how far the next one is off

REACHED = 1 - 1e-6  # Share of the strain that a history has to reach

Record = dict[str, Any]
"""Values by quantity, price and reason of failure of one run; inputs, case, model setting and knit that it is of."""


def run(problem: PhysicalProblem, setting: str, folder: Path, say: bool = False) -> Record:
    """Return the record of a problem by one model setting, in a process with a limit of processor time."""
    record = {
        "model setting": setting,
        "values": {},
        "seconds": nan,
        "memory": nan,
        "unknowns": 0,
        "increments": 0,
    }
    scene = problem.scene
    limit = problem.trade.limit
    keys = problem.trade.settings_of(problem.case)[setting]
    try:
        document = scene.vary(keys | {"name": f"{scene.name}-{setting}", "outputs": []}).to_dict()
        with ProcessPoolExecutor(1, get_context("fork"), end_with_parent) as pool:
            return record | pool.submit(_run, document, limit, folder, say).result()
    except ConfigurationError as error:
        return record | {"reason": message_of(error)}
    except BrokenProcessPool:
        return record | {"reason": f"took more than {limit:g} s of processor time, or the memory"}


def _run(document: Mapping[str, Any], limit: float, folder: Path, say: bool) -> Record:
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    scene = Scene.from_dict(document)
    try:
        results = simulate(scene, folder, plan=Plan({}), progress=Progress if say else None)
    except Exception as error:  # whatever it is: the run has no result
        return {"reason": message_of(error)}
    history = results.history
    strain = scene.value("load.strain")
    if float(history["strain"][-1]) < REACHED * strain:
        return {"reason": f"ended at a strain of {float(history['strain'][-1]):g}, not {strain:g}"}
    values: dict[str, float] = {}
    for question in QUESTIONS.values():
        values |= answers(question, scene, history, results.contacts, strain)
    return {
        "values": values,
        "seconds": float(history.attrs["processor_seconds"]),
        "memory": memory_growth(history) / MEGABYTE,
        "unknowns": int(history.attrs["unknowns"]),
        "increments": history.sizes["increment"] - 1,
        "reason": "",
    }


def _relative(value: float, true: float) -> float:
    return abs(value / true - 1)


def rows_of(
    records: Iterable[Record], case: SampleCase, about: Mapping[str, Any], trade: Trade, reference: Reference
) -> list[dict[str, Any]]:
    """Return a row for every model setting and question of one knit, or one with the reason of no reference."""
    rows = []
    settings = trade.settings_of(case)
    for record in records:
        for question in QUESTIONS.values():
            off = {}
            for quantity in question.by.get(settings[record["model setting"]]["fidelity"], ()):
                if (true := known(reference, quantity, 1.0)).known:
                    value = record["values"].get(quantity, inf)
                    miss = true.of(partial(_relative, value))
                    off[quantity] = (inf if record["reason"] else miss.value + miss.uncertainty, true)
            if not off:
                continue
            quantity = max(off, key=lambda name: off[name][0])
            error, true = off[quantity]
            price = {SECONDS: record["seconds"], MEMORY: record["memory"]}
            size = {"unknowns [1]": record["unknowns"], "increments [1]": record["increments"]}
            share = {"uncertainty of the reference value [1]": true.uncertainty / true.value}
            remarks = {"reason": record["reason"], "value [SI]": record["values"].get(quantity)}
            of = {
                "case": str(case),
                "model setting": record["model setting"],
                "question": question.name,
                "quantity": quantity,
            }
            rows.append({**about, **of, ERROR: error, **price, **size, **share, **remarks})
    if rows:
        return rows
    failed = "; ".join(f"{run['model setting']}: {run['reason']}" for run in records if run["reason"])
    reason = f"the reference value takes two of {', '.join(trade.reference)}, which did not end: {failed}"
    return [{**about, "case": str(case), "model setting": "", "question": "", "reason": reason}]


def reference_values(
    runs: Mapping[str, Mapping[str, Mapping[str, float]]], case: SampleCase, trade: Trade
) -> dict[str, Reference]:
    """Return the reference values of every knit, at strain 1 for full load, from runs {knit: {model setting: values}}.

    That is the limit of the settings `reference` of config/trade.yaml, where two or more have ended. Where the highest
    degree did not run, it is the next one, as uncertain as that is far from the limit at most on the knits of both that
    have such a reference value, if they are `FEW` or more.
    """
    settings = trade.settings_of(case)
    degrees = {name: settings[name].get("mesh.degree", 2) for name in trade.reference if name in settings}
    *_, next_to, highest = degrees
    limits: dict[str, dict[tuple[str, float], Estimate]] = {}
    far: dict[str, list[float]] = {}
    for knit, values in runs.items():
        ended = [name for name in degrees if values.get(name)]
        limits[knit] = _limits([values[name] for name in ended], [degrees[name] for name in ended])
        if ended[-2:] == [next_to, highest]:
            for quantity, off in _errors(values[next_to], limits[knit]).items():
                far.setdefault(quantity, []).append(off)
    for knit, limit_of_knit in limits.items():
        for (quantity, strain), limit in limit_of_knit.items():
            if not runs[knit].get(highest) and len(far.get(quantity, ())) >= FEW:
                uncertainty = max(far[quantity]) * abs(limit.value)
                limit_of_knit[quantity, strain] = Estimate(limit.value, uncertainty)
    return {knit: Reference(limit_of_knit) for knit, limit_of_knit in limits.items()}


def _errors(values: Mapping[str, float], limits: Mapping[tuple[str, float], Estimate]) -> dict[str, float]:
    """Return how far values are off their limits at most, as a share; of limits that others are compared with."""
    return {
        quantity: (abs(values[quantity] - limit.value) + limit.uncertainty) / limit.value
        for (quantity, strain), limit in limits.items()
        if known(Reference(dict(limits)), quantity, strain).known
    }


def _limits(
    values: Sequence[Mapping[str, float]], degrees: Sequence[int]
) -> dict[tuple[str, float], Estimate]:
    """Return the limits, at full load, of quantities whose values have two degrees or more."""
    limits = {}
    for quantity in values[0] if len(values) > 1 else ():
        series = [each[quantity] for each in values]
        found = limit_of_degrees(degrees, series)
        limit = Estimate(found.value, found.uncertainty)
        change = abs(series[-1] - series[-2])
        if abs(limit.value - series[-1]) > change:  # values that hardly converge cannot be extrapolated
            limit = Estimate(series[-1], change)
        limits[quantity, 1.0] = limit
    return limits


def collect(
    trade: Trade,
    problems: Mapping[tuple[str, SampleCase], PhysicalProblem],
    records: Mapping[tuple[str, SampleCase], list[Record]],
) -> pd.DataFrame:
    """Return the table of errors and prices from the problems and the records of runs, by knit and case."""
    rows = []
    for case in trade.cases():
        measured = {knit: of for (knit, other), of in records.items() if other == case}
        runs = {knit: {run["model setting"]: run["values"] for run in of} for knit, of in measured.items()}
        for knit, true in reference_values(runs, case, trade).items():
            problem = problems[knit, case]
            about = {"knit": knit, "problem": problem.digest} | asdict(problem.inputs)
            of = [run for run in measured[knit] if run["model setting"] in problem.settings]
            rows += rows_of(of, case, about, trade, true)
    return pd.DataFrame(rows, columns=[*COLUMNS, "problem"])


def measure(problem: PhysicalProblem, folder: Path) -> pd.DataFrame:
    """Run all model settings on a knit of the user, add errors and prices to the user's table, and return them.

    Raises DataFileError where the reference value is not known since fewer than two of its model settings have ended.
    """
    scene = problem.scene
    if scene.specimen == "pair":
        raise ConfigurationError(f"scene {scene.name!r}: specimen is pair, but models are measured on knits")
    short = problem.digest[:8]
    named = replace(
        problem, scene=scene.labelled({"name": f"{scene.name}-{short}", "knit": f"{scene.knit}-{short}"})
    )
    if problem.inputs.strain < 0 or scene.value("load.largest_force") is not None:
        which = "in tension and to a strain: leave out load.largest_force, or take a load.strain > 0"
        raise ConfigurationError(f"scene {scene.name!r}: models are compared {which}")
    measured_rows(OWN, (*COLUMNS, *OF_OWN))  # which refuses a table of something else
    settings = problem.trade.settings_of(problem.case)
    records = [run(named, setting, folder, say=True) for setting in settings]
    of = (scene.name, problem.case)
    table = collect(problem.trade, {of: problem}, {of: records})
    if table[ERROR].isna().all():
        raise DataFileError(f"scene {scene.name!r}: {table['reason'].iloc[0]}")
    table = table.assign(behaviour=table["model setting"].map(problem.trade.behaviours(problem.case)))
    before = read_table(OWN) if OWN.is_file() else table[:0]
    others = before[before["problem"] != problem.digest]
    write_table(pd.concat([others, table]) if len(others) else table, OWN)
    return table
