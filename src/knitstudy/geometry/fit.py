"""A loop from course spacing, wale spacing and yarn: drawn, and optimised within limits.

A drawn loop is x = w t / (2 pi) + a sin 2t, y = -h/2 cos t, z = -b cos 2t, as long as Peirce's loop. Its control points
move to where the bending and length terms of Eq. (1) are smallest among the loops that have room: yarns stand exactly
2R + c0 apart at the crossings, all other pieces of yarn at least as far, and the yarn bends to R / rho of at most
`LARGEST_CURVATURE` (sequential quadratic programming). Where none is found, a thin yarn of the same spacings is
thickened step by step: it comes to the wanted diameter, or to the thickest one that fits. Lengths are in radii but for
those of `Loop`.

Peirce 1947, "Geometrical principles applicable to the design of functional fabrics", Textile Research Journal 17.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, brentq, minimize

from knitstudy.errors import GeometryError
from knitstudy.geometry.crossings import closest_points, refine, windows_of_loop
from knitstudy.geometry.loop import Loop, symmetric_motions, symmetries, whole_loop
from knitstudy.geometry.optimise import CostFunction, Optimum, check_interlock
from knitstudy.geometry.spline import CatmullRom
from knitstudy.geometry.survey import approaches, away_from_crossings, survey

POINTS = 16  # control points of a drawn loop
DRAWN_SAMPLES = 4000  # of a drawn curve, between which control points are spaced evenly
OVERLAP, HEIGHT = 2.0, 0.54  # of a drawn loop, in diameters: h over c, and b
BULGE = (0.08, 0.35)  # range of a over w
TIGHT = (3.364, 4.0)  # course and wale spacing over the diameter of Peirce's loop whose yarns touch
LARGEST_CURVATURE = 0.9  # R / rho that a loop may have; sections of a yarn cut each other at 1
CURVATURE_SAMPLES = 8  # a Bezier segment, both of its ends among them
NEAR = 3.0  # distance of centrelines in radii up to which pieces of yarn may be kept apart
SLIDE = 0.5  # Bezier segments by which the closest points of two pieces may move in one minimisation
STRIDE = 0.03  # share of the length by which a control point may move in one minimisation
EXACT = 1e-5  # radii by which distances, and the length, may miss what is asked
ROUNDS, ITERATIONS = 6, 60  # minimisations, each with the pairs that the one before brought too near
WATCHED = 0.3  # radii beyond the clearance up to which pairs are kept apart from the first minimisation on
ACTIVE = 0.03  # distance from a limit below which it is named as the reason why no thicker yarn fits
THIN = (0.75, 0.5, 0.3, 0.15)  # shares of the diameter at which a loop is looked for first
SMALLEST_STEP = 1 / 64  # of the share by which a yarn grows


def peirce_length(course: float, wale: float, diameter: float) -> float:
    """Return the length of yarn in Peirce's loop, whose arcs lie in the plane and touch: all in one unit."""
    return 2 * course + wale + 5.94 * diameter


