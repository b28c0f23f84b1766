"""What accuracy costs, measured: knits of the sample, or one's own, by all rungs (docs/accuracy.md).

`measure_sample` takes knits one after the other (`make trade`), `measure` takes one of one's own. The truth of a
quantity is the limit of solid yarns of rising degree; a run that fails, or exceeds its time, has an infinite error.
"""

from __future__ import annotations

import json
import resource
import shutil
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from itertools import islice
from math import inf, isinf, nan
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pandas as pd

from knitstudy.errors import ConfigurationError, DataFileError, GeometryError, said_by
from knitstudy.files import read_table, write_table, write_text
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

SAMPLE = Path("results/trade")  # Records of the sample's runs, its knits, and its table of errors and prices
SCRATCH = Path("run/trade")  # Results of the runs of one knit, so that rungs share a geometry

FOUND = "found"  # The column ``outcome`` of a knit whose loop can be made; others have the reason

MOST_TRIED = 20  # Points of the box for each knit of the sample: with fewer loops than that, the box is wrong

FEW = 3  # Knits of the highest degree that say how far the next one is off

REACHED = 1 - 1e-6  # Share of the strain that a history has to reach

Record = dict[str, Any]
"""Values by quantity, price and reason of failure of one run; inputs, case, rung and knit that it is of."""


def sampled(trade: Trade, first: int, outcomes: Mapping[Inputs, str]) -> pd.DataFrame:
    """Return the first knits of the sample, a row a point of the box: a point without a loop is replaced by the next.

    `outcomes` are those that are known already.
    """
    rows, count = [], 0
    for inputs in islice(trade.points(), MOST_TRIED * first):
        outcome = outcomes.get(inputs) or _outcome(trade, inputs)
        count += outcome == FOUND
        name = f"knit{count:03}" if outcome == FOUND else ""
        rows.append({"knit": name, "outcome": outcome} | asdict(inputs))
        if count == first:
            return pd.DataFrame(rows)
    found = f"only {count} of {len(rows)} points have a loop"
    raise ConfigurationError(f"box: {found}; narrow course or wale in config/trade.yaml")


def _outcome(trade: Trade, inputs: Inputs) -> str:
    try:
        lay_out(trade.scene(Case("cut_knit", TIED), inputs, drawn_defaults()))
    except GeometryError as error:
        return said_by(error)
    return FOUND


def measure_sample(
    first: int, folder: Path = SAMPLE, anew: bool = False, say: Callable[[str], Any] = str
) -> pd.DataFrame:
    """Run all rungs on the first knits of the sample, one after the other, and return their errors and prices.

    Every run leaves a record in the folder, named by a digest of its keys, and is taken from there the next time; the
    table is written after every knit. A record of other code is taken too, which `say` is told, unless it is made anew.
    """
    trade, defaults, listed = load_trade(), drawn_defaults(), folder / "knits.csv"
    problems, records, other = {}, {}, 0
    for number in range(first):
        before = read_table(listed).to_dict("records") if listed.is_file() else ()
        known = {Inputs.of_row(row): row["outcome"] for row in before}
        points = sampled(trade, number + 1, known)
        if len(points) > len(known):
            write_table(points, listed)
        knit, inputs = f"knit{number + 1:03}", Inputs.of_row(points.iloc[-1])
        fresh = False
        for case in trade.cases():
            problem = problems[knit, case] = trade.scene(case, inputs, defaults, f"{knit}-{case}")
            records[knit, case] = []
            for rung, keys in trade.rungs_of(case, number).items():
                code = code_of(problem, keys)
                path = folder / f"{problem.name}-{rung}-{digest([asdict(inputs), keys])[:8]}.json"
                if anew or not path.is_file():
                    shutil.rmtree(SCRATCH / "restart", ignore_errors=True)  # a run that goes on has no price
                    record = run(problem, rung, keys, trade.limit, SCRATCH) | {"code": code}
                    write_text(json.dumps(record), path)
                    say(f"{problem.name} {rung}: {record['reason'] or 'ended'}, {record['seconds']:.3g} s")
                    fresh = True
                records[knit, case].append(json.loads(path.read_text(encoding="utf-8")))
                other += records[knit, case][-1]["code"] != code
        shutil.rmtree(SCRATCH, ignore_errors=True)
        if fresh or number + 1 == first:
            found = collect(trade, problems, records)
            write_table(found, folder / "trade.csv")
    if other:
        say(f"{other} records were made by other code: --anew makes them again")
    return found


def code_of(problem: Scene, keys: Mapping) -> str:
    """Return the digest of the code, and of all keys, behind a run."""
    try:
        scene = problem.vary(keys)
    except ConfigurationError:
        return ""
    modules = {name for stage in STAGES.values() if stage.of(scene) for name in stage.modules(scene)}
    return digest([code_digest("knitstudy.measures.questions", *sorted(modules)), scene.hash])


def run(problem: Scene, rung: str, keys: Mapping, limit: float, folder: Path, say: bool = False) -> Record:
    """Return the record of a problem by one rung, run in a process of its own with a limit of processor time [s]."""
    record = {"rung": rung, "values": {}, "seconds": nan, "memory": nan, "unknowns": 0, "increments": 0}
    try:
        document = problem.vary(dict(keys) | {"name": f"{problem.name}-{rung}", "outputs": []}).to_dict()
        with ProcessPoolExecutor(1, get_context("fork"), end_with_parent) as pool:
            return record | pool.submit(_run, document, limit, folder, say).result()
    except ConfigurationError as error:
        return record | {"reason": said_by(error)}
    except BrokenProcessPool:
        return record | {"reason": f"took more than {limit:g} s of processor time, or the memory"}


