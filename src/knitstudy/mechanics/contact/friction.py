"""Coulomb friction: contact points, their history, and the law."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.mechanics.contact.surface import Projection
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Chosen

# Pairs of a point and a surface that touch in one configuration, of the many that are followed


@dataclass(frozen=True, eq=False)
class FrictionPoints:
    """Pairs that touch in one configuration, or did at the last converged increment; all other pairs are open."""

    followed: ContactHistory  # of all pairs that are followed
    least: Floats  # (f,), lower bounds of the gaps of all pairs that are followed [m]
    carriers: Floats  # (M, 3), of the surfaces, in this configuration [m]
    evaluated: Ints  # (e,), which of the pairs that are followed can touch here
    evaluated_xi: Floats  # (e, 2), their closest points
    evaluated_gap: Floats  # (e,), their gaps [m]; inf where there is no closest point
    number: Ints  # (c,), which of the pairs that are followed touch or touched
    history: ContactHistory  # of these, in the same order
    position: Floats  # (c, 3), points [m]
    projection: Projection  # against the surfaces that they face
    gap: Floats  # (c,), gaps [m]; inf where there is no closest point
    slip: Floats  # (c, 2), convected coordinates since the anchor, s
    slip_rate: Floats  # (c, 2), ds/dg of points that have touched within this increment, else 0
    slip_share: Floats  # (c,), ds/dxi: 1, or the share of the increment in contact
    trial: Floats  # (c, 3), trial traction epsT s [Pa]
    pressure: Floats  # (c,)
    traction: Floats  # (c, 3), tangential part [Pa]
    status: Ints  # (c,) OPEN, STICK or SLIP
    law: Coulomb  # with the stiffnesses of all pairs
    # (c,), between the first parameters' lines of both surfaces at the last converged increment, if the law
    # asks for it
    angle: Floats | None

    @property
    def active(self) -> Ints:
        """Pairs (a,) that touch."""
        return np.flatnonzero(self.status != OPEN)

    def signature(self) -> Ints:
        """Return points, surfaces and status (a, 3) of the pairs that touch, which must not change any more."""
        active = self.active
        table = np.stack(
            [self.history.point[active], self.history.surface[active], self.status[active]], axis=1
        )
        return table[np.lexsort(table.T)]


# History of contact points from one converged increment to the next, and which pair is which after a new search


@dataclass(eq=False)
class ContactStatus:
    """State of the search for pairs, which a restart needs to the last bit."""

    at_search: Floats  # (M, 3), carriers of the surfaces at the last search [m]
    seen: Floats  # (M, 3), where they were when gaps were seen last [m]
    least: Floats  # (c,), lower bounds of the gaps of all pairs there [m]


@dataclass(frozen=True, eq=False)
class TouchedPoints:
    """History of the pairs that touch, a row each; some in a hundred of all pairs do."""

    pressure: Floats  # (t,), that of multipliers included [Pa]; where it is positive, the anchor counts
    traction: Floats  # (t, 3), tangential traction [Pa]
    multiplier: Floats  # (t,), pressure (negative) that augmentation has added within the increment [Pa]
    anchor: Floats  # (t, 2), convected coordinates at which the point would carry no tangential traction
    slip: Floats  # (t,), length slipped since the point first touched [m]
    status: Ints  # (t,) OPEN, STICK or SLIP

    @classmethod
    @cache
    def none(cls) -> TouchedPoints:
        """Return a table without rows, the same one for all."""
        scalar = np.empty(0)
        return cls(scalar, np.empty((0, 3)), scalar, np.empty((0, 2)), scalar, np.empty(0, dtype=np.int64))


@dataclass(frozen=True, eq=False)
class ContactHistory(Chosen):
    """History of contact points at the last converged increment; all arrays run over the candidate pairs.

    Pairs that are chosen of a history keep its whole table `touched`: they may be joined with each other, and with open
    pairs, but not with pairs of another table.
    """

    point: Ints  # (c,), Gauss point
    surface: Ints  # (c,), surface that it faces
    xi: Floats  # (c, 2), its closest point
    # (c,), its gap [m]; inf where the closest point was not within the surface's edges, -inf where none was
    # looked for: it was open then, and xi is a guess
    gap: Floats
    row: np.ndarray  # int (c,), the pair's row of `touched`, -1 where it is open
    touched: TouchedPoints
    dissipated: Floats  # (), work of friction so far [J]
    search_status: ContactStatus | None = None  # of the search that these pairs were found by

    @property
    def pressure(self) -> Floats:
        """Pressures (c,) [Pa]; see `TouchedPoints`."""
        return self._every(self.touched.pressure)

    @property
    def traction(self) -> Floats:
        """Tangential tractions (c, 3) [Pa]."""
        return self._every(self.touched.traction)

    @property
    def multiplier(self) -> Floats:
        """Pressures (c,) that augmentation has added [Pa]."""
        return self._every(self.touched.multiplier)

    @property
    def anchor(self) -> Floats:
        """Convected coordinates (c, 2) without tangential traction; of open pairs they mean nothing."""
        return self._every(self.touched.anchor)

    @property
    def slip(self) -> Floats:
        """Lengths (c,) slipped [m]."""
        return self._every(self.touched.slip)

    @property
    def status(self) -> Ints:
        """OPEN, STICK or SLIP (c,)."""
        return self._every(self.touched.status)

    def _every(self, values: np.ndarray) -> np.ndarray:
        """Return values (t, ...) of the table's rows for all pairs, 0 where they are open."""
        result = np.zeros((len(self.row), *values.shape[1:]), dtype=values.dtype)
        known = np.flatnonzero(self.row >= 0)
        result[known] = values[self.row[known]]
        return result

    @classmethod
    def of_open(cls, point: Ints, surface: Ints, xi: Floats, dissipated: Floats) -> ContactHistory:
        """Return the history of open pairs with guesses xi of their closest points."""
        # Arrays of one number take no memory.
        gap, row = (np.broadcast_to(value, len(point)) for value in (-np.inf, np.int32(-1)))
        return cls(point, surface, xi, gap, row, TouchedPoints.none(), dissipated)

    @classmethod
    @cache
    def empty(cls) -> ContactHistory:
        """Return the history of a model in which nothing has touched yet, the same one for all."""
        none = np.empty(0, dtype=np.int64)
        return cls.of_open(none, none, np.empty((0, 2)), np.zeros(()))