def drawn_loop(course: float, wale: float, radius: float, clearance: float, length: float) -> Loop:
    """Return the loop of given spacings, yarn radius and length of yarn, as far as `BULGE` allows. [m]"""
    t = np.linspace(0, 2 * np.pi, DRAWN_SAMPLES + 1)
    height, depth = course + 2 * OVERLAP * radius, 2 * HEIGHT * radius

    def drawn(bulge: float) -> tuple[np.ndarray, np.ndarray]:
        x = wale * (t / (2 * np.pi) + bulge * np.sin(2 * t))
        points = np.column_stack([x, -0.5 * height * np.cos(t), -depth * np.cos(2 * t)])
        return points, np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))

    low, high = (drawn(bulge)[1][-1] - length for bulge in BULGE)
    inside = low < 0 < high
    bulge = brentq(lambda b: drawn(b)[1][-1] - length, *BULGE) if inside else BULGE[int(low < 0)]
    points, s = drawn(bulge)
    at = np.arange(POINTS // 4 + 1) / POINTS * s[-1]
    quarter = np.column_stack([np.interp(at, s, points[:, axis]) for axis in range(3)])
    quarter[-1, :2] = wale / 4, 0.0
    return Loop(whole_loop(quarter, wale), wale, course, radius, clearance)


@dataclass(frozen=True)
class Wanted:
    """What a loop is made from: spacings, radius and clearance as of `Loop`, and the length if it is given. [m]"""

    course: float
    wale: float
    radius: float
    clearance: float
    length: float | None = None

    @property
    def drawn_diameter(self) -> float:
        """Diameter that the loop is drawn for: at most that of Peirce's loop whose yarns touch. [m]"""
        return min(2 * self.radius, self.course / TIGHT[0], self.wale / TIGHT[1])

    @property
    def rest(self) -> float:
        """Length that the loop is drawn with. [m]"""
        return self.length or peirce_length(self.course, self.wale, self.drawn_diameter)

    def drawn(self) -> Loop:
        """Return the loop as it is drawn."""
        drawn = drawn_loop(self.course, self.wale, 0.5 * self.drawn_diameter, self.clearance, self.rest)
        return replace(drawn, radius=self.radius)


def fitted_loop(wanted: Wanted, settings: Any) -> tuple[Loop, Loop, Optimum]:
    """Return a loop as drawn and as optimised within the limits, and the outcome of its optimisation.

    `settings` are those of `knitstudy.geometry.optimise.optimise`; of these beta, gamma, beta_0 and samples count.
    Raises GeometryError when no loop fits, which names the limit and the nearest spacings or length that do.
    """
    drawn = wanted.drawn()
    try:
        return drawn, *_fit(drawn, wanted, settings)
    except GeometryError:
        free = replace(wanted, length=None)
        loop, optimum = _thickened(free, settings)
    if wanted.length is None:
        return drawn, loop, optimum
    return drawn, *_lengthened(loop, wanted, settings)


def _thickened(wanted: Wanted, settings: Any) -> tuple[Loop, Optimum]:
    """Return the loop that a thin yarn leads to; GeometryError if it ends before the wanted diameter."""
    drawn = wanted.drawn()

    def attempt(share: float, before: Loop) -> tuple[Loop, Optimum]:
        start = replace(before, radius=share * wanted.radius)
        return _fit(start, wanted, settings, warm=before is not drawn)

    error: GeometryError | None = None
    for share in THIN:
        try:
            first = attempt(share, drawn)
        except GeometryError as failed:
            error = failed
            continue
        found, share, error = _continued(attempt, first, share)
        if error is None:
            return found
        limits = _limits(found[0], error)
        course, wale = (f"{1e3 * spacing / share:.4g}" for spacing in (wanted.course, wanted.wale))
        thickest = f"{2e3 * share * wanted.radius:.4g}"
        raise NoRoom(
            f"no loop fits: {' and '.join(limits.values())}. The nearest spacings that fit are pattern.course_spacing "
            f"{course} and pattern.wale_spacing {wale} mm, the thickest yarn.diameter {thickest} mm",
            limits,
            share,
        )
    raise NoRoom(f"no loop fits, not even of {THIN[-1]:g} times the diameter: {error}", ["interlock"], 0.0)


def _lengthened(loop: Loop, wanted: Wanted, settings: Any) -> tuple[Loop, Optimum]:
    """Return the loop of the wanted length that one of free length leads to; GeometryError if it ends before."""
    own = loop.length

    def attempt(share: float, before: Loop) -> tuple[Loop, Optimum]:
        return _fit(before, replace(wanted, length=own + share * (wanted.length - own)), settings, warm=True)

    found, _, error = _continued(attempt, attempt(0.0, loop), 0.0)
    if error is None:
        return found
    limits = _limits(found[0], error)
    raise NoRoom(
        f"no loop fits of pattern.loop_length {1e3 * wanted.length:.4g} mm: {' and '.join(limits.values())}. "
        f"The nearest length that fits is {1e3 * found[0].length:.4g} mm; without one it is {1e3 * own:.4g}",
        limits,
        1.0,
    )


def _continued(
    attempt: Callable[[float, Loop], tuple[Loop, Optimum]], found: tuple[Loop, Optimum], share: float
) -> tuple[tuple[Loop, Optimum], float, GeometryError | None]:
    """Go from a share towards 1 in steps that are halved: the last loop, its share, and what ended it if not at 1."""
    step, error = 0.5 * (1 - share), None
    while share < 1 and step >= SMALLEST_STEP:
        try:
            found = attempt(min(share + step, 1.0), found[0])
            share, error = min(share + step, 1.0), None
        except GeometryError as failed:
            step, error = 0.5 * step, failed
    return found, share, error if share < 1 else None


def _crossings(unit: Loop) -> np.ndarray:
    """Return the parameters (4, 2) of the crossings of a loop in radii."""
    curve = unit.curve
    return closest_points(curve, curve.shifted(unit.rise), windows_of_loop(curve, unit.rise)).parameter


class NoRoom(GeometryError):
    """No loop fits: the limits that the thickest yarn which does has reached, and its share of the diameter."""

    def __init__(self, message: str, limits: Iterable[str], share: float):
        super().__init__(message)
        self.limits, self.share = tuple(limits), share


def _limits(loop: Loop, error: GeometryError) -> dict[str, str]:
    """Return the limits that the last loop which fits has reached, in words; else what the next one failed by."""
    unit = loop.in_radii()
    curvature = 1 / survey(unit).radius_of_curvature
    near = away_from_crossings(approaches(unit, NEAR), _crossings(unit))
    said = {}
    if curvature > LARGEST_CURVATURE - ACTIVE:
        said["curvature"] = f"the yarn bends to R / rho = {curvature:.2f}, allowed is {LARGEST_CURVATURE:g}"
    for row in sorted(set(near["row"][near["distance"] < unit.target + ACTIVE].astype(int))):
        whose = "of one row" if row == 0 else f"of rows {row} apart"
        said["row" if row == 0 else "rows"] = f"neighbouring yarns {whose} touch beside the crossings"
    return said or {"interlock": str(error)}


# ---- One minimisation within limits


class _Rows:
    """A curve, at every pair moved by a vector of its own (k, 3)."""

    def __init__(self, curve: CatmullRom, shift: np.ndarray):
        self.value = lambda v: curve.value(v) + shift
        self.d1, self.d2 = curve.d1, curve.d2


class _Room:
    """Cost and constraints of a loop's control points as functions of the symmetric motions q (n,) from a start."""

    def __init__(self, start: Loop, rest: float, settings: Any, length: float | None, pairs: np.ndarray):
        self.cost = cost = CostFunction(start, settings)
        cost.rest_length, cost.sigma = np.full((2, POINTS), rest / POINTS)
        self.start, self.length, curve = start.control_points, length, start.curve
        self.reach = STRIDE * rest
        self.motions = symmetric_motions(np.ones((POINTS, 3), dtype=bool), symmetries(curve))
        share = np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)
        u = (np.arange(POINTS // 4)[:, None] + share).ravel()
        self._tangent, self._bend = curve.operator(u, 1), curve.operator(u, 2)
        crossing = cost.approach(self.start)
        # All four crossings are images of the first one.
        first = np.append(1.0, crossing.parameter[0])[None]
        reach = np.minimum(SLIDE, 0.25 * (pairs[:, 2] - pairs[:, 1] + np.where(pairs[:, 0] > 0, np.inf, 0.0)))
        windows = pairs[:, 1:, None] + reach[:, None, None] * [-1, 1]
        self._pairs = np.concatenate([first, pairs])
        self._last = self._pairs[:, 1:].copy()
        self._kept: tuple[bytes, Any] = b"", None
        self._windows = np.concatenate([cost.windows[:1], windows])
        self._unit = np.abs(cost.value(self.start, share=0.0)[1]).max() or 1.0

    def points(self, q: np.ndarray) -> np.ndarray:
        """Return the control points (P, 3)."""
        return self.start + self.motions @ q

    def _along(self, slope: np.ndarray) -> np.ndarray:
        return np.einsum("kai,...ka->...i", self.motions, slope)

    def value(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return F without its term of the distances, which are constraints here, and its gradient."""
        value, slope = self.cost.value(self.points(q), share=0.0)
        return value / self._unit, self._along(slope) / self._unit

    def distances(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances of the crossing and of the pairs less the wanted one: (k,), gradients (k, n)."""
        if self._kept[0] != q.tobytes():
            self._kept = q.tobytes(), self._distances(self.points(q))
        return self._kept[1]

    def _distances(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        curve = CatmullRom(points, self.cost.advance)  # refuses points that are not finite
        near = refine(curve, _Rows(curve, self._pairs[:, :1] * self.cost.rise), self._last, self._windows)
        self._last = near.parameter  # the next ones are not far
        if not near.distance.min() > 0:
            raise GeometryError("yarns cut each other on the way to the minimum")
        return near.distance - self.cost.target, self._along(self.cost.distance_slope(points, near))

    def equal(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what must vanish: the error of the distance at the crossing, and of the length if it is given."""
        error, slope = (each[:1] for each in self.distances(q))
        if self.length is None:
            return error, slope
        length, along = self.cost.arc_length(self.points(q))
        return np.append(error, length - self.length), np.vstack([slope, self._along(along)])

    def curvature(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return 1 - (R / rho / the largest allowed)^2 at samples of a quarter of the loop: (k,), gradients (k, n)."""
        points = self.points(q)
        (first, first_offset), (second, second_offset) = self._tangent, self._bend
        d1, d2 = first @ points + first_offset, second @ points + second_offset
        normal = np.cross(d1, d2)
        speed, area = (d1**2).sum(axis=1)[:, None], (normal**2).sum(axis=1)[:, None]
        by_d1 = 2 * np.cross(d2, normal) / speed**3 - 6 * area / speed**4 * d1
        by_d2 = 2 * np.cross(normal, d1) / speed**3
        slope = first[:, :, None] * by_d1[:, None] + second[:, :, None] * by_d2[:, None]
        share = (area / speed**3)[:, 0] / LARGEST_CURVATURE**2
        return 1 - share, -self._along(slope) / LARGEST_CURVATURE**2

    def above_zero(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what must not be negative: room for curvature, and gaps of the pairs beyond the clearance."""
        (bends, bends_slope), (gaps, gaps_slope) = self.curvature(q), self.distances(q)
        return np.append(bends, gaps[1:]), np.vstack([bends_slope, gaps_slope[1:]])

    def minimise(self) -> OptimizeResult:
        """Return scipy's result from the start."""
        kept = {"eq": _kept(self.equal), "ineq": _kept(self.above_zero)}
        constraints = [
            {"type": kind, "fun": lambda q, of=of: of(q)[0], "jac": lambda q, of=of: of(q)[1]}
            for kind, of in kept.items()
        ]
        options = {"ftol": 1e-9, "maxiter": ITERATIONS}
        q = np.zeros(self.motions.shape[-1])
        bounds = [(-self.reach, self.reach)] * len(q)
        return minimize(
            self.value, q, jac=True, method="SLSQP", bounds=bounds, constraints=constraints, options=options
        )


def _kept(function: Callable[[np.ndarray], Any]) -> Callable[[np.ndarray], Any]:
    """Return a function that keeps its last result: values and slopes are asked for one after the other."""
    last: list = [None, None]

    def kept(q: np.ndarray) -> Any:
        if last[0] is None or not np.array_equal(q, last[0]):
            last[:] = q.copy(), function(q)
        return last[1]

    return kept


def _fit(start: Loop, wanted: Wanted, settings: Any, warm: bool = False) -> tuple[Loop, Optimum]:
    """Return the optimised loop from a start with its radius, and the outcome; see `fitted_loop`.

    A `warm` start has room, but for a yarn that was a little thinner or a loop that was a little shorter or longer.
    """
    radius = start.radius
    rest = wanted.rest / radius
    length = None if wanted.length is None else wanted.length / radius
    unit, pairs, iterations = start.in_radii(), np.empty((0, 3)), 0
    if warm:
        pairs = _too_near(unit, _crossings(unit), WATCHED)
    before, unfinished = None, 0
    for _ in range(ROUNDS):
        room = _Room(unit, rest, settings, length, pairs)
        before = before or room.cost.terms(unit.control_points)
        result = room.minimise()
        iterations += result.nit
        _require_room(room, result.x)
        unit = replace(unit, control_points=room.points(result.x))
        crossing = room.cost.approach(unit.control_points)
        check_interlock(room.cost, unit.control_points)
        if not crossing.interior.all():
            raise GeometryError("the two crossings of an interlock become one")
        error = np.abs(crossing.distance - room.cost.target).max()
        new = _too_near(unit, crossing.parameter, -10 * EXACT)
        if len(new) == 0 and error <= EXACT and result.status == 0 and np.abs(result.x).max() < room.reach:
            points = unit.control_points
            gradient = _stationary(room, result.x)
            optimum = Optimum(points, before, room.cost.terms(points), iterations, gradient)
            return replace(start, control_points=points * radius), optimum
        unfinished += int(result.status != 0)
        if unfinished > 1:
            break
        pairs = np.concatenate([pairs, new])
    raise GeometryError(f"no minimum in {iterations} iterations")


def _require_room(room: _Room, q: np.ndarray) -> None:
    """Raise GeometryError where constraints are not met, and name the one that is missed most."""
    equal, bends, gaps = room.equal(q)[0], room.curvature(q)[0], room.distances(q)[0][1:]
    missed = {
        "crossings miss their distance by {:.2g} radii": abs(equal[0]),
        "the yarn in a loop misses its length by {:.2g} radii": np.abs(equal[1:]).max(initial=0.0),
        f"the yarn bends too tightly (R / rho is at most {LARGEST_CURVATURE:g}), by {{:.2g}}": -bends.min(),
        "neighbouring yarns are {:.2g} radii too near beside the crossings": -gaps.min(initial=0.0),
    }
    worst = max(missed, key=lambda name: missed[name])
    if not missed[worst] <= EXACT:
        raise GeometryError(worst.format(missed[worst]))


def _too_near(unit: Loop, crossings: np.ndarray, margin: float) -> np.ndarray:
    """Pairs (k, 3) of a row and two parameters, away from the crossings, that are nearer than the wanted distance.

    A margin [radii] adds to that distance. Of images by symmetry one is enough.
    """
    near = away_from_crossings(approaches(unit, NEAR), crossings)
    near = near[near["distance"] < unit.target + margin]
    return near[~near["distance"].round(5).duplicated()][["row", "u", "v"]].to_numpy()


def _stationary(room: _Room, q: np.ndarray) -> float:
    """Return what remains of the gradient beside the forces of the constraints that are met with equality."""
    slope, (value, active) = room.value(q)[1], room.above_zero(q)
    forces = np.vstack([room.equal(q)[1], active[value < EXACT]]).T
    rest = slope - forces @ np.linalg.lstsq(forces, slope, rcond=None)[0]
    return float(np.abs(rest).max())
