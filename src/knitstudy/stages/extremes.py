"""The campaign of extremes: scenes at the ends of what their keys may be; what breaks, and whether it says so.

``config/extremes.yaml`` says what is tried, one thing at a time and all together at random. A trial need not be a valid
scene: `Trial.scene` refuses it. The rules of ``workflow/rules/extremes.smk`` (`make extremes`) run every trial in a
process of its own with a limit of processor time, and collect one row of each. A scene that is refused is evidence like
any other; what ends neither with a sound history nor with a named error is a silent failure.
"""

from __future__ import annotations

import contextlib
import io
import json
import logging
import multiprocessing
import re
import resource
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import Field

from knitstudy.errors import ConfigurationError, ConvergenceError, KnitstudyError
from knitstudy.measures.history_checks import (
    faults,
    hourglass_share_when_loaded,
    is_unloaded,
    ledger_gaps,
    penetration,
    unbalanced_contact,
)
from knitstudy.registry import find, unknown_choice
from knitstudy.stages.code import code_digest
from knitstudy.stages.plan import Plan
from knitstudy.stages.script import end_with_parent
from knitstudy.stages.simulate import simulate
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import CONFIG, FAMILIES, load_scenes
from knitstudy.study.documents import read_yaml
from knitstudy.study.keys import Section, output, validated
from knitstudy.study.kinds import Labels, all_sections, role_of
from knitstudy.study.scene import Scene, digest

FILE = "extremes.yaml"

BASE = "extreme-"
"""What the names of the scenes begin with that others are made of."""

TOGETHER = "together"
"""The group of scenes in which many keys are changed at once."""

DIGITS = 3
"""Digits of a value that was drawn."""

QUANTITIES: Mapping[str, Callable[[Scene, Any], Scene]] = {
    "across": lambda scene, value: scene.replace("mesh.size", scene.yarn.diameter / value),
    "degree": lambda scene, value: scene.vary({"mesh.degree": value, "mesh.crossing_degree": value}),
    "diameter": lambda scene, value: scene.scaled(length=value / scene.yarn.diameter),
    "stiffness": lambda scene, value: scene.scaled(stiffness=value / scene.yarn.youngs_modulus),
}
"""Quantities that set several keys, in the order in which they follow the keys of a trial."""

APPLIES = {"across": "mesh.size", "degree": "mesh.degree", "diameter": "yarn", "stiffness": "yarn"}
"""The key or section that a scene must have for a quantity to say something of it."""


def _said(allowed: str, **default: Any) -> Any:
    return output("choice", allowed=allowed, **default)


class Alone(Section):
    """One thing at a time: of which scenes, and what each changes."""

    of: tuple[str, ...] = _said("a list of scenes")
    values: dict[str, list[Any]] = _said("values by key", default={})
    cases: tuple[dict[str, Any], ...] = _said("a list of keys with values", default=())

    def changes(self) -> Iterator[dict[str, Any]]:
        """Yield what each scene changes."""
        for keys, values in self.values.items():
            yield from (dict.fromkeys(keys.split(), value) for value in values)
        yield from self.cases


class Together(Section):
    """All at once, at random."""

    scenes: Annotated[int, Field(ge=0)] = _said("a whole number from 0 on: scenes of each base")
    changed: Annotated[float, Field(gt=0, le=1)] = _said(
        "a number > 0 and <= 1: the probability that a key is changed"
    )
    of: tuple[str, ...] = _said("a list of scenes")
    keys: dict[str, Any] = _said("what every key may be")


class Declared(Section):
    """What ``config/extremes.yaml`` holds."""

    seed: Annotated[int, Field(ge=0)] = _said("a whole number from 0 on")
    limit: Annotated[float, Field(gt=0)] = _said("a number > 0, in s")
    cheap: Annotated[float, Field(ge=0)] = _said("a number >= 0, in s")
    alone: dict[str, Any] = _said("groups by name")
    together: dict[str, Any] = _said("a group")


@dataclass(frozen=True)
class Trial:
    """One scene that is tried: a base with some keys and `QUANTITIES` changed."""

    name: str
    group: str
    base: Scene
    changes: Mapping[str, Any]

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
        for name, change in QUANTITIES.items():
            if name in self.changes:
                scene = change(scene, self.changes[name])
        return scene


@dataclass(frozen=True)
class Campaign:
    """All trials, and how long each may take."""

    trials: tuple[Trial, ...]
    limit: float  # processor time of a trial [s]
    cheap: float  # processor time below which a trial is made again in twice the increments [s]


def load_campaign(config: Path = CONFIG) -> Campaign:
    """Return the campaign of a configuration folder.

    Raises ConfigurationError, naming the file, the group, and what is not known or not allowed in it.
    """
    path = Path(config) / FILE
    declared = validated(Declared, read_yaml(path), str(path))
    scenes = load_scenes(config)
    bases = {name.removeprefix(BASE): scene for name, scene in scenes.items() if name.startswith(BASE)}
    trials = []
    for group, inside in declared.alone.items():
        where = f"{path}: alone: {group}"
        alone = validated(Alone, inside, where)
        for name in alone.of:
            base = find(f"scene of {FAMILIES}", bases, name, where)
            for number, changes in enumerate(alone.changes(), 1):
                _require_known(changes, where)
                trials.append(Trial(f"{group} {name} {number}", group, base, changes))
    where = f"{path}: {TOGETHER}"
    together = validated(Together, declared.together, where)
    _require_known([name for keys in together.keys for name in keys.split()], where)
    for index, name in enumerate(together.of):
        base = find(f"scene of {FAMILIES}", bases, name, where)
        for number in range(1, together.scenes + 1):
            # Its own generator: one scene more changes no other.
            changes = _drawn(np.random.default_rng((declared.seed, index, number)), together, base, where)
            trials.append(Trial(f"{TOGETHER} {name} {number}", TOGETHER, base, changes))
    return Campaign(tuple(trials), declared.limit, declared.cheap)


