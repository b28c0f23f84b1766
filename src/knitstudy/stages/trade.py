"""What accuracy costs, measured: knits of the sample, or one's own, by all rungs (docs/accuracy.md).

`make trade` calls `sampled`, `run` and `collect` in rules of their own (``workflow/rules/trade.smk``); `measure` does
the same for one knit. The truth of a quantity is the limit of solid yarns of rising degree; a run that fails, or takes
longer than the limit, has an infinite error.
"""

from __future__ import annotations

import json
import resource
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from math import inf, nan
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pandas as pd

from knitstudy.errors import ConfigurationError, DataFileError, GeometryError, KnitstudyError
from knitstudy.files import read_table, write_table
from knitstudy.geometry.lay_out import lay_out
from knitstudy.loading.restart import Progress
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.estimate import Estimate, limit_of_degrees
from knitstudy.measures.questions import QUESTIONS, answers, known
from knitstudy.measures.reference import Reference
from knitstudy.stages.code import code_digest
from knitstudy.stages.plan import Plan
from knitstudy.stages.script import end_with_parent
from knitstudy.stages.simulate import simulate
from knitstudy.stages.table import STAGES
from knitstudy.study.choice import COLUMNS, ERROR, MEMORY, OWN, SECONDS
from knitstudy.study.configuration import drawn_defaults
from knitstudy.study.sample import TIED, Case, Inputs, Trade, load_trade, same_knit
from knitstudy.study.scene import Scene, digest

FOLDER = Path("run/trade")  # What runs leave, so that rungs share a geometry and interrupted ones go on

FOUND = "found"  # The column ``outcome`` of a knit whose loop can be made; others have the reason

MOST_TRIED = 20  # Points of the box for each knit of the sample: with fewer loops than that, the box is wrong

REACHED = 1 - 1e-6  # Share of the strain that a history has to reach

Record = dict[str, Any]
"""Values by quantity, price and reason of failure of one run; inputs, case, rung and knit that it is of."""


def sampled(trade: Trade, make: Callable[[Inputs], Any] | None = None) -> pd.DataFrame:
    """Return the knits of the sample, a row a point of the box: a point without a loop is replaced by the next.

    `make` lays out the loop of a point, or raises GeometryError.
    """
    rows, count = [], 0
    for number, inputs in enumerate(trade.points()):
        if count == trade.knits:
            return pd.DataFrame(rows)
        if number == MOST_TRIED * trade.knits:
            raise ConfigurationError(
                f"box: only {count} of {number} points have a loop; narrow course or wale in config/trade.yaml"
            )
        try:
            (make or _lay_out)(inputs)
        except GeometryError as error:
            rows.append({"knit": "", "outcome": " ".join(str(error).split())} | asdict(inputs))
        else:
            count += 1
            rows.append({"knit": f"knit{count:03}", "outcome": FOUND} | asdict(inputs))
    raise AssertionError("points have no end")


def _lay_out(inputs: Inputs) -> None:
    lay_out(load_trade().scene(Case("cut_knit", TIED), inputs, drawn_defaults()))


def knits_of(table: pd.DataFrame) -> dict[str, Inputs]:
    """Return the knits of a table of the sample by name."""
    rows = table[table["outcome"] == FOUND].to_dict("records")
    return {row["knit"]: Inputs(**{name: row[name] for name in Inputs.__annotations__}) for row in rows}


def run_digest(trade: Trade, case: Case, rung: str) -> str:
    """Return the digest of the runs of a rung: of the sample, its keys and the code."""
    keys = trade.rungs[case.yarns][rung]
    scene = trade.scene(case, next(trade.points()), drawn_defaults()).vary(keys)
    modules = [name for stage in STAGES.values() if stage.of(scene) for name in stage.modules(scene)]
    sample = trade.model_dump(mode="json", include={"knits", "seed", "box"})
    code = code_digest("knitstudy.measures.questions", "knitstudy.study.sample", *modules)
    return digest([sample, str(case), dict(keys), code])


def run(problem: Scene, rung: str, keys: Mapping, limit: float, folder: Path, say: bool = False) -> Record:
    """Return the record of a problem by one rung, run in a process of its own with a limit of processor time [s]."""
    record = {"rung": rung, "values": {}, "seconds": nan, "memory": nan, "unknowns": 0, "increments": 0}
    try:
        document = problem.vary(dict(keys) | {"name": f"{problem.name}-{rung}", "outputs": []}).to_dict()
        with ProcessPoolExecutor(1, get_context("fork"), end_with_parent) as pool:
            return record | pool.submit(_run, document, limit, folder, say).result()
    except ConfigurationError as error:
        return record | _failed(error)
    except BrokenProcessPool:
        return record | {"reason": f"took more than {limit:g} s of processor time, or the memory"}


