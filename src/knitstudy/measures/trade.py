"""What accuracy costs: all simulations of a problem by question, error and expense, and what their fronts say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd
import xarray as xr

from knitstudy.measures.catalogue import Datasets, Scenes
from knitstudy.measures.cost import expense_of
from knitstudy.measures.discretisation import (
    NAMES,
    discretisation,
    finer,
    is_direct,
    loops_of,
    made_of,
    problem_of,
    sticks,
    tied_problem_of,
)
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.questions import BEAM_SLIP, QUESTIONS, SLIP, Question, answers, known
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.measures.response import STRAINS
from knitstudy.measures.trade_points import (
    REFERENCE,
    Point,
    bound_cheaper_settings,
    bound_ties_in_place_of_contact,
    worst_over_directions,
)
from knitstudy.study.choice import digits
from knitstudy.study.scene import Scene

# Only these independent models may bound a value, in order of preference.
TRUST = ("quadratic hexahedra", "solid yarns", "one-point hexahedra", "rom3d patch", "beam hertz patch")


def family_of(scene: Scene) -> str:
    """Return the independent model of which a scene is one resolution."""
    if is_direct(scene):
        return discretisation(scene)
    variants = (scene.value(key) for key in ("rom.joint", "beam.section", "beam.tie"))
    return " ".join([scene.fidelity, *filter(None, variants)])


def bracket(values: Mapping[str, float], scenes: Scenes) -> tuple[Estimate, str]:
    """Return the mean of the first two models of `TRUST`, each by its finest resolution, and both in words.

    Half of their difference is the uncertainty. Values are of one quantity of one problem, by scene.
    """
    finest: dict[str, Scene] = {}
    for scene in (scenes[name] for name in values):
        known = finest.setdefault(family_of(scene), scene)
        if is_direct(scene) and finer(scene, known):
            finest[family_of(scene)] = scene
    taken = [finest[family] for family in TRUST if family in finest][:2]
    if len(taken) < 2:
        return UNKNOWN, ""
    one, other = (values[scene.name] for scene in taken)
    said = " and ".join(made_of(scene) if is_direct(scene) else NAMES[scene.fidelity] for scene in taken)
    return Estimate(0.5 * (one + other), 0.5 * abs(one - other)), f"between {said}"


@dataclass
class _Problem:
    """All simulations of one problem, and those of the same knit with ties where its yarns cannot slip."""

    interaction: str
    reference: Reference
    scenes: list[Scene] = field(default_factory=list)
    tied: list[Scene] = field(default_factory=list)


def points_of(histories: Datasets, contacts: Datasets, scenes: Scenes, table: pd.DataFrame) -> list[Point]:
    """Return all points, problem by problem in the order of the scenes, question by question.

    Problems are those with a reference, and problems of the same loops and interactions of other size.
    """
    scenes = {name: scene for name, scene in scenes.items() if name in histories}
    problems = _problems(scenes, table)
    points = [
        point
        for problem in problems.values()
        for question in QUESTIONS.values()
        for point in _points(question, problem, histories, contacts)
    ]
    return bound_ties_in_place_of_contact(worst_over_directions(bound_cheaper_settings(points)))


def as_direct(scene: Scene, scenes: Scenes) -> Scene | None:
    """Return a direct simulation of the problem of a scene: the scene itself, its source, or one like it."""
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


def _problems(scenes: Scenes, table: pd.DataFrame) -> dict[str, _Problem]:
    """Return by digest the problems with a reference, and others of the same loops and interactions."""
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
    question: Question, problem: _Problem, histories: Datasets, contacts: Datasets
) -> Iterator[Point]:
    """Yield the points of a problem, each at the largest strain of the reference that it reaches.

    Ties in place of contact have at least the error that is certain at smaller strains: on other knits yarns touch
    sooner or later.
    """
    expenses = {
        scene.name: expense
        for scene in (*problem.scenes, *problem.tied)
        if (expense := expense_of(scene, histories)) is not None
    }
    scenes = {scene.name: scene for scene in (*problem.scenes, *problem.tied) if scene.name in expenses}
    reached = {name: _reached(histories[name]) for name in scenes}
    on_the_way: dict[str, float] = {}
    for strain in STRAINS if problem.tied else sorted({strain for strain in reached.values() if strain}):
        found = {
            name: answers(question, scene, histories[name], contacts.get(name), strain)
            for name, scene in scenes.items()
            if (reached[name] or 0) >= strain
        }
        brackets: dict[str, tuple[Estimate, str]] = {}
        for name, values in found.items():
            compared = [
                Point(
                    scene=scenes[name],
                    interaction=problem.interaction,
                    question=question,
                    quantity=quantity,
                    strain=strain,
                    true=true,
                    source=source,
                    error=true.of(lambda other, value=value: abs(value / other - 1)),
                    expense=expenses[name],
                    answers=values,
                    floor=on_the_way.get(name, 0.0),
                )
                for quantity, value in values.items()
                for true, source in [_true(quantity, strain, problem, found, brackets)]
                if true.known
            ]
            if compared and reached[name] == strain:
                yield max(compared, key=lambda point: point.bound)
            for point in filter(lambda point: point.stands_in, compared):
                on_the_way[name] = max(on_the_way.get(name, 0.0), point.error.value - point.error.uncertainty)


def _reached(history: xr.Dataset) -> float | None:
    """Return the largest strain of the reference that a history reaches, if any."""
    end = float(history["strain"][-1]) * (1 + 1e-6)
    return max((strain for strain in STRAINS if strain <= end), default=None)


def _true(
    quantity: str,
    strain: float,
    problem: _Problem,
    found: Mapping[str, Mapping[str, float]],
    brackets: dict[str, tuple[Estimate, str]],
) -> tuple[Estimate, str]:
    """Return the true value of a quantity and its source: the reference, else the finest two models."""
    estimate = known(problem.reference, quantity, strain)
    if estimate.known:
        return estimate, REFERENCE
    quantity = SLIP if quantity == BEAM_SLIP else quantity
    if quantity not in brackets:
        own = {scene.name: scene for scene in problem.scenes}
        values = {name: each[quantity] for name, each in found.items() if quantity in each and name in own}
        brackets[quantity] = bracket(values, own)
    return brackets[quantity]


ACCURACIES = (0.20, 0.10, 0.05, 0.02)  # Accuracies of the sentences [1]


def sentence(words: str, accuracy: float, name: str, seconds: float, memory: float, error: float) -> str:
    """Return the sentence about the cheapest model for an accuracy.

    >>> sentence("force", 0.05, "3D ROM, patch joints", 1.04, 14.9, 0.011)
    'For 5 % in force take 3D ROM, patch joints: 1 s, 15 MB (error at most 1.1 %).'
    """
    return (
        f"For {100 * accuracy:g} % in {words} take {name}: {digits(seconds)} s, {digits(memory)} MB "
        f"(error at most {digits(100 * error)} %)."
    )


def nothing(words: str, accuracy: float, name: str, error: float) -> str:
    """Return the sentence about an accuracy that no model reaches, with the nearest one."""
    return (
        f"Nothing measured gives {words} within {100 * accuracy:g} %: {name} comes nearest with "
        f"{digits(100 * error)} %."
    )


def rungs(seconds: Sequence[float], errors: Sequence[float]) -> dict[str, bool]:
    """Return which rungs a front has: under 1 s, under 30 s, within 2 %."""
    return {
        "under 1 s": any(value < 1 for value in seconds),
        "under 30 s": any(value < 30 for value in seconds),
        "within 2 %": any(value <= 0.02 for value in errors),
    }
