"""Friction of pairs of points of yarns that press each other by `line_contact`.

Friction acts at the middle between two points. Its traction t follows the slip u of the points of both sections that
met there, dt = k S du, up to mu times the part of their force along the normal at the closest points of both yarns. S
is the share of the patch (Mindlin 1949, `laws.Patch.shear`). Beyond Coulomb's limit they slide along t, whatever S is:

    t = t_0 + k S (u - u_slid),   u_slid = c t / k,   so   (1 + c S) t = t_0 + k S u   with   |t| = mu f.

A patch grows: its stiffness K = F' is that of all pieces that have closed. Pieces that close while the approach grows
from y to y + dy add F''(y) dy, and keep it as long as they touch (Jaeger 1998; the method of dimensionality reduction,
Popov and Hess 2015):

    k = c F''(y) / (2 pi r),   y = r - d,

d the distance of the yarns there. A piece closes with no traction and opens with a loss of what it stores. So shear
stays where yarns are pressed further, and falls with the patch where they are released, as Mindlin and Deresiewicz
(1953) and Walton (1987) say; elastic slip stores psi = t . S^-1 t / 2k with a constant k; and the loss,

    (t_0 + t) . u_slid / 2,

is never negative, in whatever order yarns are pressed and sheared. Normals, S and t turn with both sections; where k at
the end of an increment is smaller, t falls so that psi does not rise. Friction acts in the very increment in which
pairs meet: the history of a pair that did not touch before follows from where its points were.

Forces balance at both ends of an increment, and their work is that of the mean of both ends. So the t_0 of the loss is
the traction in the balanced state in which the increment begins, before it falls to the limit of the new normal and
patch; and a pair that parts slides from there to t = 0 within the increment. Without either, the loss is short by a
share of the order of the increment: 10 % where points slide by a sixth of their way through contact at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knitstudy.mechanics.beams.beam import BeamState, CommittedPoints, LineHistory
from knitstudy.mechanics.beams.laws import Repulsion
from knitstudy.mechanics.beams.pair_search import PointPairs
from knitstudy.mechanics.core.batches import Chosen, by_parts
from knitstudy.mechanics.core.rotation import hat

# Yarns along each other have no closest points: smallest second derivative of r^2 / 2 along them
LEAST_BEND = 0.02

SECULAR, ROUNDING = 20, 1e-13  # most iterations to Coulomb's limit, of a handful, and their tolerance
LEAST_LIMIT = 1e-12  # of the traction beyond it: pairs that are about to part have a limit of nothing
# Pairs that are evaluated at a time: threads share more than a few; second derivatives of the most take 120 MB
FEW, MOST = 2000, 8000


def at_a_time(pairs: int) -> int:
    """Return how many of so many pairs are evaluated at a time.

    Examples
    --------
    >>> at_a_time(1000), at_a_time(6000), at_a_time(60_000)
    (2000, 3000, 8000)
    """
    return min(max(FEW, -(-pairs // 2)), MOST)


def stored_energy(traction: np.ndarray, spring: np.ndarray, shear: np.ndarray) -> np.ndarray:
    """Return t . S^-1 t / 2k (m,) of tractions (m, 3); zero where nothing resists.

    Examples
    --------
    >>> stored_energy(np.array([[2.0, 0.0, 0.0]]), np.array([10.0]), np.eye(3)[None]).tolist()
    [0.2]
    """
    slip = np.linalg.solve(shear, traction[..., None])[..., 0]
    twice = np.einsum("ka,ka->k", traction, slip)
    return 0.5 * np.divide(twice, spring, out=np.zeros_like(spring), where=spring > 0)


def closest_points(z: np.ndarray, radius: np.ndarray | float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the normal (k, 3) at the closest points of both yarns, their distance (k,), and unit tangents (k, 2, 3).

    Yarns are the parabolas of z (k, 5, 3); see `LineContact.pair_geometry`.

    Examples
    --------
    >>> crossed = np.array([[[0.3, 0.2, 1.0], [0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    >>> closest_points(crossed, radius=1.0)[1].round(12)  # straight yarns along x and y, 1 apart
    array([1.])
    """
    way = z[:, 0]
    bend = z[:, 1:3]
    tangent = z[:, 3:]
    tangent = tangent / np.linalg.norm(tangent, axis=2, keepdims=True)
    slope = np.einsum("kai,ki->ka", tangent, way) * [-1.0, 1.0]
    first, second = (1 + np.einsum("kai,ki->ka", bend, way) * [-1.0, 1.0]).T
    cross = -np.einsum("ki,ki->k", tangent[:, 0], tangent[:, 1])
    # Inverse of the symmetric matrix [[first, cross], [cross, second]] with eigenvalues that are not too small
    mean = 0.5 * (first + second)
    half = 0.5 * (first - second)
    root = np.sqrt(half**2 + cross**2)
    low, high = (1 / np.maximum(value, LEAST_BEND) for value in (mean - root, mean + root))
    middle = 0.5 * (low + high)
    turn = 0.5 * (high - low) / np.where(root > 0, root, 1.0)
    step = -middle[:, None] * slope
    step -= turn[:, None] * np.stack(
        [half * slope[:, 0] + cross * slope[:, 1], cross * slope[:, 0] - half * slope[:, 1]], axis=1
    )
    step *= np.minimum(1.0, _ratio(np.full(len(way), radius), np.linalg.norm(step, axis=1)))[:, None]
    on_yarn = tangent * step[..., None] + 0.5 * bend * step[..., None] ** 2
    way = way - on_yarn[:, 0] + on_yarn[:, 1]
    distance = np.linalg.norm(way, axis=1)
    return way / distance[:, None], distance, tangent


