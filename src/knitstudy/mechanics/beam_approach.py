"""Smooth centrelines through the nodes of beams: C2 curves of the undeformed arc length.

Between two stations the curve goes over from the parabola through the first one and its neighbours to that of the
second one, by a share that has no slope at either end (parabolic blending, Catmull and Rom 1974, with a smooth share).
It is linear in the stations. A contact point that slides over one feels no kink: how fast it slides depends on the
second derivative, and where that jumps Newton's method may find no tangent to follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.mechanics.batches import Chosen

_POWERS = np.arange(6)
# Shares of the first and of the second parabola by powers of t in [0, 1]
_SHARES = np.array([[1.0, 0, -3, 2], [0, 0, 3, -2]])


@dataclass(frozen=True, eq=False)
class Stencil(Chosen):
    """Points (...) of curves as weighted sums of stations."""

    stations: np.ndarray  # int (..., 4)
    value: np.ndarray  # (..., 4), weights of the position
    first: np.ndarray  # (..., 4), of its derivative with respect to arc length [1/m]
    second: np.ndarray  # (..., 4), of the second one [1/m2]

    def of(self, weights: np.ndarray, field: np.ndarray) -> np.ndarray:
        """Return the sums (..., 3) or (..., 3, 3) of a field (S, ...) of the stations with one of the weights."""
        form = "...p,...pij->...ij" if field.ndim == 3 else "...p,...pi->...i"
        return np.einsum(form, weights, field[self.stations])


class Curves:
    """The centrelines of all yarns; raises GeometryError if a yarn has fewer than three stations."""

    def __init__(
        self,
        # int (S,), yarn of every station; the stations of a yarn follow each other, yarn 0 first
        yarn: np.ndarray,
        arc_length: np.ndarray,  # (S,), where they are on the undeformed yarn, rising [m]
    ) -> None:
        yarn, arc_length = np.asarray(yarn), np.asarray(arc_length, dtype=float)
        count = np.bincount(yarn)
        if count.min() < 3:
            raise GeometryError(
                f"yarn {int(np.argmin(count))} has {count.min()} beam nodes: a smooth centreline needs at least 3; "
                "use shorter beam elements"
            )
        self.arc_length = arc_length
        self.first = np.concatenate([[0], np.cumsum(count)])
        self.length = arc_length[self.first[1:] - 1]
        # One rising coordinate for all yarns, so that one search serves them.
        self._origin = np.concatenate([[0.0], np.cumsum(2 * self.length)])[:-1]
        self._knots = self._origin[yarn] + arc_length
        self._weights = self._blended_weights()

    def _blended_weights(self) -> np.ndarray:
        """Coefficients (S, 6, 4) of powers of t in the segment after a station, for its stencil."""
        s, first = self.arc_length, self.first
        station = np.arange(len(s))
        yarn = np.repeat(np.arange(len(first) - 1), np.diff(first))
        centre = np.clip(station, first[yarn] + 1, first[yarn + 1] - 2)
        weights = np.zeros((len(s), 6, 4))
        segment = np.setdiff1d(station, first[1:] - 1)
        length = (s[segment + 1] - s[segment])[:, None]
        for share, end in zip(_SHARES, (segment, segment + 1), strict=True):
            knots = centre[end][:, None] + [-1, 0, 1]
            t = (s[knots] - s[segment][:, None]) / length
            parabola = np.linalg.inv(t[..., None] ** _POWERS[:3])  # (k, power, knot)
            column = knots - segment[:, None] + 1
            for power, part in enumerate(share):
                rows = power + _POWERS[:3]
                weights[segment[:, None, None], rows[:, None], column[:, None]] += part * parabola
        return weights

    def stencil(self, yarn: np.ndarray, s: np.ndarray) -> Stencil:
        """Return the stencils of the points at arc lengths s (...) [m] of yarns (...)."""
        low, high = self.first[yarn], self.first[yarn + 1] - 2
        segment = np.clip(np.searchsorted(self._knots, self._origin[yarn] + s, side="right") - 1, low, high)
        length = (self.arc_length[segment + 1] - self.arc_length[segment])[..., None]
        t = (s - self.arc_length[segment])[..., None] / length
        bases = (
            t**_POWERS,
            _POWERS * t ** np.maximum(_POWERS - 1, 0) / length,
            _POWERS * (_POWERS - 1) * t ** np.maximum(_POWERS - 2, 0) / length**2,
        )
        stations = np.clip(segment[..., None] + np.arange(-1, 3), low[..., None], high[..., None] + 1)
        weights = self._weights[segment]
        return Stencil(stations, *(np.einsum("...h,...hp->...p", basis, weights) for basis in bases))


# Closest approach of two centrelines, and how it changes with the motion of their beams. Sides A and B of a pair are
# points X_A(s_A) and X_B(s_B); r = X_B - X_A is normal to both tangents.
#
# Yarns that wrap around each other to the curvature 1 / 2 R have closest points everywhere along an arc: the second
# derivative H of |r|^2 / 2 becomes singular, and next to no motion takes the points from one end of the arc to the
# other. Where the smallest eigenvalue of H in the last converged increment was below `SOFTEST` (it is 1 for straight
# yarns that cross at a right angle), a spring towards where the points were then makes up for what is missing: they
# minimise |r|^2 / 2 + hold / 2 |s - s_0|^2. They lag behind by hold / (H + hold) of their way within one increment, and
# the gap is too large by the square of that lag times H / 4 R. H is 1 less 2 R times the yarn's curvature, so that a
# curvature may grow by 0.4 / 2 R in an increment before H is singular.

SOFTEST = 0.4

STEPS = 40
HALVINGS = 12
A, B = 0, 1


@dataclass(frozen=True, eq=False)
class Pairs(Chosen):
    """Pieces of yarn that may touch."""

    yarn: np.ndarray  # int (k, 2), of sides A and B
    bounds: np.ndarray  # (k, 2, 2), first and last arc length of the piece on either side [m]
    start: np.ndarray  # (k, 2), arc lengths from which the closest points are looked for [m]


@dataclass(frozen=True, eq=False)
class Approach(Chosen):
    """Closest points of k pairs, on side A and side B, within their pieces."""

    s: np.ndarray  # (k, 2), their arc lengths [m]
    free: np.ndarray  # bool (k, 2), false where a point stands at the bound of its piece
    stencil: Stencil  # (k, 2)
    tangent: np.ndarray  # (k, 2, 3), derivative of the position with respect to arc length
    bend: np.ndarray  # (k, 2, 3), the second one [1/m]
    distance: np.ndarray  # (k,), |r| [m]
    normal: np.ndarray  # (k, 3) r / |r|, from A to B
    hold: np.ndarray  # (k,), stiffness of the spring towards where the points are looked for


def approach(
    curves: Curves,
    position: np.ndarray,  # (S, 3), current positions of the stations [m]
    pairs: Pairs,
    hold: np.ndarray
    | None = None,  # (k,), stiffness of the springs towards their start; by default there are none
) -> Approach:
    """Return the closest points of pairs by Newton's method."""
    hold = np.zeros(len(pairs.start)) if hold is None else hold
    low, high = pairs.bounds[..., 0], pairs.bounds[..., 1]
    s = np.clip(pairs.start, low, high)
    moves = np.ones(len(s), dtype=bool)
    for _ in range(STEPS):
        if not moves.any():
            break
        some = np.flatnonzero(moves)
        yarn, spring, lag = pairs.yarn[some], hold[some], s[some] - pairs.start[some]
        here = at_places(curves, position, yarn, s[some], spring)
        step = _newton_step(here, lag, low[some], high[some])
        level = _level(here, lag) * (1 + 1e-14)  # beyond rounding
        for _ in range(HALVINGS):
            trial = at_places(curves, position, yarn, s[some] + step, spring)
            worse = _level(trial, lag + step) > level
            if not worse.any():
                break
            step[worse] *= 0.5
        s[some] += step
        moves[some] = np.abs(step).max(axis=1) > 1e-13 * curves.length.max()
    done = at_places(curves, position, pairs.yarn, s, hold)
    return replace(done, free=(s > low) & (s < high))


