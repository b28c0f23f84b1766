"""Loops from course spacing, wale spacing, yarn and stitches: drawn, and optimised within limits.

The control points of a drawn loop move to where the bending and length terms of Eq. (1) are smallest among the loops
that have room (sequential quadratic programming): yarns stand exactly 2R + c0 apart at the crossings, all other pieces
of yarn at least as far, and the yarn bends to R / rho of at most `LARGEST_CURVATURE`. The share of the radius that the
yarn has is an unknown as well, and a share below 1 costs more than all bending. The minimum is the wanted loop, or the
thickest one that fits. A wanted length follows in the same way. Of stitches that differ the loops of a whole repeat are
one problem, whose symmetries are kept. Lengths are in radii, but in metres in `Loop` and `LoopTarget`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.crossings import Approach, crossings_of_loop, refine
from knitstudy.knit.geometry.loop import POINTS, Loop, LoopTarget
from knitstudy.knit.geometry.loop_metrics import approaches, away_from_crossings, smallest_radius_of_curvature
from knitstudy.knit.geometry.optimise import CostFunction, Optimum, interlocked
from knitstudy.knit.geometry.stitches import PLAIN, images_of_standard, standard
from knitstudy.knit.geometry.symmetry import first_of_orbits, symmetric_motions, symmetries
from knitstudy.mechanics.core.arrays import Floats

LARGEST_CURVATURE = 0.9  # R / rho that a loop may have; sections of a yarn cut each other at 1
BENT = 0.5  # R / rho above which pieces of mixed stitches are kept below that
CURVATURE_SAMPLES = 8  # a Bezier segment, both of its ends among them
NEAR = 3.0  # distance of centrelines in radii up to which pieces of yarn may be kept apart
WATCHED = 0.3  # radii beyond the clearance up to which they are
SLIDE = 0.5  # Bezier segments by which the closest points of two pieces may move in one minimisation
EXACT = 5e-5  # radii by which distances, and the length, may miss their target
LACK = 1e3  # cost of a share below 1, over the largest slope of the bending and length terms
ACTIVE = 0.03  # distance from a limit below which it is named as the reason why no thicker yarn fits
ITERATIONS = 60  # of a minimisation

_Valued = tuple[Floats, Floats, Floats]


class InfeasibleLoop(GeometryError):
    """No loop fits: the limits that the nearest one which does has reached, and its share of the diameter."""

    def __init__(self, message: str, limits: Iterable[str], share: float) -> None:
        super().__init__(message)
        self.limits = tuple(limits)
        self.share = share


@dataclass(frozen=True)
class FreePath:
    """Targets of a loop at a share of the way: radius and length a + share b, in radii of the wanted yarn."""

    rest: float  # length that the length term of Eq. (1) aims at
    radius: tuple[float, float]
    length: tuple[float, float] | None = None


class Room:
    """A loop, and cost and constraints of its symmetric motions and of the share: functions of x (n + 1,)."""

    def __init__(
        self,
        unit: Loop,
        path: FreePath,
        share: float | None,
        settings: Any,
        at: Any = None,  # crossings without images, and where they are looked for
    ) -> None:
        self.unit, self.path, self.settings = unit, path, settings
        self._plain, self._group = unit.stitches == PLAIN, symmetries(unit)
        self.cost = CostFunction(unit, settings)
        count = len(unit.control_points)
        self.cost.rest_length, self.cost.sigma = np.full((2, count), path.rest / POINTS)
        self._motions = symmetric_motions(np.ones((count, 3), dtype=bool), self._group)
        crossing = self._find_crossings(at)
        share = crossing.distance.min() / unit.target if share is None else share
        self.share = 1.0 if share > 1 - EXACT else float(share)
        self._start = np.append(np.zeros(self._motions.shape[-1]), self.share)
        self._find_pairs(crossing.parameter)
        self._find_bends()
        # Rows that are no images of each other: of each the length is asked for.
        of_row = np.min([image.row(np.arange(unit.rows)) % unit.rows for image in self._group], axis=0)
        self._own_rows = np.unique(of_row)
        self._unit = np.abs(self.cost.value(unit.control_points, share=0.0)[1]).max() or 1.0
        self._kept: tuple[bytes, Any] = b"", None
        # In the order of `evaluate`: the cost, what must vanish, and what must not be negative.
        equal = 1 + len(crossing.distance) * self._plain
        equal += 0 if path.length is None else len(self._own_rows)
        self._cost, self._equal, self._above = 0, slice(1, equal), slice(equal, None)
        start = self.evaluate(self._start)[0]
        self.missing = max(np.abs(start[self._equal]).max(initial=0.0), -start[self._above].min())
        self.at_end = self.share == 1 and self.missing <= 10 * EXACT

    def _find_crossings(self, at: Any) -> Approach:
        """Find the crossings that are no images of others. Raises GeometryError where yarns do not interlock."""
        unit, cost = self.unit, self.cost
        self._every = np.column_stack([cost.row, cost.row + 1])
        if at is None:
            crossings = crossings_of_loop(unit, cost.row, cost.windows)
            at = np.flatnonzero(first_of_orbits(self._group, self._every, crossings.parameter)), None
        first, start = at
        crossing = crossings_of_loop(unit, cost.row[first], cost.windows[first], start=start)
        self.crossing = first, crossing.parameter
        if not interlocked(cost) or (self._plain and not crossing.interior.all()):
            raise GeometryError("an interlock loses its crossings")
        return crossing

    def _find_pairs(self, crossing: Floats) -> None:
        """Find the other pieces of yarn that come near each other, and windows of these and of the crossings."""
        unit = self.unit
        first = self.crossing[0]
        # The images of these crossings by the symmetries are all others.
        of_images = zip(*(image.pairs(self._every[first], crossing) for image in self._group), strict=True)
        rows, images = (np.concatenate(parts) for parts in of_images)
        near = away_from_crossings(approaches(unit, NEAR), rows[:, 0], images)
        near = near[near["distance"] < unit.target + WATCHED]
        pairs = near[["row", "above"]].to_numpy().astype(int).cumsum(axis=1)
        places = near[["u", "v"]].to_numpy()
        different = first_of_orbits(self._group, pairs, places)  # of images by symmetry one is enough
        self.near, pairs, places = near[different], pairs[different], places[different]
        # Windows of places do not overlap, lest two of them end at one.
        apart = np.abs(places[:, None] - np.concatenate([images, places])).max(axis=-1)
        alike = (pairs[:, None] == np.concatenate([rows, pairs])).all(axis=-1)
        nearest = np.where((apart > 0) & alike, apart, np.inf).min(axis=1, initial=np.inf)
        own = np.where(np.ptp(pairs, axis=1) > 0, np.inf, 0.5 * np.diff(places)[:, 0])
        reach = np.minimum(SLIDE, 0.5 * np.minimum(nearest, own))
        of_crossings = self.cost.windows if self._plain else _of_sides(self.cost.windows)
        windows = places[:, :, None] + reach[:, None, None] * [-1, 1]
        self._rows = np.concatenate([self._every[first], pairs])
        self._places = np.concatenate([crossing, places])
        self._windows = np.concatenate([of_crossings[first], windows])

    def _find_bends(self) -> None:
        """Find the places at which the yarn's curvature is kept, of the segments that are no images of others."""
        points, curves = self.unit.control_points, self.cost.curves
        row, segment = np.divmod(np.arange(len(points)), self.unit.curve.period)
        middle = np.stack([segment + 0.5] * 2, axis=1)
        one = first_of_orbits(self._group, np.stack([row] * 2, axis=1), middle)
        u = (segment[one, None] + np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)).ravel()
        row = np.repeat(row[one], CURVATURE_SAMPLES)
        if not self._plain:  # of many loops the straight pieces would only cost time
            bent = curves(points, row).curvature(u) > BENT
            u, row = u[bent], row[bent]
        self._tangent, self._bend = (curves(points, row).operator(u, order) for order in (1, 2))

    def refusal(self, what: str, reason: str, nearest: str, share: float) -> InfeasibleLoop:
        """Return the error for loops beyond this last one that fits: the limits it has reached, or the reason.

        `nearest` names values with which a loop of `share` of the radius fits.
        """
        quantities = {}
        if self.missing <= EXACT and not self.at_end:
            radius = np.dot(self.path.radius, [1, self.share])
            bend = radius / smallest_radius_of_curvature(*self.unit.curves)
            touching = self.near["distance"] < radius * self.unit.target + ACTIVE
            for row in sorted(set(self.near["above"][touching].astype(int))):
                whose = ("one row", "neighbouring rows")[row] if row < 2 else f"rows {row} apart"
                quantities["row" if row == 0 else "rows"] = f"yarns of {whose} touch beside the crossings"
            if bend > LARGEST_CURVATURE - ACTIVE:
                quantities["curvature"] = (
                    f"the yarn bends to R / rho = {bend:.2f}, allowed is {LARGEST_CURVATURE:g}"
                )
        quantities = quantities or {"interlock": reason}
        message = f"{what}: {' and '.join(quantities.values())}" + (f". {nearest}" if nearest else "")
        return InfeasibleLoop(message, quantities, share)

    def _points(self, x: Floats) -> Floats:
        return self.unit.control_points + self._motions @ x[:-1]

    def moved(self, x: Floats) -> Room:
        """Return the room of another loop. Raises GeometryError if it is not interlocked."""
        points = self._points(x)
        first = self.crossing[0]
        at = first, self._found(points).parameter[: len(first)]
        return Room(replace(self.unit, control_points=points), self.path, x[-1], self.settings, at)

    def evaluate(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the cost and all constraints (k,) with their gradients (k, n + 1).

        The last call is kept: values and slopes are asked for one after the other.
        """
        if self._kept[0] != x.tobytes():
            points = self._points(x)
            share = x[-1]
            parts = [self._lack, self._distances, self._curvature]
            if self.path.length is not None:
                parts.insert(1, self._length)
            values = zip(*(part(points, share) for part in parts), strict=True)
            value, slope, by_share = (np.concatenate(parts) for parts in values)
            along = np.tensordot(slope, self._motions, axes=([1, 2], [0, 1]))
            self._kept = x.tobytes(), (value, np.column_stack([along, by_share]))
        return self._kept[1]

    # Each of these returns values (k,), slopes along the control points (k, P, 3), and along the share (k,).

    def _lack(self, points: Floats, share: float) -> _Valued:
        """F without its term of the distances, which are constraints here, and the cost of a share below 1."""
        value, slope = self.cost.value(points, share=0.0)
        return (
            np.array([value / self._unit + LACK * (1 - share)]),
            slope[None] / self._unit,
            np.array([-LACK]),
        )

    def _length(self, points: Floats, share: float) -> _Valued:
        length, slope = self.cost.arc_length(points)
        length, slope = length[self._own_rows], slope[self._own_rows]
        start, growth = np.multiply(self.path.length or (0.0, 0.0), self.unit.columns)
        return length - start - share * growth, slope, np.full(len(length), -growth)

    def _distances(self, points: Floats, share: float) -> _Valued:
        """Distances of the crossings and of the pairs less the wanted one."""
        near = self._found(points)
        start, growth = np.multiply(self.cost.target, self.path.radius)
        slope = self.cost.distance_slope(points, near, self._rows)
        return near.distance - start - share * growth, slope, np.full(len(slope), -growth)

    def _found(self, points: Floats) -> Approach:
        """Closest points of the crossings and of the pairs. Raises GeometryError where yarns cut each other."""
        rows, unit = self._rows, self.unit
        lower, upper = (self.cost.curves(points, of) for of in rows.T)  # refuses points that are not finite
        over = (rows[:, 1:] // unit.rows * unit.rows) * unit.rise
        near = refine(lower, upper, self._places, self._windows, over)
        if not near.distance.min() > 0:
            raise GeometryError("yarns cut each other on the way to the minimum")
        return near

    def _curvature(self, points: Floats, share: float) -> _Valued:
        """1 - (R / rho / the largest allowed)^2 at samples of the pieces that are no images of others."""
        (first, first_offset), (second, second_offset) = self._tangent, self._bend
        d1, d2 = first @ points + first_offset, second @ points + second_offset
        normal = np.cross(d1, d2)
        speed, area = (d1**2).sum(axis=1)[:, None], (normal**2).sum(axis=1)[:, None]
        by_d1 = 2 * np.cross(d2, normal) / speed**3 - 6 * area / speed**4 * d1
        by_d2 = 2 * np.cross(normal, d1) / speed**3
        slope = first[:, :, None] * by_d1[:, None] + second[:, :, None] * by_d2[:, None]
        start, growth = np.divide(self.path.radius, LARGEST_CURVATURE)
        radius = start + share * growth
        square = (area / speed**3)[:, 0]
        return 1 - radius**2 * square, -(radius**2) * slope, -2 * radius * growth * square

    def minimise(self, reach: float) -> OptimizeResult:
        """Return scipy's result from the loop, of points that move by a reach [radii] at most."""

        def of(rows: Any, slope: int) -> Callable[[Floats], Any]:
            return lambda x: self.evaluate(x)[slope][rows]

        kinds = ((self._equal, "eq"), (self._above, "ineq"))
        constraints = [{"type": kind, "fun": of(rows, 0), "jac": of(rows, 1)} for rows, kind in kinds]
        bounds = [*[(-reach, reach)] * self._motions.shape[-1], (1.0 if self.at_end else 0.0, 1.0)]
        options = {"ftol": 1e-9, "maxiter": ITERATIONS}
        slsqp: dict[str, Any] = {
            "method": "SLSQP",
            "bounds": bounds,
            "constraints": constraints,
            "options": options,
        }
        return minimize(of(self._cost, 0), self._start, jac=of(self._cost, 1), **slsqp)

    def stationary(self, x: Floats) -> float:
        """Return the gradient less the forces of the active constraints."""
        value, slope = self.evaluate(x)
        met = np.abs(value) < EXACT
        met[self._cost] = False
        unknown = slice(-1) if self.at_end else slice(None)
        forces = slope[met, unknown].T
        cost = slope[self._cost, unknown]
        return float(np.abs(cost - forces @ np.linalg.lstsq(forces, cost, rcond=None)[0]).max())


def _of_sides(windows: Floats) -> Floats:
    """Return windows (4 n, 2, 2) of crossings that go on to the end of that of the other one on their side."""
    of_loops = windows.reshape(-1, 4, 2, 2)
    left, right = (
        np.stack([of_loops[:, a, :, 0], of_loops[:, b, :, 1]], axis=-1) for a, b in ((0, 2), (3, 1))
    )
    return np.stack([left, right, left, right], axis=1).reshape(-1, 2, 2)


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


def fitted_loop(
    wanted: LoopTarget, settings: Any, look_for_nearest: bool = True
) -> tuple[Loop, Loop, Optimum]:
    """Return a loop as drawn and as optimised within the limits, and the outcome of its optimisation.

    `settings` are as for `knitstudy.knit.geometry.optimise.optimise`; of these beta, gamma, beta_0 and samples count.
    Raises InfeasibleLoop when no loop fits; it names the limits and, where they are to be looked for, spacings or a
    diameter that fit, or a length.
    """
    free = replace(wanted, length=None)
    radius = wanted.radius
    room, optimum, reason = start = _of_spacings(free, settings)
    if optimum is None and not look_for_nearest:
        raise room.refusal("no loop fits", reason, "", room.share)
    if optimum is None:
        side = (1 + 0.5 * wanted.clearance) * 2 * radius
        bound = min(wanted.course / ABREAST[0], wanted.wale / ABREAST[1]) / side
        ways = (2 * radius * min(share, 1.0) for share in (max(room.share, bound), room.share))
        nearest = ""
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
        way = max(way * shorter, less)
        less = 0.0
    return None


def _millimetres(length: float) -> str:
    return f"{1e3 * length:.4g}"


def _of_spacings(wanted: LoopTarget, settings: Any) -> _End:
    """Return the end of the path to the loop of free length; InfeasibleLoop where the drawn one does not interlock."""
    # A problem of another scale is the same one to the last bit, and so is its solution.
    course, wale = (float(f"{spacing / wanted.radius:.12g}") for spacing in (wanted.course, wanted.wale))
    unit = LoopTarget(course, wale, 1.0, wanted.clearance, stitches=standard(wanted.stitches)[0])
    try:
        start = Room(unit.drawn(), FreePath(unit.rest_length, (0.0, 1.0)), None, settings)
    except GeometryError as error:
        remedy = "take a pattern.wale_spacing of 0.5 to 2 course spacings"
        raise InfeasibleLoop(
            f"no loop is drawn that interlocks: {_plain(error)}; {remedy}", ["interlock"], 0.0
        ) from error
    return _follow_path(start)


def _of_length(room: Room, length: float) -> _End:
    """Return the end of the path from a loop of free length to one of another length [radii]."""
    own = room.unit.length
    asked = float(f"{length:.12g}")
    path = FreePath(asked, (1.0, 0.0), (own, asked - own))
    return _follow_path(Room(room.unit, path, 0.0, room.settings, room.crossing))


def _plain(error: GeometryError) -> str:
    """Return the text of an error without the name of a key that a drawn loop has not."""
    return str(error).removeprefix("pattern.control_points: ")


def _with_free_share(room: Room) -> Room:
    """Return a room on from the share that pieces of its yarn leave free: closest points slide in flat valleys."""
    share = min(room.share, room.near["distance"].min() / room.unit.target) - RETREAT
    return Room(room.unit, room.path, share, room.settings, room.crossing)


@dataclass
class _Walk:
    """Where a search for a loop is."""

    room: Room
    best: Room  # the last one that has its room
    stride: float = STRIDE
    idle: int = 0  # minimisations in a row that hardly moved
    back: bool = False  # whether it has gone back to the best one

    @property
    def gain(self) -> float:
        """Share of the radius above that of the best room."""
        return self.room.share - (self.best.share if self.best.missing <= EXACT else -1.0)

    def advance(self, room: Room, moved: float) -> None:
        """Take another loop, whose control points have moved by so much, and longer strides."""
        self.room = room
        self.stride = min(STRIDE, 2 * self.stride)
        self.idle = self.idle + 1 if moved < IDLE * room.path.rest else 0

    def is_settled(self, moved: float, reach: float, at_minimum: bool) -> bool:
        """Whether the last minimisation hardly moved, or ended at a minimum within its stride."""
        return self.idle > 0 or (moved < 0.99 * reach and at_minimum)

    def goes_no_farther(self, stuck: bool, there: bool) -> bool:
        """Whether a loop before the wanted one has its room and is stuck, or hardly moves for too long.

        A loop that has just become the wanted one goes on to the minimum there; `there`: the one before was it already.
        """
        room = self.room
        exact = room.missing <= EXACT
        if exact and room.at_end and not there:
            return False
        patience = 1 if room.unit.stitches == PLAIN else MIXED_PATIENCE
        return self.idle > patience or (exact and stuck and not room.at_end)

    def retreat(self) -> bool:
        """Take a quarter of the stride; return whether there is a way on.

        Out of a loop whose yarns overlap no way leads: on from the last that has room, once, and more carefully.
        """
        self.stride = 0.25 * self.stride
        if self.stride >= SMALLEST_STRIDE:
            return True
        if self.room.missing <= EXACT or self.back:
            return False
        self.room = self.best
        self.stride = 0.25 * STRIDE
        self.back = True
        return True


def _follow_path(room: Room) -> _End:
    """Go on from a loop until it is the wanted one or has no room: the last loop, the outcome, or why there is none.

    A minimisation moves control points by a stride at most. One that loses the interlock is repeated with a quarter of
    the stride.
    """
    before = room.cost.terms(room.unit.control_points)
    walk = _Walk(room, best=room)
    iterations = 0
    reason = ""
    for _ in range(ROUNDS):
        room = walk.room
        reach = walk.stride * room.path.rest
        try:
            result = room.minimise(reach)
            following = room.moved(result.x)
        except GeometryError as error:
            reason = _plain(error)
            if not walk.retreat():
                break
            continue
        iterations += result.nit
        gradient = room.stationary(result.x)
        moved = np.abs(result.x[:-1]).max()
        there = room.at_end
        room = following
        walk.advance(room, moved)
        exact = room.missing <= EXACT
        settled = walk.is_settled(moved, reach, result.status == 0 or gradient < STATIONARY)
        if exact and there and settled:
            points = room.unit.control_points
            return room, Optimum(points, before, room.cost.terms(points), iterations, gradient), ""
        gain = walk.gain
        if exact and gain >= 0:
            walk.best = room
        if walk.goes_no_farther(stuck=settled or gain < GAIN, there=there):
            break
        if walk.idle and not exact:
            walk.room = _with_free_share(room)
    return walk.best, None, reason or f"no other loop is found in {iterations} iterations"