def _require_known(changes: Iterable[str], where: str) -> None:
    """Refuse a key of no scene: a value may be wrong on purpose, a name may not."""
    for name in changes:
        if name not in QUANTITIES and role_of(name) is None:
            keys = {f"{section}.{each}" for section, fields in all_sections().items() for each in fields}
            known = sorted({*QUANTITIES, *Labels.model_fields, *keys})
            raise ConfigurationError(f"{where}: {unknown_choice('unknown key', name, name, known)}")


def _drawn(random: np.random.Generator, together: Together, base: Scene, where: str) -> dict[str, Any]:
    """Return changes of a scene: of every key that it has, with the probability that is asked for."""
    changes: dict[str, Any] = {}
    for keys, between in together.keys.items():
        names = keys.split()
        # Drawn whether it is used or not: what is drawn next does not depend on the base.
        used, value = random.random() < together.changed, _between(random, between, f"{where}: {keys}")
        if used and base.kind.has(APPLIES.get(names[0], names[0])):
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
            raise ConfigurationError(
                f"{where} is {between!r} but must be a list of values, or even: [low, high] or decades: [low, high]"
            )
    return float(f"{value:.{DIGITS}g}")


# ---- Running the trials, each in a process of its own, and the table of what became of them

RESULTS = Path("run/extremes")
"""What the scenes leave, so that those of one geometry share it."""

ENDED, REFUSED, STOPPED, TIME, SILENT = "ended", "refused", "stopped", "time", "silent"
"""A sound history; refused before anything was loaded; ended on the way with a reason; beyond the limit of processor
time; anything else: not a number, a traceback, a history outside of its gates."""

MEMORY = 8 * 2**30
"""Bytes of address space that a trial may have: no trial may take the machine with it."""

GRACE = 30.0
"""Wall time over processor time after which a trial counts as stuck: other processes share the machine."""

SAME = 0.01
"""Difference of the forces in twice the increments beyond which a result is not what was asked for."""

NUMBERS = """increments [1], Newton iterations [1], unknowns [1], force [N], force over E R2 [1], balance [1],
balance of contact [1], ledger [1], ledger at full load [1], hourglass [1], penetration over R [1],
twice the increments [1], seconds [s], warnings [1]"""
COLUMNS = ("trial", "group", "model", "changed", "outcome", *NUMBERS.replace("\n", " ").split(", "))
TEXTS = ("reason", "error", "keys named", "first warning", "in twice the increments")
"""Columns of the table."""

KEYS = tuple(f"{section}.{name}" for section, names in all_sections().items() for name in names)


def digest_of(trial: Trial, campaign: Campaign) -> str:
    """Return the digest of a row: of the base, what is changed of it, limits of time, and the code of all stages."""
    stages = [stage for stage in STAGES.values() if stage.of(trial.base)]
    modules = (name for stage in stages for name in stage.modules(trial.base))
    code = code_digest("knitstudy.measures.history_checks", *modules)
    limits = [campaign.limit, campaign.cheap]
    return digest({"base": trial.base.hash, "changes": dict(trial.changes), "limits": limits, "code": code})


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
            outcome, said = TIME, f"took more than {limit:g} s of processor time"
        else:
            outcome, said = SILENT, f"the process ended with status {process.exitcode}"
        row = {"outcome": outcome, "reason": said, "seconds [s]": time.monotonic() - started}
    changed = "; ".join(f"{name} = {value}" for name, value in trial.changes.items())
    return {"trial": trial.name, "group": trial.group, "model": trial.model, "changed": changed} | row


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
    except Exception as error:  # whatever it is: that is what the campaign looks for
        said, named = " ".join(str(error).split()), ""
        if isinstance(error, KnitstudyError):
            outcome = STOPPED if isinstance(error, ConvergenceError) else REFUSED
            named = " ".join(name for name in KEYS if re.search(rf"\b{re.escape(name)}\b", str(error)))
        else:
            place = traceback.extract_tb(error.__traceback__)[-1]
            outcome = SILENT
            said = f"{type(error).__name__}: {said} ({Path(place.filename).name}:{place.lineno})"
        row = {"outcome": outcome, "reason": said, "error": type(error).__name__, "keys named": named}
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
        gaps = ledger_gaps(history)
        row["ledger [1]"], row["ledger at full load [1]"] = gaps.max(), gaps[-1]
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
        return {"in twice the increments": " ".join(str(error).split())}
    largest = float(np.abs(history["force"]).max())
    if largest == 0.0 or is_unloaded(history, scene):
        return {}
    return {"twice the increments [1]": abs(float(other["force"][-1] - history["force"][-1])) / largest}


def collect(files: Iterable[Path | str]) -> pd.DataFrame:
    """Return the table of rows, one file each."""
    table = pd.DataFrame([json.loads(Path(path).read_text(encoding="utf-8")) for path in files])
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
