"""What accuracy costs: every simulation of a problem that something is known of, by question, error and expense."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import pandas as pd
import xarray as xr

from knitstudy.measures.bracket import Bracket, bracket
from knitstudy.measures.discretisation import is_direct
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.expense import Expense, expense_of
from knitstudy.measures.knobs import called, model_of, turned
from knitstudy.measures.problem import loops_of, problem_of, sticks, tied_problem_of
from knitstudy.measures.quantities import STRAINS
from knitstudy.measures.questions import BEAM_SLIP, QUESTIONS, SLIP, Question, answers, known
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.study.scene import Scene

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
    strain, value : float
        Where it is compared, and its value there.
    true : Estimate
        What it is compared with.
    source : str
        `REFERENCE`, or the models that bracket it.
    error : Estimate
        |value / true - 1| [1].
    expense : Expense
    floor : float
        Error below which it counts as luck [1]: that of the same model with no knob turned, where that costs more, and
        that of ties where yarns are tied.
    """

    scene: Scene
    interaction: str
    question: Question
    quantity: str
    strain: float
    value: float
    true: Estimate
    source: str
    error: Estimate
    expense: Expense
    floor: float = 0.0

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

    def _said(self, model: str) -> str:
        return f"{TIES}, {model}" if self.stands_in else model


@dataclass
class _Problem:
    """All simulations of one problem, and those of the same knit with ties, where its yarns stick where they touch."""

    interaction: str
    reference: Reference
    scenes: list[Scene] = field(default_factory=list)
    tied: list[Scene] = field(default_factory=list)


def points_of(
    histories: Mapping[str, xr.Dataset],
    contacts: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    table: pd.DataFrame,
) -> list[Point]:
    """Return all points, problem by problem in the order of the scenes, question by question.

    Problems are those of the reference and those like them that are larger, or are asked what it does not know.

    Parameters
    ----------
    histories, contacts : mapping of str to Dataset
        Of knits by scene; contacts of direct simulations.
    scenes : mapping of str to Scene
    table : DataFrame
        ``resources/reference/reference.csv``.
    """
    scenes = {name: scene for name, scene in scenes.items() if name in histories}
    problems = _problems(scenes, table)
    return _no_surer_than_tied(
        [
            point
            for problem in problems.values()
            for question in QUESTIONS.values()
            for point in without_luck(list(_points(question, problem, histories, contacts)))
        ]
    )


def without_luck(points: list[Point]) -> list[Point]:
    """Return points of one problem and question; none that saves is surer than its model with no knob turned.

    Longer spans or looser tolerances take from a model; where its error becomes smaller for that two errors have
    cancelled on this knit, which they need not do on others.
    """
    main = {(point.model, point.strain): point for point in reversed(points) if not turned(point.scene)}
    found = []
    for point in points:
        whole = main.get((point.model, point.strain))
        saves = whole is not None and point.expense.seconds < whole.expense.seconds
        found.append(replace(point, floor=whole.bound) if saves else point)
    return found


def _no_surer_than_tied(points: list[Point]) -> list[Point]:
    """Return all points; none whose ties stand in for contact is surer than the same simulation is of ties."""
    of_ties = {
        (point.scene.name, point.question.name): point.bound for point in points if not point.stands_in
    }
    floors = (of_ties.get((point.scene.name, point.question.name), 0.0) for point in points)
    return [
        replace(point, floor=max(point.floor, floor)) if point.stands_in else point
        for point, floor in zip(points, floors, strict=True)
    ]


def as_direct(scene: Scene, scenes: Mapping[str, Scene]) -> Scene | None:
    """Return a direct simulation of the problem that a scene is a model of: itself, its source, or one like it."""
    if is_direct(scene):
        return scene
    if (source := scenes.get(scene.value("rom.contacts_from"))) is not None:
        return source
    same = (
        "knit",
        "interaction",
        "yarn",
        "load.direction",
        "load.lateral",
        "contact.friction",
        "contact.tied_edges",
        "tie.radius",
    )
    alike = (other for other in scenes.values() if is_direct(other))
    return next(
        (other for other in alike if all(scene.value(key) in (None, other.value(key)) for key in same)), None
    )


def _problems(scenes: Mapping[str, Scene], table: pd.DataFrame) -> dict[str, _Problem]:
    """Return the problems that the reference knows, and others of its loops under its interactions, by their digest."""
    found: dict[str, _Problem] = {}
    kin, of = set(), {}
    for name, scene in scenes.items():
        direct = as_direct(scene, scenes)
        if direct is not None:
            of[name], problem = direct, problem_of(direct)
            if problem not in found:
                found[problem] = _Problem(direct.interaction, reference_of(table, direct))
            found[problem].scenes.append(scene)
            if found[problem].reference.known:
                kin.add(_kin(direct))
    kept = {}
    for problem, each in found.items():
        direct = of[each.scenes[0].name]
        if each.reference.known or _kin(direct) in kin:
            tied = found.get(tied_problem_of(direct)) if sticks(direct) else None
            kept[problem] = replace(each, tied=tied.scenes if tied else [])
    return kept


def _kin(scene: Scene) -> tuple:
    return loops_of(scene), scene.interaction, scene.value("contact.friction")


def _points(
    question: Question,
    problem: _Problem,
    histories: Mapping[str, xr.Dataset],
    contacts: Mapping[str, xr.Dataset],
) -> Iterator[Point]:
    """Yield the points of a problem, each at the largest strain of the reference that it reaches."""
    scenes = [*problem.scenes, *problem.tied]
    reached = {scene.name: _reached(histories[scene.name]) for scene in scenes}
    for strain in sorted({strain for strain in reached.values() if strain}):
        found = {
            scene.name: answers(question, scene, histories[scene.name], contacts.get(scene.name), strain)
            for scene in scenes
            if (reached[scene.name] or 0) >= strain
        }
        brackets: dict[str, Bracket] = {}
        for scene in scenes:
            expense = expense_of(scene, histories)
            if reached[scene.name] != strain or expense is None:
                continue
            errors = [
                (quantity, value, *_true(quantity, strain, problem, found, brackets))
                for quantity, value in found[scene.name].items()
            ]
            compared = [
                Point(
                    scene,
                    problem.interaction,
                    question,
                    quantity,
                    strain,
                    value,
                    true,
                    source,
                    _error(value, true),
                    expense,
                )
                for quantity, value, true, source in errors
                if true.known
            ]
            if compared:
                yield max(compared, key=lambda point: point.bound)


def _reached(history: xr.Dataset) -> float | None:
    """Return the largest strain of the reference that a history reaches, if any."""
    end = float(history["strain"][-1]) * (1 + 1e-6)
    return max((strain for strain in STRAINS if strain <= end), default=None)


def _true(
    quantity: str,
    strain: float,
    problem: _Problem,
    found: Mapping[str, Mapping[str, float]],
    brackets: dict[str, Bracket],
) -> tuple[Estimate, str]:
    """Return what a quantity is, and what says so: the reference, else the finest two models."""
    estimate = known(problem.reference, quantity, strain)
    if estimate.known:
        return estimate, REFERENCE
    quantity = SLIP if quantity == BEAM_SLIP else quantity
    if quantity not in brackets:
        own = {scene.name: scene for scene in problem.scenes}
        values = {name: each[quantity] for name, each in found.items() if quantity in each and name in own}
        brackets[quantity] = bracket(values, own)
    return brackets[quantity].estimate, f"between {brackets[quantity].said}"


def _error(value: float, true: Estimate) -> Estimate:
    return true.of(lambda other: abs(value / other - 1))
