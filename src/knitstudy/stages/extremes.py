"""The campaign `extremes`: what breaks, and whether it says so.

``python -m knitstudy.stages.extremes`` (`make extremes`) runs every scene of ``config/extremes.yaml`` in a process of
its own with a limit of processor time, goes on where it was ended, and keeps the table and its map of as many as are
there. A scene that is refused is evidence like any other; what ends neither with a sound history nor with a named error
is a silent failure.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import logging
import multiprocessing
import re
import resource
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConvergenceError, KnitstudyError
from knitstudy.figures.extremes_map import draw
from knitstudy.figures.saving import save
from knitstudy.files import replacing, write_table
from knitstudy.loading.restart import Progress
from knitstudy.measures.history_checks import (
    faults,
    hourglass_share_when_loaded,
    is_unloaded,
    largest_residual,
    ledger_gap,
    ledger_gap_at_end,
    penetration,
    unbalanced_contact,
)
from knitstudy.report.screen import save_for_screen
from knitstudy.stages.code import code_digest
from knitstudy.stages.kept_tables import stamped
from knitstudy.stages.plan import Plan
from knitstudy.stages.script import end_with_parent
from knitstudy.stages.simulate import simulate
from knitstudy.stages.table import STAGES
from knitstudy.study.campaign import Campaign, Trial, load_campaign
from knitstudy.study.configuration import CONFIG
from knitstudy.study.kinds import all_sections
from knitstudy.study.scene import Scene, digest

ROWS, RESULTS = Path("run/extremes"), Path("run/extremes/results")
"""One file a trial; and what its scenes leave, so that those of one geometry share it."""

TABLE = Path("results/tables/extremes.csv")
KEPT = Path("resources/extremes.csv")

FIGURE, PICTURE = Path("results/figures/extremes.png"), Path("docs/notes/extremes.webp")
"""The map, and as a page holds it."""

ENDED, REFUSED, STOPPED, TIME, SILENT = "ended", "refused", "stopped", "time", "silent"
"""A sound history; refused before anything was loaded; ended on the way with a reason; beyond the limit of processor
time; anything else: not a number, a traceback, a history outside of its gates."""

MEMORY = 8 * 2**30
"""Bytes of address space that a trial may have: no trial may take the machine with it."""

GRACE = 30.0
"""Wall time over processor time after which a trial counts as stuck: other processes share the machine."""

SAME = 0.01
"""Difference of the forces in twice the increments beyond which a result is not what was asked for."""

COLUMNS = (
    "trial",
    "group",
    "model",
    "changed",
    "outcome",
    "increments [1]",
    "Newton iterations [1]",
    "unknowns [1]",
    "force [N]",
    "force over E R2 [1]",
    "balance [1]",
    "balance of contact [1]",
    "ledger [1]",
    "ledger at full load [1]",
    "hourglass [1]",
    "penetration over R [1]",
    "twice the increments [1]",
    "seconds [s]",
    "warnings [1]",
)
TEXTS = ("reason", "error", "keys named", "first warning", "in twice the increments")
"""Columns of the table."""

KEYS = tuple(f"{section}.{name}" for section, names in all_sections().items() for name in names)


def digest_of(trial: Trial) -> str:
    """Return the digest of a row: of the base, what is changed of it, and the code of all stages."""
    stages = [stage for stage in STAGES.values() if stage.of(trial.base)]
    modules = (name for stage in stages for name in stage.modules(trial.base))
    code = code_digest("knitstudy.measures.history_checks", *modules)
    return digest({"base": trial.base.hash, "changes": dict(trial.changes), "code": code})


def run(trial: Trial, limit: float, cheap: float, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return the row of a trial, run in a process of its own."""
    here, there = multiprocessing.Pipe(duplex=False)
    fork = multiprocessing.get_context("fork")  # what is imported here need not be imported again
    process = fork.Process(target=_tried, args=(trial, limit, cheap, plan, folder, there))
    started = time.monotonic()
    process.start()
    there.close()
    row: dict[str, Any] | None = None
    with contextlib.suppress(EOFError):
        if here.poll(GRACE * limit):
            row = here.recv()
    if row is None and process.is_alive():
        process.kill()
    process.join()
    if row is None:
        if process.exitcode == -signal.SIGXCPU:
            outcome, said = TIME, _took_more_than(limit)
        else:
            outcome, said = SILENT, f"the process ended with status {process.exitcode}"
        row = {"outcome": outcome, "reason": said, "seconds [s]": time.monotonic() - started}
    changed = "; ".join(f"{name} = {value}" for name, value in trial.changes.items())
    return {"trial": trial.name, "group": trial.group, "model": trial.model, "changed": changed} | row