def within_limit(trial: np.ndarray, stiff: np.ndarray, most: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the tractions t (m, 3) of pairs that slide, and c (m,): (1 + c S) t = trial and |t| = most.

    `trial` (m, 3) are tractions beyond the limits `most` (m,), `stiff` (m, 3, 3) is S, symmetric and positive.

    Examples
    --------
    >>> t, c = within_limit(np.array([[6.0, 8.0, 0.0]]), np.eye(3)[None], np.array([5.0]))
    >>> t.round(12).tolist(), c.round(12).tolist()
    ([[3.0, 4.0, 0.0]], [1.0])
    """
    value, axes = np.linalg.eigh(stiff)
    along = np.einsum("kij,ki->kj", axes, trial)
    c = np.zeros(len(trial))
    for _ in range(SECULAR):
        t = along / (1 + c[:, None] * value)
        size = np.linalg.norm(t, axis=1)
        if np.all(np.abs(size - most) <= ROUNDING * most):
            break
        c += (size / most - 1) * size**2 / np.sum(value * t**2 / (1 + c[:, None] * value), axis=1)
    return np.einsum("kij,kj->ki", axes, t), c


def _ratio(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return quotients (k,) where the second is positive, elsewhere 1."""
    return np.divide(one, other, out=np.ones_like(one), where=other > 0)


@dataclass(frozen=True, eq=False)
class PairFriction(Chosen):
    """Friction of pairs that were near each other before, in one configuration."""

    pair: np.ndarray  # int (m,), which of the pairs within reach
    key: np.ndarray  # int (m,)
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met [m]
    past_traction: np.ndarray  # (m, 2, 3), friction of the history, turned with both sections [N]
    normals: np.ndarray  # (m, 2, 3), of the history, turned with both sections
    shear: np.ndarray  # (m, 2, 3, 3), S of the history, turned with both sections
    slip: np.ndarray  # (m, 3), of i against j within the increment [m]
    spring: np.ndarray  # (m,), k times the part of the increment in which the pair touches [N/m]
    rate: np.ndarray  # (m,), its derivative by the distance [N/m2]
    force: np.ndarray  # (m,), part of the force [N]
    change: np.ndarray  # (m,), its derivative by the distance [N/m]
    slides: np.ndarray  # bool (m,)
    traction: np.ndarray  # (m, 3), on j [N]
    beyond: np.ndarray  # (m,), c of pairs that slide, else 0
    slid: np.ndarray  # (m,), length beyond Coulomb's limit within the increment [m]
    stored: np.ndarray  # (m,), energy of elastic slip [J]
    dissipated: np.ndarray  # (m,), energy lost in the increment [J]
    left_behind: float  # energy lost by pairs that do not touch any more [J]

    @classmethod
    def of(
        cls,
        law: Repulsion,
        mu: float,
        state: BeamState,
        pairs: PointPairs,
        history: LineHistory,
        parted: PointPairs,  # of the history, that are still near each other but do not touch
    ) -> PairFriction:
        """Return the friction of pairs that repel each other."""
        friction, known = cls._of_pairs(law, mu, state, pairs, history)
        ended, before = cls._of_pairs(law, mu, state, parted, history)
        stored = history.stored.sum() - history.stored[known].sum() - history.stored[before].sum()
        return replace(friction, left_behind=float(stored + ended.dissipated.sum()))

    @classmethod
    def _of_pairs(
        cls, law: Repulsion, mu: float, state: BeamState, pairs: PointPairs, history: LineHistory
    ) -> tuple[PairFriction, np.ndarray]:
        """Return the friction of those pairs that have a history, and their places (m,) in the history."""
        known = np.searchsorted(history.key, pairs.key)
        same = np.append(history.key, -1)[known] == pairs.key
        pair = np.flatnonzero(same)
        known = known[same]

        def of_some(part: slice) -> PairFriction:
            return cls._of_known(law, mu, state, pairs[pair[part]], pair[part], history[known[part]])

        return by_parts(of_some, len(pair), at_a_time(len(pair))), known

    @classmethod
    def _of_known(
        cls,
        law: Repulsion,
        mu: float,
        state: BeamState,
        pairs: PointPairs,  # m of all
        pair: np.ndarray,  # int (m,), their places among all
        history: LineHistory,  # of these
    ) -> PairFriction:
        law = law.between(pairs)
        rotation = state.rotation[pairs.both]
        r = pairs.distance
        arm = np.einsum("kaij,kaj->kai", rotation, history.arm)
        past_traction = np.einsum("kaij,kaj->kai", rotation, history.traction)
        normals = np.einsum("kaij,kaj->kai", rotation, history.normal)
        shear = rotation @ history.shear @ rotation.swapaxes(2, 3)
        plane = shear.mean(axis=1)
        stiff = _stiff(shear, normals)
        slip = arm[:, 0] - arm[:, 1] - pairs.way
        parts = history.share * history.density, history.share * history.thinning
        force, change = law.push(*parts, history.shape, r)
        # Friction acts from the moment within the increment at which a pair closes.
        past = law.diameter - history.distance
        begun = history.spring
        closes = past < 0
        span = np.where(closes, law.diameter - r - past, 1.0)
        spring = begun * np.where(closes, 1 + past / span, 1.0)
        rate = begun * np.where(closes, past / span**2, 0.0)
        before = past_traction.mean(axis=1)
        trial = before + spring[:, None] * np.einsum("kij,kj->ki", plane, slip)
        size = np.linalg.norm(trial, axis=1)
        most = mu * force
        slides = size > most
        most = np.maximum(most, LEAST_LIMIT * size)
        traction = trial.copy()
        beyond = np.zeros(len(trial))
        traction[slides], beyond[slides] = within_limit(trial[slides], stiff[slides], most[slides])
        stored = history.stored
        after = stored_energy(traction, begun, stiff)
        # Half of t_0 + t along t; where t_0 pointed the other way, of both of Coulomb's limits, as far as t came
        begun_with = np.einsum("kaij,kaj->kai", rotation, history.end_traction).mean(axis=1)
        along = _ratio(np.einsum("ki,ki->k", begun_with, traction), np.linalg.norm(traction, axis=1))
        along = np.where(along > 0, along, np.minimum(mu * history.force, size))
        way = np.divide(beyond * most, spring, out=np.zeros_like(most), where=spring > 0)
        slid = 0.5 * (along + most) * way
        elastic = stored_energy(traction, spring, stiff) - stored_energy(before, spring, stiff)
        return cls(
            pair, pairs.key, arm, past_traction, normals, shear, slip, spring, rate, force, change, slides,
            traction, beyond, way, after, elastic + stored - after + slid, 0.0,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ActivePairs:
    """Pairs of points that touch, and their friction."""

    pairs: PointPairs
    friction: PairFriction


def unslipped_history(
    law: Repulsion,
    points: CommittedPoints,
    pairs: PointPairs,
    z: np.ndarray,  # (k, 5, 3), as of `LineContact.pair_geometry`
    angles: np.ndarray,  # (k, 3), k_a R, k_b R and the cosine of the angle
    density: np.ndarray,  # (k,), c times the lengths of both pieces [m2]
    thinning: np.ndarray,  # (k,), its derivative by the distance [m]
    shape: np.ndarray,  # (k,), factor of F by the shape
) -> LineHistory:
    """Return the history of pairs that have not slipped, of points in one configuration."""
    law = law.between(pairs)
    r = pairs.distance
    normal, closest, tangent = closest_points(z, 0.5 * law.diameter)
    # Where yarns overlap by more than their bends the parabolas may pass each other: only the plane counts.
    share = np.abs(np.einsum("ki,ki->k", normal, pairs.way)) / r
    shear = law.shear(tangent, angles, normal)
    turned = points.rotation[pairs.both]
    half = 0.5 * np.stack([pairs.way, -pairs.way], axis=1)
    return LineHistory(
        key=pairs.key,
        arm=np.einsum("kaji,kaj->kai", turned, half),
        normal=np.einsum("kaji,kj->kai", turned, normal),
        share=share,
        density=density,
        thinning=thinning,
        shape=shape,
        distance=r,
        force=law.push(share * density, share * thinning, shape, r)[0],
        shear=turned.swapaxes(2, 3) @ shear[:, None] @ turned,
        spring=density * law.closing(r - closest, shape) / (2 * np.pi * r),
        traction=np.zeros((len(r), 2, 3)),
        end_traction=np.zeros((len(r), 2, 3)),
        stored=np.zeros(len(r)),
    )


def committed_history(
    mu: float,
    unslipped: LineHistory,  # of the pairs that touch
    points: CommittedPoints,
    active: ActivePairs,  # the same ones, with their friction
    dissipated: float,  # work of friction before [J]
) -> LineHistory:
    """Return the history of pairs that touch after an increment."""
    pairs, friction = active.pairs, active.friction
    on_j = np.zeros((len(pairs.i), 3))
    past = np.zeros(len(pairs.i))
    old = np.searchsorted(pairs.key, friction.key)
    on_j[old], past[old] = friction.traction, friction.stored
    normal, spring = unslipped.normal, unslipped.spring
    end_traction = np.einsum("kaji,kj->kai", points.rotation[pairs.both], on_j)
    traction = end_traction - normal * np.einsum("kai,kai->ka", normal, end_traction)[..., None]
    stiff = _stiff(unslipped.shear[:, :1], normal[:, :1])
    most = _ratio(mu * unslipped.force, np.linalg.norm(traction[:, 0], axis=1))
    most = np.minimum(most, np.sqrt(_ratio(past, stored_energy(traction[:, 0], spring, stiff))))
    traction *= np.minimum(most, 1.0)[:, None, None]
    stored = stored_energy(traction[:, 0], spring, stiff)
    lost = friction.dissipated.sum() + friction.left_behind + friction.stored.sum() - stored.sum()
    return replace(
        unslipped,
        traction=traction,
        end_traction=end_traction,
        stored=stored,
        dissipated=dissipated + float(lost),
        points=points,
    )


def friction_tangent(
    mu: float,
    pairs: PointPairs,
    friction: PairFriction,
    n: int,  # of all points
    images: int,  # lattice vectors by which points have images
) -> tuple[np.ndarray, np.ndarray]:
    """Return blocks (m, a): place and turn of i, those of j, lattice vectors; and matrices (m, a, a, 3, 3)."""
    at = friction.pair
    m = len(friction.pair)
    a = 4 + images
    along = pairs.way[at] / pairs.distance[at, None]
    weight = np.column_stack([np.tile([-1.0, 0.0, 1.0, 0.0], (m, 1)), pairs.image[at, :images]])  # of the way
    # Of i against j where they met
    motion = -np.einsum("ka,ij->kiaj", weight, np.eye(3)).reshape(m, 3, 3 * a)
    lever = hat(friction.arm)
    motion[:, :, 3:6] = -lever[:, 0]
    motion[:, :, 9:12] = lever[:, 1]
    pressed = np.einsum("ka,ki->kai", weight, along).reshape(m, 3 * a)  # of the distance
    S = friction.shear
    k = friction.spring[:, None, None]
    change = k * S.mean(axis=1) @ motion
    stretched = np.einsum("kaij,kj->kai", S, friction.slip)
    change += friction.rate[:, None, None] * stretched.mean(axis=1)[:, :, None] * pressed[:, None]
    turned = 0.5 * (
        k[:, None] * (S @ hat(friction.slip)[:, None] - hat(stretched)) - hat(friction.past_traction)
    )
    change[:, :, 3:6] += turned[:, 0]
    change[:, :, 9:12] += turned[:, 1]
    slides = friction.slides
    change[slides] = _limited(mu, friction[np.flatnonzero(slides)], change[slides], pressed[slides])
    matrices = motion.swapaxes(1, 2) @ change
    pull = hat(friction.traction)
    matrices[:, 3:6, 3:6] += pull @ lever[:, 0]
    matrices[:, 9:12, 9:12] -= pull @ lever[:, 1]
    unknowns = (2 * pairs.both[at][..., None] + np.arange(2)).reshape(m, 4)
    unknowns = np.column_stack([unknowns, np.tile(2 * n + np.arange(images), (m, 1))])
    return unknowns, matrices.reshape(m, a, 3, a, 3).swapaxes(2, 3)


def _stiff(shear: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return S (m, 3, 3), the mean over sections (m, s, 3, 3), with a stiffness along the normal as well."""
    normal = normals.mean(axis=1)
    return shear.mean(axis=1) + normal[:, :, None] * normal[:, None, :]


def _limited(mu: float, friction: PairFriction, change: np.ndarray, pressed: np.ndarray) -> np.ndarray:
    """Return the derivatives (m, 3, 15) of tractions of pairs that slide, from those of trial tractions.

    `pressed` (m, 15) is the derivative of the distance.
    """
    t = friction.traction
    c = friction.beyond[:, None, None]
    S = friction.shear
    stiff = _stiff(S, friction.normals)
    normal = friction.normals.mean(axis=1)
    # c dS t, as S and the normals turn with both sections
    turned = 0.5 * (S @ hat(t)[:, None] - hat(np.einsum("kaij,kj->kai", S, t)))
    turned -= 0.5 * np.einsum("ki,ki->k", normal, t)[:, None, None, None] * hat(friction.normals)
    turned += 0.5 * normal[:, None, :, None] * np.cross(friction.normals, t[:, None])[:, :, None, :]
    change = change.copy()
    change[:, :, 3:6] -= c * turned[:, 0]
    change[:, :, 9:12] -= c * turned[:, 1]
    softer = np.linalg.inv(np.eye(3) + c * stiff)
    eased = softer @ change
    along = np.einsum("kij,kj->ki", softer @ stiff, t)  # - dt / dc
    limit = np.linalg.norm(t, axis=1) * mu * friction.change
    excess = np.einsum("ki,kij->kj", t, eased) - limit[:, None] * pressed
    excess /= np.einsum("ki,ki->k", t, along)[:, None]
    return eased - along[:, :, None] * excess[:, None]