def at_places(
    curves: Curves, position: np.ndarray, yarn: np.ndarray, s: np.ndarray, hold: np.ndarray | float = 0.0
) -> Approach:
    """Return the approach at arc lengths s (k, 2) of yarns (k, 2), closest or not."""
    stencil = curves.stencil(yarn, s)
    weights = stencil.value, stencil.first, stencil.second
    point, tangent, bend = (stencil.of(each, position) for each in weights)
    apart = point[:, B] - point[:, A]
    distance = np.linalg.norm(apart, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = apart / distance[:, None]
    return Approach(
        s,
        np.ones(s.shape, dtype=bool),
        stencil,
        tangent,
        bend,
        distance,
        normal,
        np.broadcast_to(hold, distance.shape),
    )


def bends(here: Approach, radius: float) -> np.ndarray:
    """Return curvatures (k, 3) towards the other yarn, times a radius, of A and B, and the cosine of their angle."""
    speed = np.linalg.norm(here.tangent, axis=2, keepdims=True)
    tangent = here.tangent / speed
    across = here.bend - tangent * np.einsum("kai,kai->ka", tangent, here.bend)[..., None]
    towards = radius * np.einsum("kai,ki->ka", across / speed**2, here.normal) * [1.0, -1.0]
    return np.column_stack([towards, np.einsum("ki,ki->k", tangent[:, A], tangent[:, B])])


def needed_hold(here: Approach) -> np.ndarray:
    """Return the stiffness (k,) of springs that make up for what bends take from the smallest eigenvalue of H.

    It is brought to `SOFTEST`, or to that of straight yarns where this is less.
    """
    here = replace(here, hold=np.zeros(len(here.s)))
    smallest, straight = (np.linalg.eigvalsh(_hessian(here, bends))[:, 0] for bends in (True, False))
    return np.maximum(0.0, np.minimum(SOFTEST, straight) - smallest)


def _level(here: Approach, lag: np.ndarray) -> np.ndarray:
    """Return what closest points minimise (k,) [m2], `lag` (k, 2) away from where they are held."""
    return 0.5 * (here.distance**2 + here.hold * (lag**2).sum(axis=1))


def _hessian(here: Approach, bends: bool = True) -> np.ndarray:
    """Second derivative (k, 2, 2) of `_level`; without the curves' bends it is never indefinite."""
    r = here.distance[:, None] * here.normal
    hessian = np.einsum("kai,kbi->kab", here.tangent, here.tangent)
    hessian[:, A, B] *= -1
    hessian[:, B, A] *= -1
    hessian += here.hold[:, None, None] * np.eye(2)
    if bends:
        hessian[:, A, A] -= np.einsum("ki,ki->k", r, here.bend[:, A])
        hessian[:, B, B] += np.einsum("ki,ki->k", r, here.bend[:, B])
    return hessian


def _newton_step(here: Approach, lag: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Step (k, 2) towards the closest points within bounds (k, 2); sides that push against a bound stay there."""
    r = here.distance[:, None] * here.normal
    slope = np.einsum("ki,kai->ka", r, here.tangent) * [-1.0, 1.0] + here.hold[:, None] * lag
    free = ~((here.s <= low) & (slope > 0)) & ~((here.s >= high) & (slope < 0))
    hessian = _hessian(here)
    convex = np.all((hessian[:, [A, B], [A, B]] > 0) | ~free, axis=1)
    convex &= (np.linalg.det(hessian) > 1e-6) | ~free.all(axis=1)
    safe = _hessian(here, bends=False) + 1e-3 * np.eye(2)
    hessian = np.where(convex[:, None, None], hessian, safe)
    reduced = _among(hessian, free)
    slope = np.where(free, slope, 0.0)
    step = np.clip(here.s - np.linalg.solve(reduced, slope[..., None])[..., 0], low, high) - here.s
    # What is left of a step within the bounds may lead nowhere: then every side goes its own way.
    alone = np.clip(here.s - slope / safe[:, [A, B], [A, B]], low, high) - here.s
    return np.where((np.einsum("ka,ka->k", slope, step) < 0)[:, None], step, alone)


def _among(hessian: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Second derivatives (k, 2, 2) of which those of sides that are not free (k, 2) are left out."""
    return np.where(free[:, :, None] & free[:, None, :], hessian, np.eye(2))


@dataclass(frozen=True, eq=False)
class Change:
    """Derivatives of an approach with respect to z = (e_A, a_A, e_B, a_B, d), 15 columns.

    e = DX and a = DX,_s are the motion of a curve at fixed arc length; d is left to the friction.
    """

    s: np.ndarray  # (k, 2, 15)
    apart: np.ndarray  # (k, 3, 15), of r
    gap: np.ndarray  # (k, 15)
    normal: np.ndarray  # (k, 3, 15)

    @classmethod
    def of(cls, here: Approach) -> Change:
        """Return the derivatives at closest points."""
        k = len(here.s)
        r = here.distance[:, None] * here.normal
        slope = np.zeros((k, 2, 15))  # of -r . X_A,s and r . X_B,s at fixed arc lengths
        for side, sign in ((A, -1.0), (B, 1.0)):
            slope[:, side, 0:3] = -sign * here.tangent[:, side]
            slope[:, side, 6:9] = sign * here.tangent[:, side]
            slope[:, side, 3 + 6 * side : 6 + 6 * side] += sign * r
        slope[~here.free] = 0.0
        s = -np.linalg.solve(_among(_hessian(here), here.free), slope)
        apart = here.tangent[:, B, :, None] * s[:, B, None] - here.tangent[:, A, :, None] * s[:, A, None]
        apart[:, :, 0:3] -= np.eye(3)
        apart[:, :, 6:9] += np.eye(3)
        gap = np.einsum("ki,kiz->kz", here.normal, apart)
        normal = (apart - here.normal[:, :, None] * gap[:, None]) / here.distance[:, None, None]
        return cls(s, apart, gap, normal)
