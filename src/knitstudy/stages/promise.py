"""What the choice of a model promises, tried on knits that the trade was not measured on.

``python -m knitstudy.stages.promise [SECONDS]`` asks for models of all sweeps of course spacing and yarn diameter and
of all inputs changed one at a time whose simulations are there, runs what it is told (seconds to a minute each; kept
below ``results``, so that the same command goes on), and keeps in ``resources/trade_promise.csv`` what came out.
"""

from __future__ import annotations

import argparse
import logging
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path

import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError, DataFileError, KnitstudyError
from knitstudy.files import read_result, read_table, write_table
from knitstudy.measures.cost import seconds_of
from knitstudy.measures.discretisation import INTERACTIONS, made_of, problem_of
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.promises import Promise, corrected, error_made
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.trade import ACCURACIES
from knitstudy.measures.trade_points import model_of
from knitstudy.stages.displays import REFERENCE
from knitstudy.stages.kept_tables import PROMISES_KEPT, RESULTS, SIMULATED, TRADE, write_trade_page
from knitstudy.stages.plan import Plan
from knitstudy.stages.simulate import simulate
from knitstudy.stages.table import STAGES
from knitstudy.study.choice import LARGE, Ask, Choice, Rung, numerics, resolved
from knitstudy.study.planning import planned
from knitstudy.study.scene import Scene
from knitstudy.tables.trade import AT_MOST, CALLED

LONGEST = 30.0  # What is asked for may take no longer [s]: it is tried on many knits

ASKED = (("force", 0.02), ("force", 0.05), ("force", 0.25), ("out_of_plane", 0.10), ("contact", 0.10))
"""Questions and accuracies of every knit; those that nothing is sure enough for are left out."""

UNSEEN = ("sweep-", "inputs-", "unseen-")  # What names of their scenes begin with

BY = "solid yarns of degree 2"
"""What they were simulated by, whose error the reference knows on the drawn knit."""

FINER = "-p3"
"""What names of the same by the next degree end with: they are taken for the truth where there are any."""

FAILED = "no result"

log = logging.getLogger(__name__)

Tried = tuple[str, Estimate, float]
"""Quantity with the largest error, that error, and seconds of a simulation."""


def promises(plan: Plan, results: Path, seconds: float = float("inf")) -> Iterator[tuple[Scene, Promise]]:
    """Yield what was promised and what came out; stop simulating after some seconds of the wall clock.

    First come models that sweeps were run by besides, with what the trade says of the same on the drawn knit.
    """
    table = read_table(REFERENCE / "reference.csv")
    there = [scene for scene in plan.scenes.values() if scene.name.startswith(UNSEEN)]
    there = plan.up_to_date(there, results, SIMULATED)
    unseen = [scene for scene in there if scene.is_knit and made_of(scene) == BY]
    truths = {}
    for scene in sorted(unseen, key=lambda scene: scene.interaction != "tie"):
        if (pair := _pair(scene, plan, results)) is not None:
            base, finest = pair
            known = reference_of(table, base)
            found = corrected(known, _read(base, results), _read(finest, results), scene.load.strain)
            truths[scene.name] = scene, finest, found
    for scene, finest, truth in truths.values():
        yield from ((scene, made) for made in _at_hand(scene, finest, truth, there, plan, results))
    started = time.monotonic()
    for scene, finest, truth in truths.values():
        for question, accuracy in ASKED:
            try:
                ask = Ask(question=question, accuracy=accuracy, seconds=LONGEST)
                choice = planned(scene, ask, plan.scenes, scene.name).choice
            except ConfigurationError as error:
                log.info("%s", error)
                continue
            if time.monotonic() - started > seconds:
                return
            rungs = [choice.rung, *(rung for rung in choice.front if rung.seconds < choice.rung.seconds)]
            (quantity, error, cost), *cheaper = (
                _tried(scene, rung, choice, plan, results, truth) for rung in rungs
            )
            if error.known:
                done = [price for _, each, price in cheaper if each.value <= accuracy]
                other = model_of(plan.scenes[choice.rung.scene]) != model_of(finest)
                price = min([cost, *done])
                made = Promise(
                    scene.name, question, str(choice.rung), accuracy, error, quantity, cost, price, other
                )
                yield scene, made


