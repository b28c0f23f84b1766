"""The campaign of extremes: scenes at the ends of what their keys may be; what breaks, and whether it says so.

``config/extremes.yaml`` lists the trials, one changed key at a time and many at random. A trial need not be a valid
scene: `Trial.scene` refuses it. ``python benchmarks/extremes.py`` (`make extremes`) runs every trial in a process that
has a limit of processor time, keeps the table in resources/extremes.csv and draws docs/notes/extremes.webp. A run that
was stopped goes on: rows of the present code are read from results/extremes. A refused scene is a result as well. A
trial that ends neither with a sound history nor with a named error is a silent failure.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import logging
import multiprocessing
import re
import resource
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Annotated, Any

import history_checks
import numpy as np
import pandas as pd
import xarray as xr
from history_checks import faults, hourglass_share_when_loaded, is_unloaded, unbalanced_contact
from keep import NOTES, save_picture
from matplotlib.figure import Figure
from pydantic import Field
from records import code_of, counted, record

from knitstudy.errors import ConfigurationError, ConvergenceError, KnitstudyError, message_of
from knitstudy.interruption import end_with_parent
from knitstudy.knit.scene.documents import RESOURCES, read_yaml
from knitstudy.knit.scene.keys import Section, declared, validated
from knitstudy.knit.scene.kinds import all_keys
from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.response import energy_gaps, penetration
from knitstudy.registry import find, unknown_choice
from knitstudy.run.behaviour import group_of
from knitstudy.run.code_digest import MODEL, code_digest
from knitstudy.run.committed_tables import keep_table
from knitstudy.run.configuration import CONFIG, FAMILIES, load_scenes
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate
from knitstudy.use.style import DOUBLE, FAINT, INK, figure, place, shared_legend, styled

FILE = "extremes.yaml"

BASE = "extreme-"  # What the names of the scenes begin with that others are made of
TOGETHER = "together"  # The group of scenes in which many keys are changed at once
DIGITS = 3  # Digits of a value that was drawn

QUANTITIES: Mapping[str, tuple[str, Callable[[Scene, Any], Scene]]] = {
    "across": ("mesh.size", lambda scene, value: scene.replace("mesh.size", 2 / value)),
    "degree": (
        "mesh.degree",
        lambda scene, value: scene.vary({"mesh.degree": value, "mesh.crossing_degree": value}),
    ),
    "diameter": ("yarn", lambda scene, value: scene.scaled(length=value / scene.yarn.diameter)),
    "stiffness": ("yarn", lambda scene, value: scene.scaled(stiffness=value / scene.yarn.youngs_modulus)),
}
"""Quantities that set several keys, each with the key or section that a scene must have for it.