def _run(document: Mapping, limit: float, folder: Path, say: bool) -> Record:
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    scene = Scene.from_dict(document)
    try:
        found = simulate(scene, folder, plan=Plan({}), progress=Progress if say else None)
    except Exception as error:  # whatever it is: the run has no result
        return _failed(error)
    history, strain = found.history, scene.load.strain
    if float(history["strain"][-1]) < REACHED * strain:
        return {"reason": f"ended at a strain of {float(history['strain'][-1]):g}, not {strain:g}"}
    values: dict[str, float] = {}
    for question in QUESTIONS.values():
        values |= answers(question, scene, history, found.contacts, strain)
    return {
        "values": values,
        "seconds": float(history.attrs["processor_seconds"]),
        "memory": memory_growth(history) / MEGABYTE,
        "unknowns": int(history.attrs["unknowns"]),
        "increments": history.sizes["increment"] - 1,
        "reason": "",
    }


def _failed(error: Exception) -> dict[str, str]:
    kind = "" if isinstance(error, KnitstudyError) else f"{type(error).__name__}: "
    return {"reason": f"{kind}{' '.join(str(error).split())}"}


def rows_of(records: Iterable[Record], case: Case, about: Mapping[str, Any], trade: Trade) -> list[dict]:
    """Return one row a rung and question of the records of one knit; none of questions whose truth is not known."""
    records, rungs = list(records), trade.rungs_of(case)
    truth = truth_of({record["rung"]: record["values"] for record in records}, trade, case)
    rows = []
    for record in records:
        for question in QUESTIONS.values():
            off = {}
            for quantity in question.by.get(rungs[record["rung"]]["fidelity"], ()):
                if (true := known(truth, quantity, 1.0)).known:
                    value = record["values"].get(quantity, inf)
                    error = true.of(lambda other, value=value: abs(value / other - 1))
                    off[quantity] = (inf if record["reason"] else error.value + error.uncertainty, true)
            if not off:
                continue
            quantity = max(off, key=lambda each: off[each][0])
            error, true = off[quantity]
            price = {SECONDS: record["seconds"], MEMORY: record["memory"]}
            size = {"unknowns [1]": record["unknowns"], "increments [1]": record["increments"]}
            share = {
                "uncertainty of the truth [1]": true.uncertainty / true.value,
                "reason": record["reason"],
            }
            of = {"case": str(case), "rung": record["rung"], "question": question.name, "quantity": quantity}
            rows.append({**about, **of, ERROR: error, **price, **size, **share})
    return rows


def truth_of(values: Mapping[str, Mapping[str, float]], trade: Trade, case: Case) -> Reference:
    """Return the limits of the rungs of the truth, at strain 1 for full load, where two or more have ended."""
    rungs = trade.rungs_of(case)
    ended = [name for name in trade.truth if values.get(name)]
    degrees = [rungs[name].get("mesh.degree", 2) for name in ended]
    found = {}
    for quantity in values[ended[0]] if len(ended) > 1 else ():
        limit = limit_of_degrees(degrees, [values[name][quantity] for name in ended])
        found[quantity, 1.0] = Estimate(limit.value, limit.uncertainty)
    return Reference(found)


def collect(files: Iterable[Path | str], knits: Mapping[str, Inputs]) -> pd.DataFrame:
    """Return the table of errors and prices from records of all knits, one file each."""
    trade, defaults, groups = load_trade(), drawn_defaults(), {}
    for record in (json.loads(Path(path).read_text(encoding="utf-8")) for path in files):
        groups.setdefault((record["knit"], record["case"]), []).append(record)
    rows = []
    for case in trade.cases():
        for knit, inputs in knits.items():
            scene = trade.scene(case, inputs, defaults)
            about = {"knit": knit, "problem": same_knit(scene)} | asdict(Inputs.of(scene))
            rows += rows_of(groups.get((knit, str(case)), ()), case, about, trade)
    return pd.DataFrame(rows, columns=COLUMNS)


def measure(problem: Scene, folder: Path, own: Path = OWN) -> pd.DataFrame:
    """Run all rungs on a knit of one's own, keep their errors and prices in a table of one's own, and return them.

    Raises DataFileError where the truth is not known since fewer than two of its rungs have ended.
    """
    trade, case = load_trade(), Case.of(problem)
    if problem.specimen == "pair":
        raise ConfigurationError(
            f"scene {problem.name!r}: specimen is pair, but models are measured on knits"
        )
    knit = same_knit(problem)
    named = problem.vary({"name": f"{problem.name}-{knit[:8]}", "knit": f"{problem.knit}-{knit[:8]}"})
    rungs = trade.rungs_of(case)
    records = [run(named, rung, keys, trade.limit, folder, say=True) for rung, keys in rungs.items()]
    about = {"knit": problem.name, "problem": knit} | asdict(Inputs.of(problem))
    table = pd.DataFrame(rows_of(records, case, about, trade), columns=COLUMNS)
    if table.empty:
        reasons = "; ".join(f"{each['rung']}: {each['reason']}" for each in records if each["reason"])
        raise DataFileError(
            f"scene {problem.name!r}: the truth takes two of {', '.join(trade.truth)}, which did not end: {reasons}"
        )
    before = read_table(own, needs=COLUMNS) if own.is_file() else table[:0]
    others = before[before["problem"] != knit]
    write_table(pd.concat([others, table]) if len(others) else table, own)
    return table
