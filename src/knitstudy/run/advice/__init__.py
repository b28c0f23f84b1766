"""A scene whose fidelity is ``auto``: the cheapest model that answers its question accurately enough.

Promises follow from measurements on a sample of knits (`run.advice.sample`, ``resources/trade.csv``), or on this
knit itself (`OWN`, which ``knitstudy measure`` writes). Reading the scenes replaces such a scene by an ordinary one.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite, isinf, isnan
from operator import attrgetter
from pathlib import Path
from statistics import median
from typing import Annotated, Any, Literal

from pydantic import Field

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.keys import Section, output, validated
from knitstudy.knit.scene.kinds import MODELS, role_of
from knitstudy.knit.scene.scene import NOTHING, Scene
from knitstudy.knit.scene.sections import BeamYarn, Yarn
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import UNDECIDED, Inputs
from knitstudy.run.families import Member

TRADE_KEPT = RESOURCES / "trade.csv"  # From `make trade`: a row for every knit, model setting and question
OWN = Path("measured.csv")  # The same for the user's own knits, in the working folder

AUTO = "auto"  # The fidelity of a scene that leaves the model open

ERROR, SECONDS, MEMORY = "error [1]", "seconds [s]", "memory [MB]"
NUMBERS = (*(name for name, kind in Inputs.__annotations__.items() if kind != "str"), ERROR, SECONDS, MEMORY)
COLUMNS = ("knit", "case", "model setting", "question", *Inputs.__annotations__, ERROR, SECONDS, MEMORY)
COLUMNS += ("quantity", "uncertainty of the reference value [1]", "unknowns [1]", "increments [1]", "reason")
COLUMNS += ("value [SI]",)
OF_OWN = ("problem", "behaviour")  # columns beside, of knits of one's own

OF_BEAMS = {*BeamYarn.model_fields} - {*Yarn.model_fields}  # keys of a yarn that only beams have

ALIKE = 0.01  # Relative difference of two errors that are the same
SMALLEST = 1e-4  # Least promised error: histories and Newton's method are no more accurate


class Requirements(Section):
    """Question, accuracy and largest price of a scene with fidelity `auto`.

    The cheapest sufficient model is chosen when scenes are read; the simulated scene is an ordinary scene of this
    model.
    """

    question: Literal["force", "curve", "out_of_plane", "contact", "stress", "loss"] = output(
        "choice",
        allowed="force (at full load), curve (force from a tenth of the strain on), out_of_plane (motion), "
        "contact (force and slip), stress (normal stress at a contact) or loss (work that a cycle loses)",
    )
    """Quantity that the model is chosen for. Checked: all six."""
    accuracy: float = output("choice", meaning="the largest relative error", gt=0, le=10)
    """Bound of the promised error of the model at full load (accuracy.md). Checked: made-up samples."""
    seconds: float | None = output("choice", unit="s", default=None, gt=0)
    """Largest processor time. Checked: prices hold for one core of the machine that measured them."""
    memory: float | None = output("choice", unit="MB", default=None, gt=0)
    """Largest growth of the memory of the process. Checked: as ask.seconds."""
    among: tuple[Annotated[str, Field(min_length=1)], ...] = output(
        "choice",
        allowed="a list of fidelities to choose from, for example [rom3d, spline_yarns]; [] for all",
        default=(),
    )
    """Models to choose from. Checked: single ones."""


DEFAULT_ASK = {"question": "force", "accuracy": 0.05}
"""What `knitstudy plan` answers where nothing is asked."""

BESIDE = {"force": "curve", "curve": "force"}
"""Questions whose errors are printed as well: a model that is accurate at full load may not be so before it."""


@dataclass(frozen=True)
class ModelSetting:
    """A model with its settings: the error that is promised for a scene, and the price."""

    name: str
    keys: Mapping[str, Any]
    error: float  # at most [1]; infinite without a promise
    seconds: float  # expected [s]
    most_seconds: float
    memory: float  # at most [MB]

    def __str__(self) -> str:
        price = f"{digits(self.seconds)} s (at most {digits(self.most_seconds)}) and {digits(self.memory)} MB"
        return f"{self.name}: error of the simulation at most {digits(100 * self.error)} %, {price}"


@dataclass(frozen=True)
class Promises:
    """Promised errors and prices of a problem from measured rows, and the basis of the promises as text.

    The rows were measured on the sample, or on this very knit.
    """

    problem: PhysicalProblem
    rows: Sequence[Mapping[str, Any]]
    basis: str = ""
    own: bool = False

    @classmethod
    def of(cls, problem: PhysicalProblem, where: str) -> Promises:
        """Return what is promised of a problem; `where` is the prefix of error messages.

        Raises ConfigurationError where it lies outside of the box, or too few knits have been measured.
        """
        trade = problem.trade
        case = str(problem.case)
        if mine := own_rows(problem):
            now = trade.behaviours(problem.case)
            others = any(row["behaviour"] != now.get(row["model setting"]) for row in mine)
            basis = "on this very knit" + f", by other physics: measure it again ({OWN})" * others
            return cls(problem, mine, basis, own=True)
        name = problem.scene.name
        remedy = f"`knitstudy measure {name}`, with the same options, runs all models on this knit"
        if problem.outside:
            raise ConfigurationError(
                f"{where}: {problem.outside}: nothing is promised of other knits; {remedy}"
            )
        rows = measured_rows(TRADE_KEPT)
        if (count := len(measured_knits(rows, case))) < trade.fewest:
            measured = f"{count or 'no'} knits have been measured of {case} ({TRADE_KEPT.name})"
            more = f"a promise takes {trade.fewest} or more, which `make trade` measures"
            raise ConfigurationError(f"{where}: {measured}: {more}; {remedy}")
        share, sure = 100 * trade.coverage, 100 * trade.confidence
        basis = f"on {share:.3g} % of the knits in the box of config/trade.yaml, at {sure:g} % confidence"
        basis += f", by {count} that were measured"
        if without := len(measured_knits(rows, case, known=False)):
            basis += f" and without {without} on which solid yarns did not end"
        if problem.scene.value("pattern.control_points") is not None:
            basis += "; their loops are drawn for spacings and length, and this one has control points"
        return cls(problem, rows, basis)

    def settings(self, question: str) -> list[ModelSetting]:
        """Return the model settings that have a promise for a question."""
        settings = []
        bound = max if self.own else self.problem.trade.bound
        for name, keys in self.problem.settings.items():
            rows = self._rows_of(name, question)
            ended = [row for row in rows if isfinite(row[ERROR])]
            if not ended or not isfinite(error := bound([row[ERROR] for row in rows])):
                continue
            longer = self._longer(keys)
            seconds = [longer * row[SECONDS] for row in ended]
            price = median(seconds), bound(seconds), bound([row[MEMORY] for row in ended])
            settings.append(ModelSetting(name, keys, max(error, SMALLEST), *price))
        return settings

    def _rows_of(self, name: str, question: str) -> list[Mapping[str, Any]]:
        """Return the rows of a model setting for a question."""
        of = (str(self.problem.case), name, question)
        rows = [row for row in self.rows if (row["case"], row["model setting"], row["question"]) == of]
        if question != "contact":
            return rows
        # Rough yarns are not asked for slip, which has errors of its own.
        return [row for row in rows if isinf(row["friction"]) == isinf(self.problem.inputs.friction)]

    def _longer(self, keys: Mapping[str, Any]) -> float:
        """Return how much longer the stops of the scene take than the increments of a model setting."""
        scene = self.problem.scene
        stops = scene.value("load.stops")
        if not stops or self.own:
            return 1.0
        return max(1.0, (len(stops) + 1) / scene.vary(keys).solver.increments)


@dataclass(frozen=True)
class Choice:
    """The chosen model setting of a problem, and all settings that have a promise."""

    promises: Promises
    ask: Requirements
    setting: ModelSetting
    settings: tuple[ModelSetting, ...]

    def __str__(self) -> str:
        question = f"{self.ask.question} within {self.ask.accuracy:.2g}"
        return f"{question}: take {self.setting}, {self.promises.basis}"

    @property
    def beside(self) -> dict[str, float]:
        """Promised errors [1] of the model settings for the question in `BESIDE`."""
        other = self.promises.settings(BESIDE.get(self.ask.question, ""))
        return {setting.name: setting.error for setting in other}

    @property
    def scene(self) -> Scene:
        """The scene of the problem by the model that was chosen."""
        return self.promises.problem.scene.vary(self.setting.keys)


def is_open(keys: Mapping[str, Any]) -> bool:
    """Whether keys of a scene, by dotted name, leave its model open."""
    return keys.get("fidelity") == AUTO


def of_model(key: str) -> bool:
    """Whether a key belongs to the model and its settings, not to the physical problem."""
    return key == "outputs" or ("." in key and role_of(key) in ("resolution", "numerics"))


def asked(
    member: Member, changes: Mapping[str, Any], defaults: Mapping[str, Any], ask: Mapping[str, Any] = NOTHING
) -> tuple[PhysicalProblem, Requirements, str]:
    """Return the physical problem of a member of a family with changed keys, its question, and the prefix of messages.

    Keys of the model that the member names are left out. `ask` has the requirements that neither the member nor the
    changes have.
    Raises ConfigurationError where the member leaves its model open and has keys of a model, or where changes have any.
    """
    open_ = is_open(member.keys)
    keys = {key: value for key, value in member.keys.items() if open_ or not of_model(key)}
    own = {"name": member.name} | _physical(keys, member.where) | {"fidelity": UNDECIDED}
    scene = Scene.from_dict(own, member.where, defaults).vary(_physical(changes, member.where))
    wish = {
        key.partition(".")[2]: value for key, value in {**keys, **changes}.items() if key.startswith("ask.")
    }
    requirements = validated(Requirements, {**ask, **wish}, member.where, "ask.")
    return PhysicalProblem(scene), requirements, member.where


def _physical(keys: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return keys without model and question; refuse those of a model, and yarns that one model alone has."""
    physical = {}
    for key, value in keys.items():
        if of_model(key) and key != "outputs":
            of = f"where fidelity is {AUTO}: it comes with the model that is chosen"
            raise ConfigurationError(f"{where}: {key} is {value!r} but must be left out {of}")
        if key.removeprefix("yarn.") in OF_BEAMS | {"of"} and value is not None:
            known = "only fidelity beam has such yarns, so that no models are compared or chosen"
            raise ConfigurationError(
                f"{where}: {key} is {value!r}, but {known}; `knitstudy run` simulates it"
            )
        if key != "fidelity" and not key.startswith("ask."):
            physical[key] = value
    return physical