They follow the keys of a trial, in this order.
"""


class Alone(Section):
    """One thing at a time: of which scenes, and what each changes."""

    of: tuple[str, ...] = declared(allowed="a list of scenes")
    values: dict[str, list[Any]] = declared(allowed="values by key", default={})
    cases: tuple[dict[str, Any], ...] = declared(allowed="a list of keys with values", default=())

    def changes(self) -> Iterator[dict[str, Any]]:
        """Yield what each scene changes."""
        for keys, values in self.values.items():
            yield from (dict.fromkeys(keys.split(), value) for value in values)
        yield from self.cases


class Together(Section):
    """All at once, at random."""

    scenes: Annotated[int, Field(ge=0)] = declared(allowed="a whole number from 0 on: scenes of each base")
    changed: Annotated[float, Field(gt=0, le=1)] = declared(
        allowed="the probability that a key is changed, > 0 and <= 1"
    )
    of: tuple[str, ...] = declared(allowed="a list of scenes")
    keys: dict[str, Any] = declared(allowed="what every key may be")


class Declared(Section):
    """What ``config/extremes.yaml`` holds."""

    seed: Annotated[int, Field(ge=0)] = declared(allowed="a whole number from 0 on")
    limit: Annotated[float, Field(gt=0)] = declared(allowed="a number > 0, in s")
    cheap: Annotated[float, Field(ge=0)] = declared(allowed="a number >= 0, in s")
    alone: dict[str, Any] = declared(allowed="groups by name")
    together: dict[str, Any] = declared(allowed="a group")


@dataclass(frozen=True)
class Trial:
    """One scene that is tried: a base with some keys and `QUANTITIES` changed."""

    name: str
    group: str
    base: Scene
    changes: Mapping[str, Any]
    limit: float  # processor time [s]
    cheap: float  # processor time below which it is made again in twice the increments [s]

    @property
    def label(self) -> str:
        """The name as that of a file."""
        return re.sub(r"[^a-z0-9]+", "-", self.name.lower())

    @property
    def model(self) -> str:
        """Name of the base without what all of them begin with."""
        return self.base.name.removeprefix(BASE)

    def scene(self) -> Scene:
        """Return the scene; ConfigurationError where no scene may be so."""
        scene = self.base.vary({name: each for name, each in self.changes.items() if name not in QUANTITIES})
        for name, (_, change) in QUANTITIES.items():
            if name in self.changes:
                scene = change(scene, self.changes[name])
        return scene

    def depends_on(self) -> dict[str, Any]:
        """Return what its row depends on: the base, what is changed of it, limits of time, and all code."""
        code = [code_digest("measures", *MODEL), code_of(__file__, history_checks.__file__)]
        reads = {"base": self.base.hash, "changes": dict(self.changes), "limits": [self.limit, self.cheap]}
        return reads | {"code": code}


def load_trials(config: Path = CONFIG) -> list[Trial]:
    """Return the trials of a configuration folder.

    Raises ConfigurationError, naming the file, the group, and what is not known or not allowed in it.
    """
    path = Path(config) / FILE
    campaign = validated(Declared, read_yaml(path), str(path))
    scenes = load_scenes(config)
    bases = {name.removeprefix(BASE): scene for name, scene in scenes.items() if name.startswith(BASE)}
    trials = []

    def add(group: str, name: str, changes: Iterable[Mapping[str, Any]], where: str) -> None:
        for number, change in enumerate(changes, 1):
            _require_known(change, where)
            label = f"{group} {name} {number}"
            trials.append(Trial(label, group, bases[name], change, campaign.limit, campaign.cheap))

    for group, inside in campaign.alone.items():
        where = f"{path}: alone: {group}"
        alone = validated(Alone, inside, where)
        for name in alone.of:
            find(f"scene of {FAMILIES}", bases, name, where)
            add(group, name, alone.changes(), where)
    where = f"{path}: {TOGETHER}"
    together = validated(Together, campaign.together, where)
    for index, name in enumerate(together.of):
        base = find(f"scene of {FAMILIES}", bases, name, where)
        # A generator for each: one scene more changes no other.
        draws = [np.random.default_rng((campaign.seed, index, 1 + each)) for each in range(together.scenes)]
        add(TOGETHER, name, (_drawn(random, together, base, where) for random in draws), where)
    return trials


def _require_known(changes: Iterable[str], where: str) -> None:
    """Refuse a key of no scene: a value may be wrong on purpose, a name may not."""
    known = sorted({*QUANTITIES, *all_keys()})
    for name in changes:
        if name not in known:
            raise ConfigurationError(f"{where}: {unknown_choice('unknown key', name, name, known)}")


def _drawn(random: np.random.Generator, together: Together, base: Scene, where: str) -> dict[str, Any]:
    """Return changes of a scene: of every key that it has, with the probability that is asked for."""
    changes: dict[str, Any] = {}
    for keys, between in together.keys.items():
        names = keys.split()
        _require_known(names, where)
        # Drawn whether it is used or not: what is drawn next does not depend on the base.
        used = random.random() < together.changed
        value = _between(random, between, f"{where}: {keys}")
        needed, _ = QUANTITIES.get(names[0], (names[0], None))
        if used and base.kind.has(needed):
            changes |= dict.fromkeys(names, value)
    if base.interaction == "tie":
        changes.pop("interaction", None)
    elif changes.get("interaction") == "rough":
        changes.pop("contact.friction", None)
    if base.kind.fidelity.sources:  # a reduced model is loaded as the simulation behind it
        changes.pop("load.direction", None)
    return changes


def _between(random: np.random.Generator, between: Any, where: str) -> Any:
    """Return a value out of a list or between two ends."""
    share = random.random()
    if isinstance(between, list | tuple) and between:
        return between[int(share * len(between))]
    match between:
        case {"even": [float() | int() as low, float() | int() as high]}:
            value = low + share * (high - low)
        case {"decades": [float() | int() as low, float() | int() as high]} if low > 0 and high > 0:
            value = low * (high / low) ** share
        case _:
            wanted = "a list of values, or even: [low, high] or decades: [low, high]"
            raise ConfigurationError(f"{where} is {between!r} but must be {wanted}")
    return float(f"{value:.{DIGITS}g}")


# Running the trials, each in a process of its own, and the table of what became of them

SCRATCH = Path("run/extremes")  # Results of the scenes: trials with one geometry share it
ROWS = Path("results/extremes")
KEPT = RESOURCES / "extremes.csv"

ENDED, REFUSED, STOPPED, TIME, SILENT = "ended", "refused", "stopped", "time", "silent"
"""A sound history; refused before anything was loaded; ended on the way with a reason; beyond the limit of processor
time; anything else: not a number, a traceback, a history outside of its gates."""

MEMORY = 8 * 2**30  # Bytes of address space that a trial may have: no trial may take the machine with it

GRACE = 30.0
"""Wall time over processor time after which a trial counts as stuck: other processes share the machine."""

SAME = 0.01
"""Difference of the forces in twice the increments beyond which a result is not what was asked for."""


def run(trial: Trial, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return the row of a trial, run in a process of its own."""
    here, there = multiprocessing.Pipe(duplex=False)
    fork = multiprocessing.get_context("fork")  # what is imported here need not be imported again
    process = fork.Process(target=_tried, args=(trial, plan, folder, there))
    started = time.monotonic()
    process.start()
    there.close()
    row = None
    with contextlib.suppress(EOFError):
        row = here.recv() if here.poll(GRACE * trial.limit) else process.kill()
    process.join()
    if row is None:
        outcome = SILENT
        reason = f"the process ended with status {process.exitcode}"
        if process.exitcode == -signal.SIGXCPU:
            outcome = TIME
            reason = f"took more than {trial.limit:g} s of processor time"
        row = {"outcome": outcome, "reason": reason, "seconds [s]": time.monotonic() - started}
    changed = "; ".join(f"{name} = {value}" for name, value in trial.changes.items())
    number = int(trial.name.rpartition(" ")[2])
    about = {"trial": trial.name, "group": trial.group, "model": trial.model, "number": number}
    return about | {"changed": changed, "cause": cause(row)} | row