def same_pair(history: ContactHistory, arc: Floats, old: ContactHistory, old_arc: Floats) -> Ints:
    """Return for newly found pairs the same pair of an older history, or -1: the same point on the same piece.

    Arc lengths (k,) and (c,) of their closest points are over the least distance of two pieces of a surface.
    """
    point, surface = history.point, history.surface
    if not len(old.point) or not len(point):
        return np.full(len(point), -1)
    count = 1 + max(surface.max(), old.surface.max())
    # Pairs of different points or surfaces lie farther apart in this plane than any two places of one surface.
    new = np.stack([1e6 * (point * count + surface), arc], axis=1)
    known = np.stack([1e6 * (old.point * count + old.surface), old_arc], axis=1)
    distance, index = cKDTree(known).query(new, distance_upper_bound=1.0)
    return np.where(np.isfinite(distance), index, -1)


# The law of contact points: a penalty in normal direction, Coulomb friction along the surface
# Pressure is p = -(multiplier + eps g) where that is positive; the tangential traction is epsT times the slip s since
# the point last stuck, and at most mu p. With mu = inf nothing ever slips: rough contact. With mu = 0 there is no
# friction. Signs: a traction t acts with +t on the internal force of the point's own side, as its gap does.

OPEN, STICK, SLIP = 0, 1, 2  # status of a contact point