def _at_hand(
    scene: Scene, finest: Scene, truth: Reference, there: list[Scene], plan: Plan, results: Path
) -> Iterator[Promise]:
    """Yield what the trade promises of simulations that are there, of another model than the truth is drawn from."""
    problem = problem_of(scene)
    others = [each for each in there if problem_of(each) == problem and model_of(each) != model_of(finest)]
    for other in others:
        history, contacts = _read(other, results)
        for row in _said_of(other, plan):
            accuracy = min((each for each in ACCURACIES if each >= row[AT_MOST]), default=None)
            quantity, error = error_made(row["question"], other, history, contacts, truth, scene.load.strain)
            if accuracy is not None and error.known:
                cost, _ = seconds_of(history)
                yield Promise(other.name, row["question"], row[CALLED], accuracy, error, quantity, cost, cost)


def _said_of(scene: Scene, plan: Plan) -> list[dict]:
    """Return what the trade says of the drawn knit of `LARGE` cells by what a scene is computed with."""
    trade, wanted = read_table(TRADE.path), numerics(scene)
    alike = {
        "cells [1]": f"{LARGE} x {LARGE}",
        "interaction": INTERACTIONS[scene.interaction],
        "direction": scene.load.direction,
    }
    found = []
    for name, rows in trade[(trade[list(alike)] == list(alike.values())).all(axis=1)].groupby(
        "scene", sort=False
    ):
        template = plan.scenes[name]
        if template.interaction == scene.interaction and numerics(template) == wanted:
            found += rows.to_dict("records")
    return found


def _tried(scene: Scene, rung: Rung, choice: Choice, plan: Plan, results: Path, truth: Reference) -> Tried:
    """Return the largest error of a model and its seconds; a run without a result has an infinite error."""
    try:
        chosen = scene.vary(resolved(replace(choice, rung=rung), plan.scenes))
        made = simulate(chosen, results, plan=plan)
    except KnitstudyError as error:
        log.warning("%s by %s: %s", scene.name, rung, error)
        return FAILED, Estimate(inf, 0.0), rung.seconds
    quantity, error = error_made(
        choice.ask.question, made.scene, made.history, made.contacts, truth, scene.load.strain
    )
    return quantity, error, seconds_of(made.history)[0]


def _pair(scene: Scene, plan: Plan, results: Path) -> tuple[Scene, Scene] | None:
    """Return a simulation of the drawn knit, whose error the reference knows, and the same of a scene: the finest."""
    base = f"yarns-{scene.interaction}-{scene.load.direction}"
    for ending in (FINER, ""):
        pair = [plan.scenes.get(name + ending) for name in (base, scene.name)]
        if None not in pair and len(plan.up_to_date(pair, results, SIMULATED)) == len(pair):
            return tuple(pair)
    return None


def _read(scene: Scene, results: Path) -> tuple[xr.Dataset, xr.Dataset]:
    return tuple(read_result(results / STAGES[stage].path(scene)) for stage in SIMULATED)


def keep(seconds: float) -> pd.DataFrame:
    """Keep what came out."""
    rows = [
        {
            "scene": promise.scene,
            "interaction": INTERACTIONS[scene.interaction],
            "direction": scene.load.direction,
            "question": promise.question,
            "accuracy [1]": promise.accuracy,
            "model": promise.model,
            "quantity": promise.quantity,
            "error [1]": promise.error.value,
            "uncertainty of that error [1]": promise.error.uncertainty,
            "held": promise.held,
            "surely held": promise.surely,
            "of another model [1]": promise.other,
            "seconds [s]": promise.seconds,
            "seconds of the cheapest that would have done [s]": promise.cheapest,
        }
        for scene, promise in promises(Plan.of(), RESULTS, seconds)
    ]
    if not rows:
        raise DataFileError(f"{RESULTS}: has no simulation by which a promise could be tried")
    table = pd.DataFrame(rows)
    write_table(table, PROMISES_KEPT)
    write_trade_page(read_table(TRADE.path))
    return table


if __name__ == "__main__":
    logging.basicConfig(level=logging.WARNING)
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "seconds", nargs="?", type=float, default=inf, help="begin no simulation after so many"
    )
    try:
        kept = keep(parser.parse_args().seconds)
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(
        f"{int(kept['held'].sum())} of {len(kept)} promises held, on {kept['scene'].nunique()} knits: {PROMISES_KEPT}"
    )
