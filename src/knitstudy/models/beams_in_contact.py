"""Beams in contact: yarns as chains of beams, tied where the scene ties them and in contact at all other crossings.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied 3D network. Pinned ties hold
the same two points together and leave the rotation free; ties "patch" are as compliant as a small tied patch of two
solid yarns.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import CoarseIncrement
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.history import Recorder
from knitstudy.loading.solve import Problem, Reported, settings_of
from knitstudy.mechanics.beam_approach import A, B, Curves, Pairs, approach
from knitstudy.mechanics.beam_contact import BeamContact
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.increment import Increment
from knitstudy.models import endless_beams
from knitstudy.models.endless_beams import penalty, pressing
from knitstudy.models.joints import JointPoints, Joints, contacts_of_crossings, patch_stiffness
from knitstudy.models.network_3d import Network, loaded, spatial_network
from knitstudy.study.scene import Scene


def piece_bounds(crossings: Crossings, length: np.ndarray) -> np.ndarray:
    """Return the piece (K, 2, 2) of either yarn that belongs to a crossing: half way to the next along the yarn [m]."""
    yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
    order = np.lexsort((s, yarn))
    middle = 0.5 * (s[order][1:] + s[order][:-1])
    same = yarn[order][1:] == yarn[order][:-1]
    low = np.concatenate([[0.0], np.where(same, middle, 0.0)])
    high = np.concatenate([np.where(same, middle, length[yarn[order][:-1]]), [length[yarn[order][-1]]]])
    bounds = np.empty((len(s), 2))
    bounds[order] = np.stack([low, high], axis=1)
    return bounds.reshape(-1, 2, 2)


def point_pairs(crossings: Crossings, chosen: np.ndarray, length: np.ndarray) -> Pairs:
    """Return one pair of closest points for each of the crossings `chosen` (k,); yarns are `length` (Y,) long [m]."""
    bounds = piece_bounds(crossings, length)
    return Pairs(crossings.yarn[chosen], bounds[chosen], crossings.arc_length[chosen])


STRIP = 0.25  # between the windows of two pairs, over the radius: hardly a point counts in both


def pairs_between(crossings: Crossings, length: np.ndarray, radius: float) -> Pairs:
    """Return pairs of points on the pieces of two crossings that follow each other on both yarns, one of either."""
    bounds, yarn, s = piece_bounds(crossings, length), crossings.yarn, crossings.arc_length
    follows = bounds[:, None, :, 1] == bounds[None, :, :, 0]  # (K, K, 2)
    next_to = (follows | follows.swapaxes(0, 1)) & (yarn[:, None] == yarn)
    one, other = np.nonzero(next_to.all(axis=2))
    windows = np.stack([bounds[one, A], bounds[other, B]], axis=1) + STRIP * radius * np.array([1, -1])
    return Pairs(yarn[one], windows, 0.5 * (s[one] + s[other]))


MARGIN = 0.3  # gap up to which pieces count as near, over the radius
BESIDE = (
    1.0  # the same at rest, up to which yarns may come to touch beside crossings, as the legs of a loop do
)
WINDOW = 4.0  # how far such contacts may slide along either yarn, over the radius


@dataclass(frozen=True, eq=False)
class Gaps:
    """Smallest gaps of yarns in one configuration."""

    crossing: np.ndarray  # (K,) of the two pieces that belong to a crossing [m]; inf where they are not near
    elsewhere: float  # of all other pieces [m]; inf if none are near
    yarn: tuple[int, int]  # the yarns of that gap
    arc_length: tuple[float, float]  # where it is on them [m]

    @property
    def smallest(self) -> float:
        """Smallest of all [m]."""
        return min(self.elsewhere, float(self.crossing.min(initial=np.inf)))


class Neighbours:
    """Search for pieces of yarn that are near each other, a yarn with itself included."""

    def __init__(
        self,
        curves: Curves,
        yarn: np.ndarray,  # (S,) of the stations
        crossings: Crossings,
        radius: float,  # [m]
    ) -> None:
        self.curves, self.yarn, self.radius = curves, np.asarray(yarn), radius
        self.count = len(crossings.row)
        start = piece_bounds(crossings, curves.length)[..., 0]
        order = np.lexsort((start.ravel(), crossings.yarn.ravel()))
        self._starts = self._place(crossings.yarn, start).ravel()[order]
        self._piece_yarn, self._piece_crossing = crossings.yarn.ravel()[order], order // 2
        self._step = float(np.diff(curves.arc_length).max())
        self._crossed = (
            np.sort(crossings.yarn),
            np.where(np.diff(crossings.yarn) < 0, crossings.arc_length[:, ::-1], crossings.arc_length),
        )

    def _closest(self, position: np.ndarray, margin: float) -> tuple[Pairs, np.ndarray, np.ndarray]:
        """Return near pairs, their closest points (k, 2), and their gaps, inf where yarns cannot touch."""
        reach = (2 + margin) * self.radius + self._step
        one, other = cKDTree(position).query_pairs(reach, output_type="ndarray").T
        s = self.curves.arc_length
        near = np.stack([one, other], axis=1)
        near = near[self._may_meet(self.yarn[near], s[near]) & self._nearest(near, position)]
        start = s[near]
        low = np.maximum(start - self._step, 0.0)
        high = np.minimum(start + self._step, self.curves.length[self.yarn[near]])
        pairs = Pairs(self.yarn[near], np.stack([low, high], axis=-1), start)
        here = approach(self.curves, position, pairs)
        meets = self._may_meet(pairs.yarn, here.s)
        return pairs, here.s, np.where(meets, here.distance - 2 * self.radius, np.inf)

    def beside(self, position: np.ndarray, known: Pairs) -> Pairs:
        """Return pairs of points near each other beside `known` pairs; no window has a crossing in it."""
        pairs, s, gap = self._closest(position, BESIDE)
        inside = (s[:, None] >= known.bounds[..., 0]) & (s[:, None] <= known.bounds[..., 1])
        twice = (inside & (pairs.yarn[:, None] == known.yarn)).all(axis=2).any(axis=1)
        chosen = (gap < BESIDE * self.radius) & (self._crossing_of(pairs.yarn, s) < 0) & ~twice
        yarn, s = pairs.yarn[chosen], s[chosen]
        twice = cKDTree(self._place(yarn, s)).query_pairs(2 * self._step, output_type="ndarray")[:, 1]
        yarn, s = np.delete(yarn, twice, axis=0), np.delete(s, twice, axis=0)
        away = np.abs(s[:, None] - self._crossed[1]).max(axis=2, initial=0.0)  # (k, K)
        away[(yarn[:, None] != self._crossed[0]).any(axis=2)] = np.inf
        alone = np.where(
            yarn[:, A] == yarn[:, B], 0.5 * (np.abs(s[:, A] - s[:, B]) - np.pi * self.radius), np.inf
        )
        width = np.minimum(np.minimum(0.5 * away.min(axis=1, initial=np.inf), alone), WINDOW * self.radius)
        low = np.maximum(s - width[:, None], 0.0)
        high = np.minimum(s + width[:, None], self.curves.length[yarn])
        return Pairs(yarn, np.stack([low, high], axis=-1), s)

    def gaps(self, position: np.ndarray) -> Gaps:
        """Return the gaps where the stations are at positions (S, 3) [m]."""
        pairs, s, gap = self._closest(position, MARGIN)
        crossing = np.full(self.count, np.inf)
        if not len(gap):
            return Gaps(crossing, np.inf, (-1, -1), (np.nan, np.nan))
        known = self._crossing_of(pairs.yarn, s)
        np.minimum.at(crossing, known[known >= 0], gap[known >= 0])
        beyond = np.where(known < 0, gap, np.inf)
        k = int(np.argmin(beyond))
        return Gaps(crossing, float(beyond[k]), tuple(map(int, pairs.yarn[k])), tuple(map(float, s[k])))

    def _nearest(self, near: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Return which pairs of stations (k, 2) are no farther apart than those beside them along their yarns."""
        distance = np.linalg.norm(position[near[:, A]] - position[near[:, B]], axis=1)
        nearest = np.ones(len(near), dtype=bool)
        low, high = self.curves.first[self.yarn[near]], self.curves.first[self.yarn[near] + 1] - 1
        for step in product((-1, 0, 1), repeat=2):
            beside = np.clip(near + np.array(step), low, high)
            nearest &= distance <= np.linalg.norm(position[beside[:, A]] - position[beside[:, B]], axis=1)
        return nearest

    def _may_meet(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return whether points (k, 2) may touch: only a yarn bent to less than its radius could beside itself."""
        return (yarn[:, A] != yarn[:, B]) | (np.abs(s[:, A] - s[:, B]) > np.pi * self.radius)

    def _place(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return places on one axis, yarn after yarn."""
        return 2 * self.curves.length.max() * yarn + s

    def _crossing_of(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the crossing (k,) that both points belong to, or -1."""
        piece = np.searchsorted(self._starts, self._place(yarn, s), side="right") - 1
        # A yarn without crossings has no pieces.
        crossing = np.where(self._piece_yarn[piece] == yarn, self._piece_crossing[piece], -1)
        return np.where(crossing[:, A] == crossing[:, B], crossing[:, A], -1)


# Penetration over the radius, of yarns between which no contact acts, beyond which a state is refused. Beside pins in
# wale tension it reaches 1 %. Solid yarns under the force of such a crossing, 10 to 30 N, approach each other by 5 to
# 10 % (Hertz): a second contact would carry little.
UNSEEN = 0.02


@dataclass(eq=False)
class BeamKnit:
    """A knit of beams in contact, which reports stations, crossings and the gaps of yarns near each other."""

    network: Network
    model: BeamModel
    tied: np.ndarray  # (K,) crossings that are joined at their closest points
    neighbours: Neighbours
    # Yarns without ties: the internal force at a tied station equals the force of the tie
    apart: BeamModel
    crossings: Crossings
    gaps: Gaps | None = None  # of the increment that was recorded last
    pressed: float = 0.0  # smallest gap of contacts beside crossings then, at most zero [m]

    def __post_init__(self) -> None:
        stations, crossings = self.network.stations, self.crossings
        lower = crossings.chosen(self.tied)
        self._lower = stations.nearest(lower.yarn[:, 0], lower.arc_length[:, 0])
        curves = self.model.contact.curves
        self._stencil = curves.stencil(crossings.yarn, crossings.arc_length)  # (K, 2)
        self._rest = crossings.point.mean(axis=1)[:, None]
        self._arm = self._rest - self._stencil.of(self._stencil.value, stations.position)

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        state = increment.state
        self.gaps = self.neighbours.gaps(self.model.contact.places(state).position)
        smallest = self.gaps.smallest
        columns = {
            "centreline_displacement": self.network.station_displacement(self.model, state),
            "smallest_gap": smallest if np.isfinite(smallest) else np.nan,
            **self.at_crossings(state),
        }
        return columns, {}

    def at_crossings(self, state: BeamState) -> dict[str, np.ndarray]:
        """Return forces, displacements, gaps and slip at crossings, as columns of the history.

        All that is of contact has been committed with the state.
        """
        contact, tied, stencil = self.model.contact, self.tied, self._stencil
        places, past = contact.places(state), state.contact
        free, beside, elsewhere = np.split(np.arange(len(past.gap)), np.cumsum([np.sum(~tied), np.sum(tied)]))
        self.pressed = float(past.gap[elsewhere].min(initial=0.0))
        (slip, gap), force = np.full((2, len(tied)), np.nan), np.zeros((len(tied), 3))
        slip[~tied], force[~tied] = past.slip[free], past.on_a[free]
        gap[~tied] = np.where(np.isfinite(past.gap[free]), past.gap[free], np.nan)
        station_force = self.apart.respond(places, stiffness=False).force.reshape(-1, 6)[:, :3]
        # What a tied station carries of the contact beside its tie is in the internal force there.
        touched = contact.curves.stencil(contact.pairs.yarn[beside, A], past.s[beside, A])
        there = np.sum(touched.value * (touched.stations == self._lower[:, None]), axis=1)
        force[tied] = station_force[self._lower] + (1 - there)[:, None] * past.on_a[beside]
        # Of tied yarns, the gap at the points of their centrelines that were closest at rest, or where it is smallest
        middle = stencil.of(stencil.value, places.position)
        apart = (np.linalg.norm(middle[:, B] - middle[:, A], axis=1) - 2 * self.neighbours.radius)[tied]
        gap[tied] = np.minimum(apart, past.gap[beside] - contact.carried[beside])
        # Of the points of both surfaces that faced each other at rest
        rotation = places.rotation[stencil.stations]
        moved = middle + np.einsum("kap,kapij,kaj->kai", stencil.value, rotation, self._arm)
        return {
            "crossing_force": force,
            "crossing_displacement": moved - self._rest,
            "crossing_gap": gap,
            "crossing_slip": slip,
        }

    def require_seen(self, increment: Increment, recorder: Recorder) -> None:
        """Refuse an increment, recorded last, in which yarns penetrate each other where no contact acts.

        Raises ConvergenceError if pieces of yarn away from crossings, or deeper than the contact or the tie at a
        crossing knows, overlap by more than `UNSEEN` radii. A tie that yields lets yarns approach each other as much as
        their patches are indented.
        """
        gaps, allowed = self.gaps, UNSEEN * self.neighbours.radius
        elsewhere = gaps.elsewhere - self.pressed
        known = np.fmin(recorder.columns["crossing_gap"][-1], 0.0)  # (K,)
        unseen = gaps.crossing - known
        if elsewhere < -allowed:
            (one, other), (s, t) = gaps.yarn, gaps.arc_length
            where = f"yarns {one} and {other} at arc lengths {s:.4g} and {t:.4g} m, which is no crossing,"
            depth = -elsewhere
        elif unseen.min(initial=np.inf) < -allowed:
            k = int(np.argmin(unseen))
            kind = "tied" if self.tied[k] else "touching"
            where, depth = f"the yarns of crossing {k}, beside the {kind} points,", -unseen[k]
        else:
            return
        message = (
            f"increment {increment.index}: {where} penetrate each other by {depth:.3g} m, unseen by the beams' "
            f"contact; allowed is {allowed:.3g} m. Use a smaller load.strain"
        )
        raise CoarseIncrement(message, depth)  # yarns may have jumped through each other


def beam_knit(scene: Scene, fabric: Fabric) -> BeamKnit:
    """Return the beams of a scene; errors as of `build`."""
    crossings = fabric.crossings
    tied = tied_crossings(scene, crossings)
    points = JointPoints.at_crossings(crossings, tied)
    joints = Joints.all_tied(len(points.yarn))
    if scene.beam.tie == "pinned":
        # As stiff as contact that sticks, and never open.
        joints = joints.pinned(penalty(scene))
    elif scene.beam.tie == "patch" and tied.any():
        discs = contacts_of_crossings(fabric, scene.tie.radius).isel(crossing=tied)
        joints = joints.pinned(patch_stiffness(fabric, points, discs, scene.yarn))
    stops = fabric.grip_ends(scene.load.direction)
    beams = spatial_network(fabric, points, scene.mesh.beam_size, joints=joints, stops=stops)
    stations, law, yarn = beams.stations, scene.mesh.section_law, scene.yarn
    curves = Curves(stations.yarn, stations.arc_length)
    neighbours = Neighbours(curves, stations.yarn, crossings, yarn.radius)
    # Those that are tied come last
    pairs = point_pairs(crossings, np.argsort(tied, kind="stable"), curves.length)
    between = pairs_between(crossings, curves.length, yarn.radius)
    pairs = pairs.joined(between).joined(neighbours.beside(stations.position, between))
    # A patch of Hertz's is larger than the disc of a tie, and yarns touch beside it, from this overlap on.
    carried = np.zeros(len(pairs.start))
    carried[np.sum(~tied) : len(tied)] = scene.tie.radius**2 * yarn.radius
    contact = beam_contact(scene, beams, curves, pairs, int(np.sum(~tied)), carried)
    model = beams.model(yarn, law, contact)
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    elements = np.column_stack([first, first + 1])
    apart = BeamModel(stations.position, elements, beams.section(yarn, law), yarn.radius)
    return BeamKnit(beams, model, tied, neighbours, apart, crossings)


def beam_contact(
    scene: Scene, beams: Network, curves: Curves, pairs: Pairs, *of_ties: int | np.ndarray
) -> BeamContact:
    """Return the contact of pairs of points on beams; the last arguments are those of `BeamContact`."""
    friction = scene.kind.interaction.friction(scene)
    stations = beams.station_node, beams.station_offset
    return BeamContact(curves, pairs, *stations, scene.yarn.radius, pressing(scene), friction, *of_ties)


def build(scene: Scene, fabric: Fabric, rest: xr.Dataset | None = None) -> Problem:
    """Return a scene with beams in contact as a problem; a cell of an endless fabric may begin with a shape at rest.

    Raises DataFileError if ties yield and no compliance is known for their size; GeometryError if two ties of a yarn
    coincide, or a yarn has too few nodes for a smooth centreline.
    """
    if len(fabric.periods):
        return endless_beams.build(scene, fabric, rest)
    beams = beam_knit(scene, fabric)
    law = beams.model.contact
    return loaded(
        scene,
        fabric,
        beams.network,
        model=beams.model,
        observer=beams,
        settings=settings_of(scene, touches=True),
        checks=(beams.require_seen,),
        constants={"crossing_tied": beams.tied.astype(np.int8)},
        attributes={
            "beam_section": scene.beam.section,
            "beam_ties": scene.beam.tie,
            "contact_coefficient": law.law.coefficient,
            "contact_exponent": law.law.exponent,
            "contact_stick_share": law.law.share,
            "friction": law.friction.friction,
            "contact_points": len(law.pairs.start),
        },
    )