def _tried(trial: Trial, plan: Plan, folder: Path, there: Connection) -> None:
    """Send the row of a trial to the process that began this one."""
    end_with_parent()
    resource.setrlimit(resource.RLIMIT_CPU, (int(np.ceil(trial.limit)), int(np.ceil(trial.limit)) + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    logging.getLogger("knitstudy").setLevel(logging.ERROR)
    with warnings.catch_warnings(record=True) as said, contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("always")
        row = judged(trial, plan, folder)
    there.send(row | {"warnings [1]": len(said), "first warning": str(said[0].message) if said else ""})


def judged(trial: Trial, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return how a trial ended, why, and what was measured."""
    started = time.process_time()
    try:
        scene = trial.scene()
        history = simulate(scene, folder, plan=plan, force=True).history
        row = measured(history, scene) | {"seconds [s]": time.process_time() - started}
        wrong = faults(history, scene)
        if not wrong and row["seconds [s]"] <= trial.cheap:
            row |= twice(scene, history, plan, folder)
            if (difference := row.get("twice the increments [1]", 0.0)) > SAME:
                wrong = [f"force differs by {difference:.1%} in twice the increments"]
        return row | {"outcome": SILENT if wrong else ENDED, "reason": "; ".join(wrong)}
    except KnitstudyError as error:
        outcome = STOPPED if isinstance(error, ConvergenceError) else REFUSED
        named = [key for key in all_keys() if "." in key and re.search(rf"\b{re.escape(key)}\b", str(error))]
        name = type(error).__name__
        row = {"outcome": outcome, "reason": message_of(error), "error": name, "keys named": " ".join(named)}
    except Exception as error:  # whatever it is: that is what the campaign looks for
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        name = type(error).__name__
        row = {"outcome": SILENT, "reason": f"{message_of(error)} ({where})", "error": name}
    return row | {"seconds [s]": time.process_time() - started}


def measured(history: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """Return what a history that ended is worth."""
    force = float(history["force"][-1])
    row: dict[str, Any] = {
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
        "unknowns [1]": int(history.attrs["unknowns"]),
        "force [N]": force,
        "force over E R2 [1]": force / (scene.yarn.youngs_modulus * scene.yarn.radius**2),
        "balance [1]": float(history["residual"].max()),
    }
    if not is_unloaded(history, scene):
        gaps = energy_gaps(history)
        row["ledger [1]"] = gaps.max()
        row["ledger at full load [1]"] = gaps[-1]
        if scene.value("gates.hourglass") is not None:
            row["hourglass [1]"] = hourglass_share_when_loaded(history)
    if "smallest_gap" in history:
        row["penetration over R [1]"] = penetration(history) / scene.yarn.radius
    if "yarn_force" in history:
        row["balance of contact [1]"] = unbalanced_contact(history)
    return row


def twice(scene: Scene, history: xr.Dataset, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return how much the largest force of a scene depends on the number of increments."""
    finer = scene.replace("solver.increments", 2 * scene.solver.increments)
    try:
        other = simulate(finer, folder, plan=plan, force=True).history
    except KnitstudyError as error:
        return {"in twice the increments": message_of(error)}
    largest = float(np.abs(history["force"]).max())
    if largest == 0.0 or is_unloaded(history, scene):
        return {}
    return {"twice the increments [1]": abs(float(other["force"][-1] - history["force"][-1])) / largest}


@cache
def plan_of_all() -> Plan:
    """Return the plan of all scenes, which processes of the pool have from where they were forked."""
    return Plan.of(CONFIG)


def row_of(trial: Trial) -> dict[str, Any]:
    """Return the row of a trial from its record, or by running it."""
    return record(ROWS, trial.label, trial.depends_on(), lambda: run(trial, plan_of_all(), SCRATCH))


def cause(row: Mapping[str, Any]) -> str:
    """Return why a trial ended as it did: one of `CAUSES`."""
    outcome, reason = row["outcome"], row["reason"]
    if outcome == STOPPED:
        return "gate" if re.search(r"\bgates\.|penetrate", reason) else "balance"
    if outcome != REFUSED:
        return outcome
    if row["error"] != ConfigurationError.__name__:
        return "loop"
    bounds = re.search(r"but must be (a|an) ", reason) and len(row["keys named"].split()) == 1
    return "bounds" if bounds else "keys"


# The map: one square for every trial

CAUSES = {
    "ended": ("ended within its gates", "#C9DDEB"),
    "bounds": ("refused: bounds of a key", "#BDBDBD"),
    "keys": ("refused: keys that contradict each other", "#7F7F7F"),
    "loop": ("refused: no such loop or mesh", "#E69F00"),
    "gate": ("stopped by a gate", "#D55E00"),
    "balance": ("stopped: no equilibrium found", "#8E1B5A"),
    "time": ("beyond its processor time", "#56B4E9"),
    "silent": ("silent failure", "#000000"),
}
"""Label and colour of every way in which a scene may end."""

ROW, HEAD, FOOT = 3.6, 11.0, 26.0  # heights of a row, the head above and the legend below [mm]


@styled
def draw(table: pd.DataFrame) -> Figure:
    """Draw the map of a table of trials."""
    (y, groups), (model, models) = (pd.factorize(table[name]) for name in ("group", "model"))
    high = ROW * len(groups)
    page = figure(DOUBLE, HEAD + FOOT + high)
    axes = place(page, 0.32, FOOT, 0.67, high)
    widest = int(table["number"].max()) + 1
    x = widest * model + table["number"]
    for name, (label, colour) in CAUSES.items():
        here = table["cause"] == name
        look = {"s": 14.0, "marker": "s", "linewidths": 0, "color": colour}
        axes.scatter(x[here], y[here], **look, label=f"{label} ({here.sum()})")
    starts = widest * np.arange(len(models)) + 0.1
    axes.vlines(starts[1:], -0.6, len(groups) - 0.4, color=FAINT, linewidth=0.3)
    axes.set(xlim=(0.1, widest * len(models) + 0.1), ylim=(len(groups) - 0.4, -0.6))
    axes.set_yticks(range(len(groups)), groups)
    axes.set_xticks(starts + 0.5 * widest, [name.replace("-", "\n") for name in models], fontsize=7.0)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    shared_legend(page, ncols=2, labelcolor=INK, handletextpad=0.3)
    return page


def main() -> None:
    """Run all trials, keep their table and draw it."""
    trials = load_trials()
    plan_of_all()
    with ProcessPoolExecutor(None, multiprocessing.get_context("fork"), end_with_parent) as pool:
        jobs = [pool.submit(row_of, trial) for trial in trials]
        rows = [job.result() for job in counted(jobs, "trials")]
    groups = pd.Series([group_of(trial.base) for trial in trials])
    table = keep_table(pd.DataFrame(rows), KEPT, "make extremes", groups)
    save_picture(draw(table), NOTES / f"{KEPT.stem}.webp", {KEPT.stem: table}, "What breaks")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
