"""Points of accuracy and cost: one simulation and one question each, and lower bounds of their errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from knitstudy.measures.cases import label_of
from knitstudy.measures.cost import Expense
from knitstudy.measures.discretisation import is_direct, made_of
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.questions import Question
from knitstudy.study.configuration import default_keys
from knitstudy.study.scene import Scene

# ---- Which knobs of a model a scene has turned, and what models are called


KNOBS = (
    "mesh.growth",
    "mesh.refinement",
    "mesh.span",
    "mesh.crossing_span",
    "mesh.spline_degree",
    "mesh.beam_size",
    "contact.cell",
    "contact.window",
    "contact.points",
    "contact.normal_stiffness",
    "contact.tangential_stiffness",
    "contact.penetration",
    "contact.augmentations",
    "solver.increments",
    "solver.residual_tolerance",
    "solver.correction_tolerance",
    "solver.hourglass",
    "solver.linear",
    "beam.stiffness",
)
"""Keys that cost or change an answer, and do not name a model; the main models have their defaults."""


def model_of(scene: Scene) -> str:
    """Return what a model is called: of a direct simulation what it is made of, else its kind and variant."""
    return made_of(scene) if is_direct(scene) else label_of(scene)


def turned(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene that are not as in the main models, with their values."""
    main = _defaults()
    found = {key: scene.value(key) for key in KNOBS if scene.value(key) not in (None, main[key])}
    if (span := found.get("mesh.crossing_span")) is not None and (scene.mesh.crossing_degree, span) in _SPANS:
        del found["mesh.crossing_span"]
        if found.get("mesh.span") == _SPANS[scene.mesh.crossing_degree, span]:
            del found["mesh.span"]
    return found


@cache
def _defaults() -> dict[str, Any]:
    return default_keys()


_SPANS = {(3, 0.6): 0.9, (4, 0.5): 0.75, (5, 0.4): 0.6}
"""Spans of the legs that go with a degree and its spans at crossings: higher degrees come with shorter ones."""


WORDS = {
    "solver.increments": "increments: {}",
    "mesh.span": "spans of {} R",
    "mesh.crossing_span": "",
    "mesh.spline_degree": "splines of degree {}",
    "mesh.beam_size": "beams of {} m",
    "mesh.refinement": "",
    "solver.residual_tolerance": "tolerances of {}",
    "solver.correction_tolerance": "",
    "solver.linear": "{}",
    "contact.cell": "cells of {} R",
    "contact.window": "windows of {} R",
    "contact.points": "{} x {} points",
    "contact.normal_stiffness": "stiffness {} E / h",
    "contact.tangential_stiffness": "",
}
"""What turned knobs are called; nothing where another one or the model's name says it. Others go by their keys."""


def called(scene: Scene) -> str:
    """Return the model of a scene with the knobs that are turned, in words."""
    found = turned(scene)
    words = (WORDS.get(key, f"{key} {{}}").replace("{}", shown(value)) for key, value in found.items())
    return ", ".join([model_of(scene), *filter(None, words)])