@dataclass(frozen=True)
class Coulomb(Chosen):
    """Stiffnesses of contact and friction coefficient."""

    normal: float | Floats  # (k,) eps, pressure over gap [Pa/m]
    tangential: float | Floats  # (k,) epsT, tangential traction over elastic slip [Pa/m]
    friction: float  # mu; inf for rough contact, 0 for none
    slope: float | Floats = 0.0  # (k,) derivative of epsT by the gap [Pa/m2]

    directional = False
    numerical = True  # no body has its stiffnesses

    def pressure(self, gap: Floats, multiplier: Floats, angle: Floats | None = None) -> Floats:
        """Return the pressures (k,) [Pa] at gaps (k,) [m] with multipliers (k,) [Pa]; zero where open."""
        return np.maximum(0.0, -(multiplier + self.normal * gap))

    def stored(self, gap: Floats, pressure: Floats, angle: Floats | None = None) -> Floats:
        """Return the energies (k,) of the pressure at gaps (k,) [J/m2]."""
        return 0.5 * pressure * np.abs(gap)

    def at(self, gap: Floats, angle: Floats | None = None) -> Coulomb:
        """Return the stiffnesses at gaps (k,) [m]: always the same here."""
        return self

    def attributes(self) -> dict[str, float]:
        """Return the constants of the law by name."""
        return {"contact_stiffness": float(self.normal), "stick_stiffness": float(self.tangential)}

    def share(self, trial: Floats, pressure: Floats) -> Floats:
        """Return the shares (k,) of trial tractions (k, 3) [Pa] that friction bears at pressures (k,) [Pa]."""
        if np.isinf(self.friction):
            return np.ones(len(trial))
        size = np.linalg.norm(trial, axis=1)
        limit = self.friction * pressure
        return np.where((size > limit) | (self.friction == 0), limit / np.where(size > 0, size, 1.0), 1.0)

    def traction(self, trial: Floats, pressure: Floats) -> tuple[Floats, Ints]:
        """Return tractions (k, 3) [Pa] and status (k,) from trial tractions epsT s (k, 3) and pressures (k,)."""
        share = self.share(trial, pressure)
        status = np.where(pressure > 0, np.where(share < 1, SLIP, STICK), OPEN)
        return np.where(pressure > 0, share, 0.0)[:, None] * trial, status

    def slipped(self, trial: Floats, pressure: Floats) -> Floats:
        """Return the lengths (k,) [m] that points slip, from trial tractions (k, 3) and pressures (k,) [Pa]."""
        size = np.linalg.norm(trial, axis=1)
        return np.where(pressure > 0, 1 - self.share(trial, pressure), 0.0) * size / self.tangential

    def tangent(
        self,
        trial: Floats,  # (k, 3), trial tractions [Pa]
        trial_change: Floats,  # (k, 3, 9), their derivative
        gap_change: Floats,  # (k, 9), derivative of the gap
        pressure: Floats,  # (k,)
        status: Ints,  # (k,)
    ) -> Floats:
        """Return the derivative (k, 3, 9) of the tractions."""
        change = trial_change.copy()
        slips = status == SLIP
        along = _directions(trial[slips])
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        share = self.share(trial[slips], pressure[slips])[:, None, None]
        change[slips] = share * (across @ trial_change[slips])
        stiffness = self.friction * np.broadcast_to(self.normal, slips.shape)[slips]
        change[slips] -= stiffness[:, None, None] * along[:, :, None] * gap_change[slips][:, None, :]
        return change

    def symmetric_stiffness(self, trial: Floats, normal: Floats, pressure: Floats, status: Ints) -> Floats:
        """Return the symmetric positive part (k, 3, 3) of the law's stiffness [Pa/m].

        It leaves out the rotation of the surface and the coupling of friction to the pressure.
        """
        along_normal = normal[:, :, None] * normal[:, None, :]
        slips = status == SLIP
        along = np.where(slips[:, None], _directions(trial), 0.0)
        plane = np.eye(3) - along_normal - along[:, :, None] * along[:, None, :]
        share = np.where(slips, self.share(trial, pressure), 1.0)
        stiffness = np.broadcast_to(self.normal, share.shape)[:, None, None]
        return stiffness * along_normal + (self.tangential * share)[:, None, None] * plane


def _directions(vectors: Floats) -> Floats:
    """Return the directions of vectors (k, 3); zero where a vector is zero."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(size > 0, size, 1.0)
