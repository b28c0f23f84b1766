"""Loops from course spacing, wale spacing, yarn and stitches: drawn, and optimised within limits.

The control points of a drawn loop (`drawn_loop`) move to where the bending and length terms of Eq. (1) are smallest
among the loops that have room (`loop_room`). The minimum is the wanted loop, or the thickest one that fits. A wanted
length follows in the same way. Of stitches that differ the loops of a whole repeat are one problem, whose symmetries
are kept. Lengths are in radii, but in metres in `Loop` and `LoopTarget`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.drawn_loop import LoopTarget
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.loop_room import EXACT, InfeasibleLoop, Path, Room
from knitstudy.knit.geometry.optimise import Optimum
from knitstudy.knit.geometry.stitches import PLAIN, images_of_standard, standard

STRIDE = 0.03  # share of the length by which a control point may move in one minimisation
SMALLEST_STRIDE = 1e-4  # and at least, or there is no way on
IDLE = 3e-5  # the same, below which the minimisation makes no headway
MIXED_PATIENCE = 4  # such minimisations one after the other, of stitches that differ, before the way ends
STATIONARY = 1e-3  # slope over the largest one of the bending and length terms that a minimum may have
RETREAT = 0.01  # share by which the yarn gets thinner where a minimisation makes no headway
GAIN = 1e-4  # share below which a loop that fits is no better than the one before
ABREAST = (2, 4)  # yarns that stand side by side in a course and in a wale spacing
MARGIN = 1e-3  # share of the way to a value by which a trial leaves more room
# Shares of the way to a free value for the next trial, where the loop has room
SHORTER = (0.95, 0.9, 0.8, 0.5, 0.5)
ROUNDS = 20  # minimisations from loop to loop


_End = tuple[Room, Optimum | None, str]
"""The last loop of a path, the outcome of its optimisation if it is the wanted one, else the reason."""


def fitted_loop(wanted: LoopTarget, settings: Any) -> tuple[Loop, Loop, Optimum]:
    """Return a loop as drawn and as optimised within the limits, and the outcome of its optimisation.

    `settings` are as for `knitstudy.knit.geometry.optimise.optimise`; of these beta, gamma, beta_0 and samples count.
    Raises InfeasibleLoop when no loop fits; it names the limits, and spacings, a diameter or a length that fit.
    """
    free, radius = replace(wanted, length=None), wanted.radius
    room, optimum, reason = start = _of_spacings(free, settings)
    if optimum is None:
        side = (1 + 0.5 * wanted.clearance) * 2 * radius
        bound = min(wanted.course / ABREAST[0], wanted.wale / ABREAST[1]) / side
        ways, nearest = (2 * radius * min(share, 1.0) for share in (max(room.share, bound), room.share)), ""
        thinner = _nearest(
            lambda trial: _of_spacings(replace(free, radius=0.5 * trial), settings), 0.0, *ways
        )
        if thinner:
            share = 0.5 * thinner / radius
            course, wale = (_millimetres(spacing / share) for spacing in (wanted.course, wanted.wale))
            nearest = (
                f"Loops fit of pattern.course_spacing {course} and pattern.wale_spacing {wale} mm, or of yarn.diameter "
                f"{_millimetres(thinner)} mm{'' if wanted.length is None else ', of free length'}"
            )
        raise room.refusal("no loop fits", reason, nearest, share if thinner else room.share)
    if wanted.length is not None:
        room, optimum, reason = _of_length(start[0], wanted.length / radius)
        if optimum is None:
            own = radius * start[0].unit.length
            length = _nearest(
                lambda trial: _of_length(start[0], trial / radius), own, room.share * (wanted.length - own)
            )
            nearest = f"A loop of {_millimetres(length)} mm fits, the free one" if length else "The free loop"
            # In all digits, lest it reads as the nearest one, which has four.
            what = f"no loop fits of pattern.loop_length {1e3 * wanted.length:.9g} mm"
            raise room.refusal(what, reason, f"{nearest} has {_millimetres(own)} mm", room.share)
    drawn = wanted.drawn()
    points = images_of_standard(optimum.points * radius, wanted.wale, wanted.course, wanted.stitches)
    return drawn, replace(drawn, control_points=points), optimum


def _nearest(end_of: Callable[[float], _End], free: float, way: float, less: float = 0.0) -> float | None:
    """Return the first value of four digits with which a loop fits, of as many as `SHORTER` has; None if none does.

    The first two are a way, and at least `less`, off a free value.
    """
    for shorter in SHORTER:
        trial = float(f"{free + (1 - MARGIN) * way:.4g}")
        try:
            room, optimum, _ = end_of(trial)
        except InfeasibleLoop:
            return None
        if optimum is not None:
            return trial
        # A path that ends where it begins, or at its end, does not say how far there is room.
        shorter = room.share if RETREAT < room.share < 1 - RETREAT else shorter
        way, less = max(way * shorter, less), 0.0
    return None


def _millimetres(length: float) -> str:
    return f"{1e3 * length:.4g}"


def _of_spacings(wanted: LoopTarget, settings: Any) -> _End:
    """Return the end of the path to the loop of free length; InfeasibleLoop where the drawn one does not interlock."""
    # A problem of another scale is the same one to the last bit, and so is its solution.
    spacings = (float(f"{spacing / wanted.radius:.12g}") for spacing in (wanted.course, wanted.wale))
    unit = LoopTarget(*spacings, 1.0, wanted.clearance, stitches=standard(wanted.stitches)[0])
    try:
        start = Room(unit.drawn(), Path(unit.rest_length, (0.0, 1.0)), None, settings)
    except GeometryError as error:
        remedy = "take a pattern.wale_spacing of 0.5 to 2 course spacings"
        raise InfeasibleLoop(
            f"no loop is drawn that interlocks: {_plain(error)}; {remedy}", ["interlock"], 0.0
        ) from error
    return _follow_path(start)


def _of_length(room: Room, length: float) -> _End:
    """Return the end of the path from a loop of free length to one of another length [radii]."""
    own, asked = room.unit.length, float(f"{length:.12g}")
    path = Path(asked, (1.0, 0.0), (own, asked - own))
    return _follow_path(Room(room.unit, path, 0.0, room.settings, room.crossing))


def _plain(error: GeometryError) -> str:
    """Return the text of an error without the name of a key that a drawn loop has not."""
    return str(error).removeprefix("pattern.control_points: ")


def _follow_path(room: Room) -> _End:
    """Go on from a loop until it is the wanted one or has no room: the last loop, the outcome, or why there is none.

    A minimisation moves control points by a stride at most. One that loses the interlock is repeated with a quarter of
    the stride.
    """
    best, before = room, room.cost.terms(room.unit.control_points)
    iterations, stride, idle, back, reason = 0, STRIDE, 0, False, ""
    patience = 1 if room.unit.stitches == PLAIN else MIXED_PATIENCE
    for _ in range(ROUNDS):
        reach = stride * room.path.rest
        try:
            result = room.minimise(reach)
            following = room.moved(result.x)
        except GeometryError as error:
            reason, stride = _plain(error), 0.25 * stride
            if stride < SMALLEST_STRIDE:
                if room.missing <= EXACT or back:
                    break
                # Out of a loop whose yarns overlap no way leads: on from the last that has room, more carefully.
                room, stride, back = best, 0.25 * STRIDE, True
            continue
        iterations += result.nit
        gradient, moved, there = room.stationary(result.x), np.abs(result.x[:-1]).max(), room.at_end
        room, stride = following, min(STRIDE, 2 * stride)
        idle = idle + 1 if moved < IDLE * room.path.rest else 0
        exact, gain = room.missing <= EXACT, room.share - (best.share if best.missing <= EXACT else -1.0)
        settled = idle or (moved < 0.99 * reach and (result.status == 0 or gradient < STATIONARY))
        if exact and there and settled:
            points = room.unit.control_points
            return room, Optimum(points, before, room.cost.terms(points), iterations, gradient), ""
        if exact and gain >= 0:
            best = room
        arrived = exact and room.at_end and not there  # at the wanted loop, which has its own minimum
        if (exact and not room.at_end and (settled or gain < GAIN)) or (idle > patience and not arrived):
            break
        # On from the share that pieces of its yarn leave free: closest points slide in flat valleys.
        if idle and not exact:
            share = min(room.share, room.near["distance"].min() / room.unit.target) - RETREAT
            room = Room(room.unit, room.path, share, room.settings, room.crossing)
    return best, None, reason or f"no other loop is found in {iterations} iterations"