def shown(value: Any) -> str:
    """Return the value of a knob."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)


# ---- One simulation and one question: how far off it is, and what it costs


REFERENCE = "reference"
"""What an error is to, where no two models bracket the quantity."""

TIES = "ties in place of contact"
"""What models are called that tie yarns which touch and stick."""


@dataclass(frozen=True)
class Point:
    """One simulation and one question.

    Attributes
    ----------
    scene : Scene
    interaction : str
        Of the problem: that of the scene, or contact that sticks, for which its ties stand in.
    question : Question
    quantity : str
        That of those which answer the question whose error may be the largest.
    strain : float
        Where it is compared.
    true : Estimate
        What it is compared with.
    source : str
        `REFERENCE`, or the models that bracket it.
    error : Estimate
        |value / true - 1| [1].
    expense : Expense
    answers : mapping of str to float
        Values of all quantities that answer the question, there.
    floor : float
        Error below which it counts as luck [1] (`bound_cheaper_settings`).
    """

    scene: Scene
    interaction: str
    question: Question
    quantity: str
    strain: float
    true: Estimate
    source: str
    error: Estimate
    expense: Expense
    answers: Mapping[str, float]
    floor: float = 0.0

    @property
    def value(self) -> float:
        """Of the quantity."""
        return self.answers[self.quantity]

    @property
    def bound(self) -> float:
        """The error and its uncertainty, and no less than luck: what it is at most."""
        return max(self.error.value + self.error.uncertainty, self.floor)

    @property
    def stands_in(self) -> bool:
        """Whether its yarns are tied where those of the problem touch."""
        return self.interaction != self.scene.interaction

    @property
    def model(self) -> str:
        """What its model is called (`knobs.model_of`)."""
        return self._said(model_of(self.scene))

    @property
    def called(self) -> str:
        """The same with the knobs that are turned (`knobs.called`)."""
        return self._said(called(self.scene))

    def no_surer_than(self, bound: float) -> Point:
        """Return it with a floor that is no lower than some error."""
        return replace(self, floor=max(self.floor, bound))

    def _said(self, model: str) -> str:
        return f"{TIES}, {model}" if self.stands_in else model


# ---- Errors that are small by luck: what has come out on one knit need not on others
# Two errors that cancel make a model look surer than it is. Where one of them is known to be there, the error at most
# is no smaller than without the other (docs/accuracy.md).


def bound_cheaper_settings(points: list[Point]) -> list[Point]:
    """Return all points; what saves adds its change to the error of its model.

    Longer spans, fewer increments or looser tolerances change an answer: by as much as they do on any of the knits
    they may be farther off than the model with no knob turned, even if here they have come nearer. Nor are several of
    them surer than some are alone.
    """
    knobs = {point.scene.name: turned(point.scene) for point in points}
    alike: dict[tuple, list[Point]] = {}
    for point in points:
        alike.setdefault(_of_one_model(point), []).append(point)

    def saves(point: Point, other: Point) -> bool:
        """Whether a point turns more knobs than another, and costs less for it."""
        more = knobs[point.scene.name].items() > knobs[other.scene.name].items()
        return more and point.expense.seconds < other.expense.seconds

    saved = [[other for other in alike[_of_one_model(point)] if saves(point, other)] for point in points]
    wholes = [next((other for other in others if not knobs[other.scene.name]), None) for others in saved]
    largest: dict[tuple, float] = {}
    for point, whole in zip(points, wholes, strict=True):
        if whole is not None:
            largest[_answer(point)] = max(largest.get(_answer(point), 0.0), _change(point, whole))
    changed = [
        point if whole is None else point.no_surer_than(whole.bound + largest[_answer(point)])
        for point, whole in zip(points, wholes, strict=True)
    ]
    bound = {id(point): new.bound for point, new in zip(points, changed, strict=True)}
    return [
        new.no_surer_than(max((bound[id(other)] for other in others), default=0.0))
        for new, others in zip(changed, saved, strict=True)
    ]


def worst_over_directions(points: list[Point]) -> list[Point]:
    """Return all points; yarns that touch without being solid are no surer in one direction of load than in the other.

    Beams do not tend to solids: how far what stands for contact makes up for what joints lack hangs on the direction.
    """
    worst: dict[tuple, float] = {}
    for point in points:
        worst[_either_way(point)] = max(worst.get(_either_way(point), 0.0), point.bound)
    return [point.no_surer_than(worst[_either_way(point)]) if _is_crude(point) else point for point in points]


def bound_ties_in_place_of_contact(points: list[Point]) -> list[Point]:
    """Return all points; none whose ties stand in for contact is surer than the same simulation is of ties."""
    of_ties = {
        (point.scene.name, point.question.name): point.bound for point in points if not point.stands_in
    }
    bounds = (of_ties.get((point.scene.name, point.question.name), 0.0) for point in points)
    return [
        point.no_surer_than(bound) if point.stands_in else point
        for point, bound in zip(points, bounds, strict=True)
    ]


def _of_one_model(point: Point) -> tuple:
    """Return what points of one model, problem and question share, whatever knobs they turn."""
    scene = point.scene
    of_problem = (point.interaction, scene.load.direction, scene.pattern.loops, scene.pattern.rows)
    return (point.question.name, *of_problem, point.model, point.strain)


def _answer(point: Point) -> tuple:
    """Return what points of one model and its knobs share that answer one question, of whatever knit."""
    return point.question.name, point.interaction, point.called


def _change(point: Point, whole: Point) -> float:
    """Return the largest relative difference of the answers of two points."""
    values = ((value, whole.answers.get(name, 0.0)) for name, value in point.answers.items())
    return max((abs(value / other - 1) for value, other in values if other), default=0.0)


def _is_crude(point: Point) -> bool:
    """Whether yarns touch and are not solid."""
    return not is_direct(point.scene) and point.scene.kind.interaction.touches


def _either_way(point: Point) -> tuple:
    """Return what points of the same model of the same knit share, whatever direction it is pulled in."""
    pattern = point.scene.pattern
    return point.question.name, point.interaction, pattern.loops, pattern.rows, point.called