def _run(document: Mapping, limit: float, folder: Path, say: bool) -> Record:
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    scene = Scene.from_dict(document)
    try:
        found = simulate(scene, folder, plan=Plan({}), progress=Progress if say else None)
    except Exception as error:  # whatever it is: the run has no result
        return {"reason": said_by(error)}
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


def rows_of(
    records: Iterable[Record], case: Case, about: Mapping[str, Any], trade: Trade, truth: Reference
) -> list[dict]:
    """Return one row a rung and question of the records of one knit, or one that says why no truth is known."""
    rows, rungs = [], trade.rungs_of(case)
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
            share = {"uncertainty of the truth [1]": true.uncertainty / true.value}
            said = {"reason": record["reason"], "code": record.get("code", "")}
            of = {"case": str(case), "rung": record["rung"], "question": question.name, "quantity": quantity}
            rows.append({**about, **of, ERROR: error, **price, **size, **share, **said})
    if rows:
        return rows
    failed = "; ".join(f"{each['rung']}: {each['reason']}" for each in records if each["reason"])
    reason = f"the truth takes two of {', '.join(trade.truth)}, which did not end: {failed}"
    return [{**about, "case": str(case), "rung": "", "question": "", "reason": reason}]


def truths(
    runs: Mapping[str, Mapping[str, Mapping[str, float]]], case: Case, trade: Trade
) -> dict[str, Reference]:
    """Return what is true of every knit, at strain 1 for full load, from runs {knit: {rung: values}}.

    That is the limit of the rungs of the truth where two or more have ended. Where the highest degree did not run, it
    is the next one, as uncertain as that is far from the limit at most on the knits of both, if they are `FEW` or more.
    """
    degrees = {name: trade.rungs_of(case)[name].get("mesh.degree", 2) for name in trade.truth}
    *_, next_to, highest = trade.truth
    limits: dict[str, dict[str, Estimate]] = {}
    far: dict[str, list[float]] = {}
    for knit, values in runs.items():
        ended, limits[knit] = [name for name in trade.truth if values.get(name)], {}
        for quantity in values[ended[0]] if len(ended) > 1 else ():
            series = [values[name][quantity] for name in ended]
            limit = limit_of_degrees([degrees[name] for name in ended], series)
            true, change = Estimate(limit.value, limit.uncertainty), abs(series[-1] - series[-2])
            if abs(true.value - series[-1]) > change:  # values that hardly converge cannot be extrapolated
                true = Estimate(series[-1], change)
            limits[knit][quantity] = true
            if ended[-2:] == [next_to, highest] and true.value:
                off = abs(series[-2] - true.value) + true.uncertainty
                far.setdefault(quantity, []).append(off / abs(true.value))
    for knit, found in limits.items():
        for quantity, limit in found.items():
            if not runs[knit].get(highest) and len(far.get(quantity, ())) >= FEW:
                found[quantity] = Estimate(limit.value, max(far[quantity]) * abs(limit.value))
    return {
        knit: Reference({(name, 1.0): each for name, each in found.items()}) for knit, found in limits.items()
    }


def collect(
    trade: Trade, problems: Mapping[tuple[str, Case], Scene], records: Mapping[tuple[str, Case], list[Record]]
) -> pd.DataFrame:
    """Return the table of errors and prices from the problems and the records of runs, by knit and case."""
    rows = []
    for case in trade.cases():
        found = {knit: of for (knit, each), of in records.items() if each == case}
        runs = {knit: {each["rung"]: each["values"] for each in of} for knit, of in found.items()}
        for knit, true in truths(runs, case, trade).items():
            scene = problems[knit, case]
            about = {"knit": knit, "problem": same_knit(scene)} | asdict(Inputs.of(scene))
            rows += rows_of(found[knit], case, about, trade, true)
    return pd.DataFrame(rows, columns=COLUMNS)


def bounds(table: pd.DataFrame, trade: Trade) -> pd.DataFrame:
    """Return what the knits of a table promise of every rung, whatever the inputs: a row a case, question and rung."""
    rows, of_rungs = [], ["case", "question", "rung"]
    for of_rung, of in table.dropna(subset=[ERROR]).groupby(of_rungs, sort=False):
        row = dict(zip(of_rungs, of_rung, strict=True))
        row |= {"knits": len(of), "failed": sum(map(isinf, of[ERROR]))}
        row |= {"median error [1]": of[ERROR].median(), ERROR: trade.quantile.of(of[ERROR].to_numpy())}
        rows.append(row | of[[SECONDS, MEMORY]].median().to_dict())
    return pd.DataFrame(rows)


def measure(problem: Scene, folder: Path) -> pd.DataFrame:
    """Run all rungs on a knit of one's own, keep their errors and prices in a table of one's own, and return them.

    Raises DataFileError where the truth is not known since fewer than two of its rungs have ended.
    """
    trade, case = load_trade(), Case.of(problem)
    if problem.specimen == "pair":
        raise ConfigurationError(
            f"scene {problem.name!r}: specimen is pair, but models are measured on knits"
        )
    knit, rungs = same_knit(problem), trade.rungs_of(case)
    named = problem.vary({"name": f"{problem.name}-{knit[:8]}", "knit": f"{problem.knit}-{knit[:8]}"})
    records = [run(named, rung, keys, trade.limit, folder, say=True) for rung, keys in rungs.items()]
    table = collect(trade, {(problem.name, case): problem}, {(problem.name, case): records})
    if table[ERROR].isna().all():
        raise DataFileError(f"scene {problem.name!r}: {table['reason'].iloc[0]}")
    before = read_table(OWN, needs=COLUMNS) if OWN.is_file() else table[:0]
    others = before[before["problem"] != knit]
    write_table(pd.concat([others, table]) if len(others) else table, OWN)
    return table
