"""The cheapest model that answers a question surely enough, by what was measured (``resources/trade.csv``).

Errors are taken over from the measured knit of the same interaction and load to others, prices by the laws with which
time and memory grow with the number of cells. docs/accuracy.md says how far both hold.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import isnan
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.registry import listed, unknown_choice
from knitstudy.study.keys import Section, output, validated
from knitstudy.study.kinds import FIDELITIES
from knitstudy.study.scene import Scene

RESOURCES = Path(__file__).resolve().parents[3] / "resources"
TRADE_KEPT = RESOURCES / "trade.csv"
"""What was measured: one row a simulation and question (`knitstudy.stages.kept_tables`)."""

GROWTH_KEPT = RESOURCES / "trade_growth.csv"  # By which powers of the number of cells in a row price grows

INTERACTIONS = {"tie": "tie constraint", "rough": "rough contact", "isotropic": "isotropic friction"}
"""As tables call them."""

AGAIN = 2.0
"""Price over that of the model chosen, and error over what was asked for, up to which another one is worth running to
compare with."""

SMALL, LARGE = 1, 3
"""Cells in a row of the knits that models are compared on; all that have more than `SMALL` count as `LARGE`."""

CANNOT = {
    "out_of_plane": "a planar honeycomb stays in its plane",
    "contact": "their joints have neither a pressure nor a slip",
    "stress": "beams have no pressure on a contact",
}
"""Why models that are made of beams do not answer a question."""


@dataclass(frozen=True)
class Rung:
    """One measured model, and what it would cost a scene."""

    model: str  # what it is called, with knobs that are not as in the main model
    kind: str  # the same without these knobs
    scene: str  # the scene of the study `trade` that has measured it
    fidelity: str  # of that scene
    error: float  # what its error is at most, where it was measured [1]
    seconds: float  # expected of the scene that asks [s]
    memory: float  # expected of the scene that asks [MB]

    def __str__(self) -> str:
        return self.model


@dataclass(frozen=True)
class Choice:
    """What was chosen for a scene."""

    ask: Ask
    rung: Rung
    others: tuple[Rung, ...]  # all that the scene could be computed by
    cells: float  # in a row, and of the knit that errors were measured on
    measured: int

    @property
    def front(self) -> tuple[Rung, ...]:
        """Those that nothing beats in error and time at once, from the cheapest on."""
        return tuple(front(self.others, _seconds, _error))

    def __str__(self) -> str:
        price = f"some {self.rung.seconds:.2g} s and {self.rung.memory:.2g} MB"
        return f"{self.rung}: error at most {100 * self.rung.error:.2g} %, {price}"


def choose(
    scene: Scene, ask: Ask, templates: Mapping[str, Scene], where: str, kept: Path = TRADE_KEPT
) -> Choice:
    """Return the cheapest model for a scene, which says what is to be simulated, by any model.

    `templates` are the scenes that the kept trade names; `where` begins messages.
    Raises ConfigurationError where nothing answers, or nothing is sure, fast or small enough: what comes nearest is
    named.
    """
    named = f"{where}: fidelity is auto but must be named where"
    if not scene.is_knit:
        raise ConfigurationError(f"{named} specimen is {scene.specimen}")
    if scene.load.strain < 0:
        why = "what accuracy costs was measured in tension"
        raise ConfigurationError(f"{named} load.strain is {scene.load.strain:g}: {why}")
    cells = (scene.pattern.loops * scene.pattern.rows) ** 0.5
    measured = SMALL if cells == SMALL else LARGE
    rows = [row for row in _rows(kept) if row["question"] == ask.question and _fits(row, scene, measured)]
    known = [(row, templates[row["scene"]]) for row in rows if row["scene"] in templates]
    rungs = [_rung(row, template, cells / measured) for row, template in known]
    rungs = _among([rung for rung in rungs if _goes_with(templates[rung.scene], scene)], ask, where)
    if not rungs:
        raise ConfigurationError(
            f"{where}: ask.question is {ask.question!r}, but nothing was measured of {INTERACTIONS[scene.interaction]}"
            f" in {scene.load.direction} tension; name a fidelity, or measure it with `make trade`"
        )
    good = [rung for rung in rungs if rung.error <= ask.accuracy]
    if not good:
        best = nearest(rungs, _error)
        raise ConfigurationError(
            f"{where}: ask.accuracy is {ask.accuracy:g}, but no model is known to be off by less than {best.error:.2g}"
            f" in {ask.question}, which {best} is ({best.seconds:.2g} s); ask for that, or for {_more(ask)}"
        )
    rung = cheapest(rungs, ask.accuracy, _seconds, _error)
    for budget, unit in (("seconds", "s"), ("memory", "MB")):
        _require_budget(budget, unit, ask, good, rungs, where)
    within = [each for each in good if _affordable(each, ask)]
    if not within:
        raise ConfigurationError(
            f"{where}: ask.seconds is {ask.seconds:g} and ask.memory {ask.memory:g}, but no model within ask.accuracy "
            f"{ask.accuracy:g} keeps both; {rung} takes {rung.seconds:.2g} s and {rung.memory:.2g} MB: allow that"
        )
    rung = cheapest(within, ask.accuracy, _seconds, _error)
    return Choice(ask, rung, tuple(rungs), cells, measured)


def resolved(choice: Choice, templates: Mapping[str, Scene]) -> dict[str, Any]:
    """Return the keys, by dotted name, that make a scene one of the model chosen: what its template computes with."""
    template = templates[choice.rung.scene]
    return {"fidelity": template.fidelity, "interaction": template.interaction} | numerics(template)


def second(choice: Choice) -> Rung | None:
    """Return the surest model of another kind that is cheap and sure enough to compare with (`AGAIN`), if any is."""
    others = (rung for rung in choice.others if rung.kind != choice.rung.kind)
    cheap = (rung for rung in others if rung.seconds <= AGAIN * choice.rung.seconds)
    return nearest([rung for rung in cheap if rung.error <= AGAIN * choice.ask.accuracy], _error)


def numerics(scene: Scene) -> dict[str, Any]:
    """Return all keys that say how a scene is computed, by dotted name."""
    found = scene.values_of("resolution", "numerics")
    return {key: list(value) if isinstance(value, tuple) else value for key, value in found.items()}


def _seconds(rung: Rung) -> float:
    return rung.seconds


def _error(rung: Rung) -> float:
    return rung.error


def _among(rungs: list[Rung], ask: Ask, where: str) -> list[Rung]:
    """Return those rungs whose fidelity is asked for."""
    for name in ask.among:
        if name not in FIDELITIES:
            message = unknown_choice("ask.among names an unknown fidelity", name, name, list(FIDELITIES))
            raise ConfigurationError(f"{where}: {message}")
    found = [rung for rung in rungs if not ask.among or rung.fidelity in ask.among]
    if rungs and not found:
        can = sorted({rung.fidelity for rung in rungs})
        raise ConfigurationError(
            f"{where}: ask.among is [{', '.join(ask.among)}] but must hold {listed(can)} where ask.question is "
            f"{ask.question}: {CANNOT.get(ask.question, 'no other was measured')}"
        )
    return found


def _require_budget(key: str, unit: str, ask: Ask, good: list[Rung], rungs: list[Rung], where: str) -> None:
    """Refuse a budget that no model within the accuracy keeps."""
    allowed = getattr(ask, key)
    if allowed is None or any(getattr(rung, key) <= allowed for rung in good):
        return
    least = min(good, key=lambda rung: getattr(rung, key))
    cheap = [rung for rung in rungs if getattr(rung, key) <= allowed]
    best = nearest(cheap, _error)
    instead = f"{best} is within it, off by at most {best.error:.2g}" if best else "nothing is within it"
    raise ConfigurationError(
        f"{where}: ask.{key} is {allowed:g}, but within ask.accuracy {ask.accuracy:g} the least is "
        f"{getattr(least, key):.2g} {unit}, by {least}: allow that; {instead}"
    )


def _more(ask: Ask) -> str:
    return "other models than ask.among" if ask.among else "another question"


def _affordable(rung: Rung, ask: Ask) -> bool:
    slow = ask.seconds is not None and rung.seconds > ask.seconds
    large = ask.memory is not None and rung.memory > ask.memory
    return not slow and not large


def _fits(row: Mapping[str, str], scene: Scene, measured: int) -> bool:
    return (
        row["interaction"] == INTERACTIONS[scene.interaction]
        and row["direction"] == scene.load.direction
        and row["cells [1]"] == f"{measured} x {measured}"
    )


def _goes_with(template: Scene, scene: Scene) -> bool:
    """Return whether a scene can be computed as a template is: from its geometry, and as far loaded if it stands in.

    What is made from another simulation is dearer than that, which answers as well. Ties that stand in for
    contact do so once yarns have touched: no sooner than that was measured.
    """
    if any(template.value(key) for key in template.kind.fidelity.sources):
        return False
    return template.interaction == scene.interaction or scene.load.strain >= template.load.strain


def _rung(row: Mapping[str, str], template: Scene, growth: float) -> Rung:
    """Return the rung of a row of the trade for a knit that is `growth` times as wide."""
    time, memory = _growth(template.fidelity, growth)
    return Rung(
        row["model and knobs"],
        row["model"],
        row["scene"],
        template.fidelity,
        float(row["error at most [1]"]),
        float(row["seconds [s]"]) * time,
        float(row["memory growth [MB]"]) * memory,
    )


def _growth(fidelity: str, growth: float) -> tuple[float, float]:
    """Return by what time and memory of a model rise on a knit that is so many times as wide; none falls."""
    if growth <= 1:
        return 1.0, 1.0
    laws = _exponents(GROWTH_KEPT)
    if fidelity not in laws:
        lacking = f"has no law of fidelity {fidelity}, only of {listed(sorted(laws))}"
        what = "what it costs on a larger knit is not known; make it with `make trade`"
        raise ConfigurationError(f"{GROWTH_KEPT}: {lacking}: {what}")
    time, memory = laws[fidelity]
    return growth**time, growth**memory


@cache
def _rows(kept: Path) -> tuple[dict[str, str], ...]:
    return tuple(_read(kept))


@cache
def _exponents(kept: Path) -> dict[str, tuple[float, float]]:
    """Return the exponents of time and memory by kind of model: the largest of its series."""
    found: dict[str, tuple[float, float]] = {}
    for row in _read(kept):
        kind = next(kind for kind, words in _KINDS.items() if words in row["model"])
        time, memory = found.get(kind, (0.0, 0.0))
        own = row["exponent of the time of a path [1]"], row["exponent of memory growth [1]"]
        found[kind] = max(time, float(own[0])), max(memory, float(own[1]))
    return found


_KINDS = {
    "spline_yarns": "solid yarns",
    "hexahedra": "hexahedra",
    "rom3d": "3D ROM",
    "rom2d": "2D ROM",
    "beam": "beams",
}


def _read(kept: Path) -> list[dict[str, str]]:
    try:
        with kept.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise ConfigurationError(
            f"{kept}: {error.strerror}, but scenes whose fidelity is auto are planned by it; make it with `make trade`"
        ) from error


# ---- What a scene asks for whose fidelity is ``auto``: a model is chosen for that (docs/accuracy.md)


AUTO = "auto"  # The fidelity of a scene that leaves the model open


class Ask(Section):
    """What is asked of a scene whose fidelity is `auto`, how surely, and at which price at most.

    It is resolved where scenes are read: what is simulated is an ordinary scene of the cheapest model that will do.
    """

    question: Literal["force", "out_of_plane", "contact", "stress"] = output(
        "choice",
        allowed="force, out_of_plane (motion), contact (force and slip) or stress (normal, at a contact)",
    )
    """What the model is chosen for; tables/trade.csv has the errors of all models by question. Checked: all four."""
    accuracy: float = output("choice", meaning="the relative error that may be made", gt=0, le=10)
    """A model is taken whose error is at most this where it is measured. Checked: 0.02 to 0.2, on knits with other
    spacings and diameters (docs/accuracy.md)."""
    seconds: float | None = output("choice", unit="s", default=None, gt=0)
    """What the simulation may take, with those that it is made from. Checked: prices are those of one core of the
    machine that made resources/trade.csv."""
    memory: float | None = output("choice", unit="MB", default=None, gt=0)
    """By how much the memory of the process may grow. Checked: as ask.seconds."""
    among: tuple[Annotated[str, Field(min_length=1)], ...] = output(
        "choice",
        allowed="a list of fidelities to choose from, for example [rom3d, spline_yarns]; [] for all",
        default=(),
    )
    """Narrows what is taken. Checked: single ones."""


def asked(values: Any, where: str) -> Ask:
    """Return what a scene asks for; a ConfigurationError names the key, its value and what is allowed."""
    return validated(Ask, values, where, "ask.")


# ---- Pareto fronts: what nothing else beats in error and in price at once


Each = TypeVar("Each")

ALIKE = 0.01  # Relative difference of two errors that are the same


def front(
    points: Iterable[Each], price: Callable[[Each], float], error: Callable[[Each], float]
) -> list[Each]:
    """Return the points that no other is at most as dear as and as accurate, from the cheapest on.

    `price` and `error` are numbers of a point; the less the better. Errors that differ by less than `ALIKE` are alike:
    what is left of a tolerance buys no place on a front.
    """
    found: list[Each] = []
    for point in sorted(points, key=lambda each: (price(each), error(each))):
        if not found or error(point) < (1 - ALIKE) * error(found[-1]):
            found.append(point)
    return found


def cheapest(
    points: Iterable[Each], accuracy: float, price: Callable[[Each], float], error: Callable[[Each], float]
) -> Each | None:
    """Return the cheapest point whose error is at most an accuracy, if there is one."""
    good = [point for point in points if error(point) <= accuracy]
    return min(good, key=lambda point: (price(point), error(point)), default=None)


def nearest(points: Iterable[Each], error: Callable[[Each], float]) -> Each | None:
    """Return the most accurate point, if there is any."""
    return min(points, key=error, default=None)


def digits(value: float) -> str:
    """Return a number with two digits that count, whole from ten on; a dash where there is none."""
    if isnan(value):
        return "-"
    return f"{value:.0f}" if value >= 10 else f"{float(f'{value:.2g}'):g}"
