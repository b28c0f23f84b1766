"""Errors that are small by luck: what has come out on one knit need not on others.

Two errors that cancel make a model look surer than it is. Where one of them is known to be there, the error at most is
no smaller than without the other (docs/trade.md).
"""

from __future__ import annotations

from knitstudy.measures.discretisation import is_direct
from knitstudy.measures.knobs import turned
from knitstudy.measures.trade_point import Point


def no_surer_for_less(points: list[Point]) -> list[Point]:
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


def no_surer_in_one_direction(points: list[Point]) -> list[Point]:
    """Return all points; yarns that touch without being solid are no surer in one direction of load than in the other.

    Beams do not tend to solids: how far what stands for contact makes up for what joints lack hangs on the direction.
    """
    worst: dict[tuple, float] = {}
    for point in points:
        worst[_either_way(point)] = max(worst.get(_either_way(point), 0.0), point.bound)
    return [point.no_surer_than(worst[_either_way(point)]) if _is_crude(point) else point for point in points]


def no_surer_than_ties(points: list[Point]) -> list[Point]:
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