def choose(problem: PhysicalProblem, ask: Requirements, where: str) -> Choice:
    """Return the cheapest model for a physical problem.

    `where` is the prefix of error messages.
    Raises ConfigurationError where there is no promise, or no model setting is accurate, fast or small enough: the
    message names the nearest one, and the endless cell where that would do.
    """
    try:
        return _choose(problem, ask, where)
    except ConfigurationError as error:
        offer = without_edges(problem, ask)
        raise ConfigurationError(f"{error}{f'; {offer}' if offer else ''}") from None


def without_edges(problem: PhysicalProblem, ask: Requirements) -> str:
    """Return the price of a cell of the endless fabric in place of a knit, if the cell is accurate enough."""
    if not problem.scene.is_knit:
        return ""
    try:
        return f"if no edges matter, specimen: cell by {_choose(problem.endless(), ask, '').setting}"
    except KnitstudyError:  # no promise, or no such loop
        return ""


def as_measured(problem: PhysicalProblem) -> PhysicalProblem | None:
    """Return a knit with as many cells as the largest knits of the sample, in place of a larger one.

    None for a knit that is no larger, or that was measured itself.
    """
    return None if not problem.scene.is_knit or own_rows(problem) else problem.largest_measured()


def _choose(problem: PhysicalProblem, ask: Requirements, where: str) -> Choice:
    if problem.scene.specimen == "pair":
        raise ConfigurationError(f"{where}: fidelity is {AUTO} but must be named where specimen is pair")
    promises = Promises.of(problem, where)
    for name in ask.among:
        MODELS.find(name, f"{where}: ask.among")
    settings = [
        setting
        for setting in promises.settings(ask.question)
        if not ask.among or setting.keys["fidelity"] in ask.among
    ]
    if not settings:
        of = f" among {', '.join(ask.among)}" if ask.among else ""
        raise ConfigurationError(
            f"{where}: ask.question is {ask.question!r}, which no model of {problem.case}{of} "
            "is promised to answer; ask for another, or name a fidelity"
        )
    good = _good_enough(settings, ask, where)
    setting = min(good, key=attrgetter("seconds", "error", "name"))
    return Choice(promises, ask, setting, tuple(settings))


