"""Points of accuracy and cost: one simulation and one question each, and bounds of errors that are small by chance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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

# Settings that change the cost or the answer, defaults in main models; keys that name a model are not here.
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

# Spans of the legs that go with a degree and its spans at crossings: higher degrees come with shorter ones.
SPANS = {(3, 0.6): 0.9, (4, 0.5): 0.75, (5, 0.4): 0.6}

# Changed settings in words, else by their keys; empty where another setting or the model's name says it.
WORDS = {
    "solver.increments": "increments: {}",
    "mesh.span": "spans of {} R",
    "mesh.crossing_span": "",
    "mesh.spline_degree": "splines of degree {}",
    "mesh.beam_size": "beams of {} R",
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


def model_of(scene: Scene) -> str:
    """Return the name of a model: the discretisation of a direct simulation, else the kind and variant."""
    return made_of(scene) if is_direct(scene) else label_of(scene)


@cache
def _defaults() -> dict[str, Any]:
    return default_keys()


def turned(scene: Scene) -> dict[str, Any]:
    """Return the settings of a scene that differ from those of the main models."""
    main = _defaults()
    found = {key: scene.value(key) for key in KNOBS if scene.value(key) not in (None, main[key])}
    if (span := found.get("mesh.crossing_span")) is not None and (scene.mesh.crossing_degree, span) in SPANS:
        del found["mesh.crossing_span"]
        if found.get("mesh.span") == SPANS[scene.mesh.crossing_degree, span]:
            del found["mesh.span"]
    return found


def called(scene: Scene) -> str:
    """Return the model of a scene with its changed settings, in words."""
    found = turned(scene)
    words = (WORDS.get(key, f"{key} {{}}").replace("{}", shown(value)) for key, value in found.items())
    return ", ".join([model_of(scene), *filter(None, words)])


def shown(value: Any) -> str:
    """Return the value of a setting as text."""
    return f"{value:.4g}" if isinstance(value, int | float) else str(value)


REFERENCE = "reference"  # Source of a true value that is in the reference
TIES = "ties in place of contact"  # Begins the name of a model


@dataclass(frozen=True)
class Point:
    """One simulation and one question."""

    scene: Scene
    # Interaction of the problem: that of the scene, or contact that sticks, which ties replace
    interaction: str
    question: Question
    quantity: str  # of the quantities that answer the question, the one whose error may be the largest
    strain: float  # strain at which it is compared
    true: Estimate
    source: str  # of the true value: `REFERENCE`, or the two models between which it lies
    error: Estimate  # |value / true - 1| [1]
    expense: Expense
    answers: Mapping[str, float]  # values of all quantities that answer the question
    floor: float = 0.0  # lower bound of the error [1]: a smaller one is chance

    @property
    def value(self) -> float:
        """Value of the quantity."""
        return self.answers[self.quantity]

    @property
    def bound(self) -> float:
        """Upper bound of the error: the error and its uncertainty, at least the lower bound."""
        return max(self.error.value + self.error.uncertainty, self.floor)

    @property
    def stands_in(self) -> bool:
        """Whether yarns are tied where those of the problem touch."""
        return self.interaction != self.scene.interaction

    @property
    def model(self) -> str:
        """Name of the model (`model_of`)."""
        return f"{TIES}, {model_of(self.scene)}" if self.stands_in else model_of(self.scene)

    @property
    def called(self) -> str:
        """The same with the changed settings (`called`)."""
        return f"{TIES}, {called(self.scene)}" if self.stands_in else called(self.scene)

    def at_least(self, bound: float) -> Point:
        """Return the point with a lower bound that is no smaller than an error."""
        return replace(self, floor=max(self.floor, bound))


# Two errors that cancel make a model look more accurate than it is on other knits. Where one of them is known, the
# error of the model is taken to be no smaller than without the other (docs/trade.md).


def bound_cheaper_settings(points: list[Point]) -> list[Point]:
    """Return all points; cheaper settings inherit their deviation from the model with its main settings.

    Longer spans, fewer increments or looser tolerances change an answer. The largest change on any knit is added to the
    error of the model with its main settings. Several cheaper settings together are no more accurate than some of them.
    """
    knobs = {point.scene.name: turned(point.scene) for point in points}
    alike: dict[tuple, list[Point]] = {}
    for point in points:
        alike.setdefault(_of_one_model(point), []).append(point)

    def is_cheaper(point: Point, other: Point) -> bool:
        """Whether a point has all changed settings of another and more, and costs less."""
        more = knobs[point.scene.name].items() > knobs[other.scene.name].items()
        return more and point.expense.seconds < other.expense.seconds

    dearer = [
        [other for other in alike[_of_one_model(point)] if is_cheaper(point, other)] for point in points
    ]
    mains = [next((other for other in others if not knobs[other.scene.name]), None) for others in dearer]
    largest: dict[tuple, float] = {}
    for point, main in zip(points, mains, strict=True):
        if main is not None:
            largest[_answer(point)] = max(largest.get(_answer(point), 0.0), _change(point, main))
    changed = [
        point if main is None else point.at_least(main.bound + largest[_answer(point)])
        for point, main in zip(points, mains, strict=True)
    ]
    bound = {id(point): new.bound for point, new in zip(points, changed, strict=True)}
    return [
        new.at_least(max((bound[id(other)] for other in others), default=0.0))
        for new, others in zip(changed, dearer, strict=True)
    ]


def worst_over_directions(points: list[Point]) -> list[Point]:
    """Return all points; yarns that touch and are not solid have the larger error of both directions of load.

    Beams do not converge to solids: how far the law of contact makes up for compliant joints hangs on the direction.
    """
    worst = _largest_bound(points, _either_way)
    return [point.at_least(worst[_either_way(point)]) if _is_crude(point) else point for point in points]


def bound_ties_in_place_of_contact(points: list[Point]) -> list[Point]:
    """Return all points; ties in place of contact have at least the error that the same simulation has of ties."""

    def place(point: Point) -> tuple:
        return point.scene.name, point.question.name

    of_ties = _largest_bound([point for point in points if not point.stands_in], place)
    return [point.at_least(of_ties.get(place(point), 0.0)) if point.stands_in else point for point in points]


def _largest_bound(points: list[Point], place: Callable[[Point], tuple]) -> dict[tuple, float]:
    worst: dict[tuple, float] = {}
    for point in points:
        worst[place(point)] = max(worst.get(place(point), 0.0), point.bound)
    return worst


def _of_one_model(point: Point) -> tuple:
    """Return what points of one model, problem and question share, whatever their settings."""
    scene = point.scene
    of_problem = (point.interaction, scene.load.direction, scene.pattern.loops, scene.pattern.rows)
    return (point.question.name, *of_problem, point.model, point.strain)


def _answer(point: Point) -> tuple:
    """Return what points of one model with its settings share that answer one question, on any knit."""
    return point.question.name, point.interaction, point.called


def _change(point: Point, main: Point) -> float:
    """Return the largest relative difference of the answers of two points."""
    values = ((value, main.answers.get(name, 0.0)) for name, value in point.answers.items())
    return max((abs(value / other - 1) for value, other in values if other), default=0.0)


def _is_crude(point: Point) -> bool:
    """Whether yarns touch and are not solid."""
    return not is_direct(point.scene) and point.scene.kind.interaction.touches


def _either_way(point: Point) -> tuple:
    """Return what points of one model of one knit share in both directions of load."""
    pattern = point.scene.pattern
    return point.question.name, point.interaction, pattern.loops, pattern.rows, point.called
