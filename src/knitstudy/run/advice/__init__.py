"""A scene whose fidelity is ``auto``: the cheapest model that answers its question accurately enough.

Promises follow from measurements on a sample of knits (`run.advice.sample`, ``resources/trade.csv``), or on this
knit itself (`OWN`, which ``knitstudy measure`` writes). Reading the scenes replaces such a scene by an ordinary one.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import isfinite, isnan
from operator import attrgetter
from pathlib import Path
from statistics import median
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.keys import Section, output
from knitstudy.knit.scene.kinds import MODELS, role_of
from knitstudy.knit.scene.scene import Scene, set_dotted
from knitstudy.knit.scene.sections import BeamYarn, Yarn
from knitstudy.run.advice.sample import UNDECIDED, Inputs, Trade, endless, load_trade, same_knit

TRADE_KEPT = RESOURCES / "trade.csv"  # From `make trade`: a row for every knit, model setting and question
OWN = Path("measured.csv")  # The same for the user's own knits, in the working folder

AUTO = "auto"  # The fidelity of a scene that leaves the model open

ERROR, SECONDS, MEMORY = "error [1]", "seconds [s]", "memory [MB]"
NUMBERS = (*(name for name, kind in Inputs.__annotations__.items() if kind != "str"), ERROR, SECONDS, MEMORY)
COLUMNS = ("knit", "case", "model setting", "question", *Inputs.__annotations__, ERROR, SECONDS, MEMORY)
COLUMNS += ("quantity", "uncertainty of the reference value [1]", "unknowns [1]", "increments [1]", "reason")
COLUMNS += ("problem", "code", "value [SI]")

OF_BEAMS = {*BeamYarn.model_fields} - {*Yarn.model_fields}  # keys of a yarn that only beams have

ALIKE = 0.01  # Relative difference of two errors that are the same
SMALLEST = 1e-4  # Least promised error: histories and Newton's method are no more accurate


class Requirements(Section):
    """Question, accuracy and largest price of a scene with fidelity `auto`.

    The cheapest sufficient model is chosen when scenes are read; the simulated scene is an ordinary scene of this
    model.
    """

    question: Literal["force", "curve", "out_of_plane", "contact", "stress"] = output(
        "choice",
        allowed="force (at full load), curve (force from a tenth of the strain on), out_of_plane (motion), "
        "contact (force and slip) or stress (normal stress at a contact)",
    )
    """Quantity that the model is chosen for. Checked: all five."""
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
        return f"{self.name}: error at most {digits(100 * self.error)} %, {price}"


@dataclass(frozen=True)
class Choice:
    """The chosen model setting of a problem, all settings that have a promise, and the basis of the promise."""

    problem: Scene  # scene without a model
    ask: Requirements
    setting: ModelSetting
    settings: tuple[ModelSetting, ...]
    basis: str
    promise: Callable[[str], list[ModelSetting]]  # settings with their promises for another question

    @property
    def beside(self) -> dict[str, float]:
        """Promised errors [1] of the model settings for the question in `BESIDE`."""
        return {setting.name: setting.error for setting in self.promise(BESIDE.get(self.ask.question, ""))}

    @property
    def scene(self) -> Scene:
        """The problem by the model that was chosen."""
        return self.problem.vary(self.setting.keys)


def is_open(keys: Mapping[str, Any]) -> bool:
    """Whether keys of a scene, by dotted name, leave its model open."""
    return keys.get("fidelity") == AUTO


def of_model(key: str) -> bool:
    """Whether a key belongs to the model and its settings, not to the physical problem."""
    return key == "outputs" or ("." in key and role_of(key) in ("resolution", "numerics"))


def problem_of_keys(name: str, keys: Mapping[str, Any], where: str, defaults: Mapping[str, Any]) -> Scene:
    """Return the physical problem of a scene that sets keys, by dotted name, over defaults."""
    own: dict[str, Any] = {}
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
            set_dotted(own, key, value, where)
    return Scene.from_dict({"name": name, "fidelity": UNDECIDED} | own, where, defaults)


def choose(problem: Scene, ask: Requirements, drawn: Mapping[str, Any], where: str) -> Choice:
    """Return the cheapest model for a physical problem.

    `drawn` are the defaults that the sample was made with; `where` begins messages.
    Raises ConfigurationError where there is no promise, or no model setting is accurate, fast or small enough: the
    message names the nearest one, and the endless cell where that would do.
    """
    try:
        return _choose(problem, ask, drawn, where)
    except ConfigurationError as error:
        offer = without_edges(problem, ask, drawn)
        raise ConfigurationError(f"{error}{f'; {offer}' if offer else ''}") from None


def without_edges(problem: Scene, ask: Requirements, drawn: Mapping[str, Any]) -> str:
    """Return the price of a cell of the endless fabric in place of a knit, if the cell is accurate enough."""
    if not problem.is_knit:
        return ""
    try:
        return f"if no edges matter, specimen: cell by {_choose(endless(problem), ask, drawn, '').setting}"
    except ConfigurationError:
        return ""


def as_measured(problem: Scene) -> Scene | None:
    """Return a knit with as many cells as the largest knits of the sample, in place of a larger one.

    None for a knit that is no larger, or that was measured itself.
    """
    if not problem.is_knit or _own_rows(problem):
        return None
    most = {key: load_trade().box[key.rpartition(".")[2]][1] for key in ("pattern.loops", "pattern.rows")}
    less = {key: count for key, count in most.items() if problem.value(key) > count}
    return problem.vary(less) if less else None


def _choose(problem: Scene, ask: Requirements, drawn: Mapping[str, Any], where: str) -> Choice:
    if problem.specimen == "pair":
        raise ConfigurationError(f"{where}: fidelity is {AUTO} but must be named where specimen is pair")
    promise, basis = promises(problem, drawn, where)
    for name in ask.among:
        MODELS.find(name, f"{where}: ask.among")
    settings = [
        setting for setting in promise(ask.question) if not ask.among or setting.keys["fidelity"] in ask.among
    ]
    if not settings:
        of = f" among {', '.join(ask.among)}" if ask.among else ""
        raise ConfigurationError(
            f"{where}: ask.question is {ask.question!r}, which no model of {load_trade().case_of(problem)}{of} "
            "is promised to answer; ask for another, or name a fidelity"
        )
    good = _good_enough(settings, ask, where)
    setting = min(good, key=lambda setting: (setting.seconds, setting.error, setting.name))
    return Choice(problem, ask, setting, tuple(settings), basis, promise)


def promises(
    problem: Scene, drawn: Mapping[str, Any], where: str
) -> tuple[Callable[[str], list[ModelSetting]], str]:
    """Return the function from a question to the settings with a promise, and the basis of the promises in words.

    Raises ConfigurationError where a problem lies outside of the box, or too few knits have been measured.
    """
    trade = load_trade()
    if mine := _own_rows(problem):
        return lambda question: promised(problem, question, trade, mine, own=True), "on this very knit"
    remedy = f"`knitstudy measure {problem.name}`, with the same options, runs all models on this knit"
    if outside := trade.outside(problem, drawn):
        raise ConfigurationError(f"{where}: {outside}: nothing is promised of other knits; {remedy}")
    case, rows = str(trade.case_of(problem)), measured_rows(TRADE_KEPT)
    if (count := len(measured_knits(rows, case))) < trade.fewest:
        measured = f"{count or 'no'} knits have been measured of {case} ({TRADE_KEPT.name})"
        more = f"a promise takes {trade.fewest} or more, which `make trade` measures"
        raise ConfigurationError(f"{where}: {measured}: {more}; {remedy}")
    share, sure = 100 * trade.coverage, 100 * trade.confidence
    basis = f"on {share:.3g} % of the knits in the box of config/trade.yaml, at {sure:g} % confidence"
    basis += f", by {count} that were measured"
    if without := len(measured_knits(rows, case, known=False)):
        basis += f" and without {without} on which solid yarns did not end"
    return lambda question: promised(problem, question, trade, rows), basis


def _own_rows(problem: Scene) -> list[Mapping[str, Any]]:
    """Return what `knitstudy measure` has measured on this very knit."""
    knit = same_knit(problem)
    return [row for row in measured_rows(OWN) if row["problem"] == knit]


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
        least, good = min(good, key=price), [setting for setting in good if price(setting) <= allowed]
        if not good:
            within = [setting for setting in settings if price(setting) <= allowed]
            cheap = min(within, key=attrgetter("error"), default=None)
            instead = f"within it comes {cheap}" if cheap else "nothing is within it"
            needed = f"within ask.accuracy {ask.accuracy:g} the least is {least}"
            raise ConfigurationError(f"{where}: ask.{key} is {allowed:g}, but {needed}; {instead}")
    return good


def applies(problem: Scene, keys: Mapping[str, Any]) -> bool:
    """Return whether a model setting takes a problem at all: beams in endless cells always slip, for example."""
    try:
        problem.vary(keys)
    except ConfigurationError:
        return False
    return True


def promised(
    problem: Scene, question: str, trade: Trade, rows: Iterable[Mapping[str, Any]], own: bool = False
) -> list[ModelSetting]:
    """Return the model settings of a problem that have a promise: by the sample, or measured on `own` knits."""
    case, quantile, settings = trade.case_of(problem), trade.quantile, []
    for name, keys in trade.settings_of(case).items():
        of = [
            row
            for row in rows
            if (row["case"], row["model setting"], row["question"]) == (str(case), name, question)
        ]
        ended = [row for row in of if isfinite(row[ERROR])]
        if own and ended:
            error, seconds, memory = (ended[-1][column] for column in (ERROR, SECONDS, MEMORY))
            settings.append(ModelSetting(name, keys, error, seconds, seconds, memory))
        if own or not ended or not applies(problem, keys):
            continue
        error = quantile.of([row[ERROR] for row in of])
        if isfinite(error):
            seconds, memory = ([row[column] for row in ended] for column in (SECONDS, MEMORY))
            longer = 1.0
            if stops := problem.value("load.stops"):  # more increments than were measured take as much longer
                longer = max(1.0, (len(stops) + 1) / problem.vary(keys).solver.increments)
            price = longer * median(seconds), longer * quantile.of(seconds), quantile.of(memory)
            settings.append(ModelSetting(name, keys, max(error, SMALLEST), *price))
    return settings


def measured_knits(rows: Iterable[Mapping[str, Any]], case: str, known: bool = True) -> set[str]:
    """Return the knits among rows of a case that have a reference value, or those without one."""
    return {row["knit"] for row in rows if row["case"] == case and isnan(row[ERROR]) != known}


def measured_rows(path: Path) -> tuple[dict[str, Any], ...]:
    """Return the rows of a table of errors and prices; none where there is no table."""
    return _read(path.resolve(), path.stat().st_mtime_ns) if path.is_file() else ()


@cache
def _read(path: Path, _: int) -> tuple[dict[str, Any], ...]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    try:
        return tuple(row | {column: float(row[column] or "nan") for column in NUMBERS} for row in rows)
    except (KeyError, TypeError, ValueError) as error:
        remedy = "move it away and measure again (`make trade`, `knitstudy measure`)"
        raise ConfigurationError(f"{path}: is no table of errors and prices ({error}); {remedy}") from error


# ---- Pareto fronts: no other point is better in both error and price


Each = TypeVar("Each")


def front(
    points: Iterable[Each], price: Callable[[Each], float], error: Callable[[Each], float]
) -> list[Each]:
    """Return the points that no other is at most as dear as and as accurate, from the cheapest on.

    `price` and `error` are numbers of a point; smaller is better. Errors that differ by less than `ALIKE` count as
    equal, since they are within the tolerances of the solvers.
    """
    points_on_front: list[Each] = []
    for point in sorted(points, key=lambda candidate: (price(candidate), error(candidate))):
        if not points_on_front or error(point) < (1 - ALIKE) * error(points_on_front[-1]):
            points_on_front.append(point)
    return points_on_front


def digits(value: float) -> str:
    """Return a number with two digits that count, whole from ten on; a dash where there is none."""
    if isnan(value):
        return "-"
    return f"{value:.0f}" if value >= 10 else f"{float(f'{value:.2g}'):g}"