def own_rows(problem: PhysicalProblem) -> list[Mapping[str, Any]]:
    """Return what `knitstudy measure` has measured on this very knit."""
    return [row for row in measured_rows(OWN, (*COLUMNS, *OF_OWN)) if row["problem"] == problem.digest]


def _good_enough(settings: list[ModelSetting], ask: Requirements, where: str) -> list[ModelSetting]:
    """Return the settings that are accurate, fast and small enough.

    Raises ConfigurationError, which names the nearest setting, where there are none.
    """
    good = [setting for setting in settings if setting.error <= ask.accuracy]
    if not good:
        best = min(settings, key=attrgetter("error"))
        raise ConfigurationError(f"{where}: ask.accuracy is {ask.accuracy:g}, but nearest comes {best}")
    for key, price in (("seconds", attrgetter("most_seconds")), ("memory", attrgetter("memory"))):
        allowed = getattr(ask, key)
        if allowed is None:
            continue
        least = min(good, key=price)
        good = [setting for setting in good if price(setting) <= allowed]
        if not good:
            within = [setting for setting in settings if price(setting) <= allowed]
            cheap = min(within, key=attrgetter("error"), default=None)
            instead = f"within it comes {cheap}" if cheap else "nothing is within it"
            needed = f"within ask.accuracy {ask.accuracy:g} the least is {least}"
            raise ConfigurationError(f"{where}: ask.{key} is {allowed:g}, but {needed}; {instead}")
    return good