def _took_more_than(limit: float) -> str:
    return f"took more than {limit:g} s of processor time"


def _tried(trial: Trial, limit: float, cheap: float, plan: Plan, folder: Path, there: Connection) -> None:
    """Send the row of a trial to the process that began this one."""
    end_with_parent()
    resource.setrlimit(resource.RLIMIT_CPU, (int(np.ceil(limit)), int(np.ceil(limit)) + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    logging.getLogger("knitstudy").setLevel(logging.ERROR)
    with warnings.catch_warnings(record=True) as said, contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("always")
        row = judged(trial, cheap, plan, folder)
    row["warnings [1]"] = len(said)
    row["first warning"] = str(said[0].message) if said else ""
    there.send(row)


def judged(trial: Trial, cheap: float, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return how a trial ended, why, and what was measured."""
    started = time.process_time()
    try:
        scene = trial.scene()
        history = simulate(scene, folder, plan=plan, anew=True).history
        row = measured(history, scene)
        row["seconds [s]"] = time.process_time() - started
        wrong = faults(history, scene)
        if not wrong and row["seconds [s]"] <= cheap:
            row |= twice(scene, history, plan, folder)
            difference = row.get("twice the increments [1]", 0.0)
            if difference > SAME:
                wrong = [f"force differs by {difference:.1%} in twice the increments"]
        return row | {"outcome": SILENT if wrong else ENDED, "reason": "; ".join(wrong)}
    except KnitstudyError as error:
        how = STOPPED if isinstance(error, ConvergenceError) else REFUSED
        row = {"outcome": how, "reason": _one_line(str(error)), "error": type(error).__name__}
        row["keys named"] = " ".join(
            name for name in KEYS if re.search(rf"\b{re.escape(name)}\b", str(error))
        )
        return row | {"seconds [s]": time.process_time() - started}
    except Exception as error:  # whatever it is: that is what the campaign looks for
        place = traceback.extract_tb(error.__traceback__)[-1]
        said = f"{type(error).__name__}: {_one_line(str(error))} ({Path(place.filename).name}:{place.lineno})"
        return {
            "outcome": SILENT,
            "reason": said,
            "error": type(error).__name__,
            "seconds [s]": time.process_time() - started,
        }


def measured(history: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """Return what a history that ended is worth."""
    force = float(history["force"][-1])
    row: dict[str, Any] = {
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
        "unknowns [1]": int(history.attrs["unknowns"]),
        "force [N]": force,
        "force over E R2 [1]": force / (scene.yarn.youngs_modulus * scene.yarn.radius**2),
        "balance [1]": largest_residual(history),
    }
    if not is_unloaded(history, scene):
        row["ledger [1]"], row["ledger at full load [1]"] = ledger_gap(history), ledger_gap_at_end(history)
        if scene.value("gates.hourglass") is not None:
            row["hourglass [1]"] = hourglass_share_when_loaded(history)
    if "smallest_gap" in history:
        row["penetration over R [1]"] = penetration(history) / scene.yarn.radius
    if "yarn_force" in history:
        row["balance of contact [1]"] = unbalanced_contact(history)
    return row


def twice(scene: Scene, history: xr.Dataset, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return how much the largest force of a scene depends on the number of increments."""
    most = 2 * scene.solver.increments
    try:
        other = simulate(scene.replace("solver.increments", most), folder, plan=plan, anew=True).history
    except KnitstudyError as error:
        return {"in twice the increments": _one_line(str(error))}
    largest = float(np.abs(history["force"]).max())
    if largest == 0.0 or is_unloaded(history, scene):
        return {}
    return {"twice the increments [1]": abs(float(other["force"][-1] - history["force"][-1])) / largest}


def _one_line(text: str) -> str:
    return " ".join(text.split())


def collect(campaign: Campaign, rows: Path = ROWS) -> pd.DataFrame:
    """Return the rows of those trials that are there and up to date, in the order of the campaign."""
    kept = [row for trial in campaign.trials if (row := _kept(trial, campaign.limit, rows)) is not None]
    table = pd.DataFrame([{name: value for name, value in row.items() if name != "digest"} for row in kept])
    if table.empty:
        return table
    table = table.reindex(columns=[*COLUMNS, *TEXTS])
    table = table.assign(**{name: table[name].astype(object).fillna("") for name in TEXTS})
    table.insert(3, "number", table["trial"].str.rpartition(" ")[2].astype(int))
    table.insert(6, "cause", [cause(row) for _, row in table.iterrows()])
    return table


def cause(row: Mapping[str, Any]) -> str:
    """Return why a trial ended as it did: one of `knitstudy.figures.extremes_map.CAUSES`."""
    if row["outcome"] in (ENDED, TIME, SILENT):
        return row["outcome"]
    if row["outcome"] == STOPPED:
        return "gate" if re.search(r"\bgates\.|penetrate", row["reason"]) else "balance"
    if row["error"] == "ConfigurationError":
        bounds = re.search(r"but must be (a|an) ", row["reason"]) and len(row["keys named"].split()) == 1
        return "bounds" if bounds else "keys"
    return "loop"


def write_row(trial: Trial, row: Mapping[str, Any], rows: Path) -> None:
    """Write the row of a trial, with the digest that it is good for."""
    with replacing(_path(trial, rows)) as temporary:
        temporary.write_text(json.dumps({**row, "digest": digest_of(trial)}), encoding="utf-8")


def _kept(trial: Trial, limit: float, rows: Path) -> Mapping[str, Any] | None:
    """Return the row of a trial, if it is there, up to date, and did not end for a shorter time than it has now."""
    path = _path(trial, rows)
    if not path.is_file():
        return None
    row = json.loads(path.read_text(encoding="utf-8"))
    shorter = row["outcome"] == TIME and row["reason"] != _took_more_than(limit)
    return row if row.get("digest") == digest_of(trial) and not shorter else None


def _path(trial: Trial, rows: Path) -> Path:
    return rows / (re.sub(r"[^a-z0-9]+", "-", trial.name.lower()) + ".json")


def main() -> None:
    """Run what is not there yet, and keep the table of what is there."""
    options = _options()
    campaign, plan = load_campaign(options.config), Plan.of(options.config)
    waiting = [trial for trial in campaign.trials if re.search(options.only, trial.name)]
    waiting = [trial for trial in waiting if options.anew or _kept(trial, campaign.limit, ROWS) is None]
    seconds = _seconds(collect(campaign))
    waiting.sort(
        key=lambda trial: 0.0 if _is_refused(trial) else seconds.get(trial.model, 0.0)
    )  # most is known soon
    for base in {trial.base.name: trial.base for trial in waiting}.values():
        plan.digest(
            STAGES["simulation"], base
        )  # reads the code behind all scenes once, and not in every process
    report, begun = Progress("extremes", every=1.0), time.monotonic()
    for number, trial in enumerate(waiting):
        if time.monotonic() - begun > 60 * options.minutes:
            break
        row = run(trial, campaign.limit, campaign.cheap, plan, RESULTS)
        write_row(trial, row, ROWS)
        report((number + 1) / len(waiting), f"{trial.name}: {row['outcome']} {row['reason'][:120]}".rstrip())
    table = collect(campaign)
    write_table(table, TABLE)
    print(f"{len(table)} of {len(campaign.trials)} trials: {TABLE}")
    keep(table, campaign)


def _seconds(table: pd.DataFrame) -> Mapping[str, float]:
    """Return what a trial of each model takes, where that is known [s]."""
    return {} if table.empty else table.groupby("model")["seconds [s]"].median().to_dict()


def _is_refused(trial: Trial) -> bool:
    """Whether a trial is no scene at all."""
    try:
        trial.scene()
    except KnitstudyError:
        return True
    return False


def keep(table: pd.DataFrame, campaign: Campaign) -> None:
    """Keep the table of a campaign, and draw its map."""
    kept = stamped(table, wanted(campaign), trials=f"{len(table)} of {len(campaign.trials)}")
    save(draw(table), [FIGURE], {"extremes": kept.assign(code=kept["digest"])}, "What breaks")
    save_for_screen(FIGURE, PICTURE)
    write_table(kept, KEPT)


def wanted(campaign: Campaign) -> str:
    """Return the digest of the campaign with the code of today."""
    return digest({"trials": [digest_of(trial) for trial in campaign.trials]})


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=CONFIG, help="configuration folder")
    parser.add_argument("--only", default="", metavar="PATTERN", help="trials whose names hold this pattern")
    parser.add_argument("--anew", action="store_true", help="also those whose rows are there")
    parser.add_argument(
        "--minutes", type=float, default=np.inf, help="begin no trial after so many; the same command goes on"
    )
    return parser.parse_args()


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