def measured_knits(rows: Iterable[Mapping[str, Any]], case: str, known: bool = True) -> set[str]:
    """Return the knits among rows of a case that have a reference value, or those without one."""
    return {row["knit"] for row in rows if row["case"] == case and isnan(row[ERROR]) != known}


def measured_rows(path: Path, columns: tuple[str, ...] = COLUMNS) -> tuple[dict[str, Any], ...]:
    """Return the rows of a table of errors and prices, which has some columns; none where there is no table."""
    return _read(path.resolve(), path.stat().st_mtime_ns, columns) if path.is_file() else ()


@cache
def _read(path: Path, _: int, columns: tuple[str, ...]) -> tuple[dict[str, Any], ...]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            table = csv.DictReader(file)
            rows = list(table)
            missing = {*columns} - {*(table.fieldnames or ())}
        if missing:
            raise ValueError(f"it has no column {', '.join(sorted(missing)[:3])}")
        return tuple(row | {column: float(row[column] or "nan") for column in NUMBERS} for row in rows)
    except (KeyError, TypeError, ValueError) as error:
        remedy = "move it away and measure again (`make trade`, `knitstudy measure`)"
        raise ConfigurationError(
            f"{path}: is not a table of errors and prices ({error}); {remedy}"
        ) from error


def front(settings: Iterable[ModelSetting]) -> list[ModelSetting]:
    """Return the Pareto front, from the cheapest setting on: no other setting is as cheap and as accurate.

    Errors that differ by less than `ALIKE` count as equal, since they are within the tolerances of the solvers.
    """
    best: list[ModelSetting] = []
    for setting in sorted(settings, key=attrgetter("seconds", "error")):
        if not best or setting.error < (1 - ALIKE) * best[-1].error:
            best.append(setting)
    return best


def digits(value: float) -> str:
    """Return a number with two digits that count, whole from ten on; a dash where there is none."""
    if isnan(value):
        return "-"
    return f"{value:.0f}" if value >= 10 else f"{float(f'{value:.2g}'):g}"
