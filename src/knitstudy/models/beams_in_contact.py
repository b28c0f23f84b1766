"""Beams in contact: yarns as chains of beams, tied where the scene ties them and in contact at all other crossings.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied 3D network. Pinned ties hold
the same two points together and leave the rotation free; ties "patch" are as compliant as a small tied patch of two
solid yarns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import CoarseIncrement, GeometryError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_known_contact
from knitstudy.loading.history import Recorder
from knitstudy.loading.solve import Problem, Reported, settings_of
from knitstudy.mechanics.beam_approach import A, B, Curves, Pairs, approach, at_places, bends
from knitstudy.mechanics.beam_contact import MOST, BeamContact
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.increment import Increment
from knitstudy.models import endless_beams
from knitstudy.models.endless_beams import patch, penalty, pressing
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
    return Pairs(crossings.yarn, bounds, crossings.arc_length)[chosen]


STRIP = 0.25  # between the windows of two pairs, over the radius: hardly a point counts in both
WINDOW = 4.0  # how far further contact may slide along either yarn, over the radius
MARGIN = 0.3  # gap that is reported, over the radius
BESIDE = 1.0  # the same up to which a local minimum of the gap has a pair that follows it

# Distance along either yarn, over the radius, within which a minimum is that of a pair. Overlap of Hertz's law is as
# long as 8/3 sqrt(R delta) of a line that carries E*/2 per length: 0.8 to 1.2 R where yarns overlap by 0.1 to 0.2 R.
# Closer points would count overlap twice.
OWN = 1.0
# The same of minima that belong to one arc, along which yarns wrap around each other: all its points carry it together.
ARC = 2.0


class Neighbours:
    """Search for pieces of yarn that are near each other, a yarn with itself included.

    The first pairs are those of crossings, the free ones and then the tied ones; those of the pieces between two
    crossings that follow each other on both yarns, one of either, come next.
    """

    def __init__(
        self,
        curves: Curves,
        yarn: np.ndarray,  # (S,) of the stations
        crossings: Crossings,
        tied: np.ndarray,  # (K,) crossings that are tied
        radius: float,  # [m]
    ) -> None:
        self.curves, self.yarn, self.radius = curves, np.asarray(yarn), radius
        self.crossings, self._order = crossings, np.argsort(tied, kind="stable")
        self._step = float(np.diff(curves.arc_length).max())
        # Crossings along one yarn after another: neighbours on a yarn are 1 apart, those on different ones more.
        place = np.argsort(np.argsort(self._places(crossings.yarn, crossings.arc_length), axis=None))
        next_to = _within(place.reshape(-1, 2) + crossings.yarn, 1.0)
        self._between = np.unique(np.concatenate([next_to, next_to[:, ::-1]]), axis=0).T

    def first(self) -> Pairs:
        """Return the pairs of crossings and between them, at rest.

        Raises GeometryError if two crossings are nearer than `OWN` radii.
        """
        one, other = self._between
        s = self.crossings.arc_length
        yarn = np.concatenate([self.crossings.yarn[self._order], self.crossings.yarn[one]])
        start = np.concatenate([s[self._order], 0.5 * (s[one] + s[other])])
        if len(apart := self.near(self.crossings.yarn, s, OWN)[1]):
            raise GeometryError(
                f"two crossings of the same yarns are {apart.min() / self.radius:.2f} yarn radii apart, less than "
                f"{OWN:g}: beams would count their contact twice; use other spacings"
            )
        return Pairs(yarn, self._windows(yarn, start), start)

    def search(self, position: np.ndarray, pairs: Pairs, s: np.ndarray) -> Pairs:
        """Return `pairs` in windows of where they are, and a pair for every minimum that no point s (k, 2) follows."""
        found, place, gap = self.closest(position, BESIDE)
        order = np.argsort(gap, kind="stable")
        order = order[gap[order] < BESIDE * self.radius]
        yarn = np.concatenate([pairs.yarn, found.yarn[order]])
        chosen, start = np.ones(len(yarn), dtype=bool), np.concatenate([pairs.start, place[order]])
        chosen[self.near(yarn, np.concatenate([s, place[order]]), OWN)[0][:, 1]] = False
        chosen[: len(s)] = True
        return Pairs(yarn[chosen], self._windows(yarn[chosen], start[chosen]), start[chosen])

    def _windows(self, yarn: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the windows (k, 2, 2) of pairs that start at (k, 2): no two overlap.

        Those of crossings are their pieces now. Further pairs and the others of the same yarns part half way between
        them, on the yarn along which they are farther apart.
        """
        arc_length = np.empty_like(self.crossings.arc_length)
        arc_length[self._order] = start[: len(arc_length)]
        piece = piece_bounds(replace(self.crossings, arc_length=arc_length), self.curves.length)
        one, other = self._between
        between = np.stack([piece[one, A], piece[other, B]], axis=1) + STRIP * self.radius * np.array([1, -1])
        first = len(piece) + len(between)
        alone = 0.5 * (np.abs(np.diff(start)) - np.pi * self.radius)
        width = np.where(np.diff(yarn) == 0, np.fmin(alone, WINDOW * self.radius), WINDOW * self.radius)
        more = start[first:, :, None] + width[first:, None] * np.array([-1, 1])
        more = np.clip(more, 0.0, self.curves.length[yarn[first:], None])
        bounds = np.concatenate([piece[self._order], between, more])
        turned = np.diff(self._places(yarn, start))[:, 0] < 0
        bounds[turned], s = bounds[turned, ::-1], np.where(turned[:, None], start[:, ::-1], start)
        one, other = self.near(yarn, start, self.curves.length.max() / self.radius)[0].T
        one, other = one[other >= first], other[other >= first]
        side = np.argmax(np.abs(s[one] - s[other]), axis=1)
        upwards = s[one, side] < s[other, side]
        middle, strip = 0.5 * (s[one, side] + s[other, side]), 0.5 * STRIP * self.radius
        np.minimum.at(bounds, (np.where(upwards, one, other), side, 1), middle - strip)
        np.maximum.at(bounds, (np.where(upwards, other, one), side, 0), middle + strip)
        bounds[turned] = bounds[turned, ::-1]
        return bounds

    def closest(self, position: np.ndarray, margin: float) -> tuple[Pairs, np.ndarray, np.ndarray]:
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

    def _places(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return places on one axis, yarn after yarn."""
        return 2 * self.curves.length.max() * yarn + s

    def near(self, yarn: np.ndarray, s: np.ndarray, radii: float) -> tuple[np.ndarray, np.ndarray]:
        """Return pairs (m, 2) of points s (k, 2) within so many radii along both yarns, and distances (m,) [m]."""
        places = np.sort(self._places(yarn, s), axis=1)
        pairs = _within(places, radii * self.radius)
        return pairs, np.abs(places[pairs[:, 0]] - places[pairs[:, 1]]).max(axis=1)


def _within(places: np.ndarray, distance: float) -> np.ndarray:
    """Return pairs (m, 2) of rising numbers of places (k, 2) that are no farther apart on either axis."""
    return cKDTree(places).query_pairs(distance, np.inf, output_type="ndarray")


# Penetration over the radius, of yarns between which no contact acts, beyond which a state is refused. Beside pins in
# wale tension it reaches 1 %. Solid yarns under the force of such a crossing, 10 to 30 N, approach each other by 5 to
# 10 % (Hertz): a second contact would carry little.
UNSEEN = 0.02
LAG = 0.1  # share of what is seen that may be unseen besides: springs hold points on an arc away from the minimum


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

    def __post_init__(self) -> None:
        stations, crossings = self.network.stations, self.crossings
        lower = crossings[self.tied]
        self._lower = stations.nearest(lower.yarn[:, 0], lower.arc_length[:, 0])
        curves = self.model.contact.curves
        self._stencil = curves.stencil(crossings.yarn, crossings.arc_length)  # (K, 2)
        self._rest = crossings.point.mean(axis=1)[:, None]
        self._arm = self._rest - self._stencil.of(self._stencil.value, stations.position)

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        state = increment.state
        _, _, gap = self.neighbours.closest(self.model.contact.places(state).position, MARGIN)
        smallest = float(gap.min(initial=np.inf))
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
        free, beside = np.split(np.arange(len(tied)), [np.sum(~tied)])
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
        gap[tied] = np.minimum(apart, past.gap[beside] - past.carried[beside])
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
        """Refuse an increment in which yarns penetrate each other where no contact acts.

        Contact within `ARC` radii sees an overlap at which one point would carry as much. A minimum with no pair within
        `OWN` radii gets one in the next increment, and only its growth in this one counts: an arc may have been as deep
        before it had a minimum. Raises CoarseIncrement where the share `LAG` and `UNSEEN` radii more are unseen.
        """
        contact, past, radius = self.model.contact, increment.state.contact, self.neighbours.radius
        pairs, s, gap = self.neighbours.closest(contact.places(increment.state).position, MARGIN)
        yarn, places = np.append(past.pairs.yarn, pairs.yarn, axis=0), np.append(past.s, s, axis=0)
        near, apart = self.neighbours.near(yarn, places, ARC)
        known, number = near[:, 0], near[:, 1] - len(past.s)
        of = (known < len(past.s)) & (number >= 0)
        known, number, apart = known[of], number[of], apart[of]
        carried = np.zeros(len(s))
        np.maximum.at(carried, number, past.carried[known])
        seen = carried + contact.law.depth(np.bincount(number, past.force[known], len(s)))
        alone = ~np.isin(np.arange(len(s)), number[apart < OWN * radius])
        position = self.network.stations.position + recorder.columns["centreline_displacement"][-2:][0]
        stencil = contact.curves.stencil(pairs.yarn, s)
        way = np.diff(stencil.of(stencil.value, position), axis=1)[:, 0]
        seen[alone] = np.maximum(seen, 2 * radius - np.linalg.norm(way, axis=1))[alone]
        depth, allowed = -gap - (1 + LAG) * seen, UNSEEN * radius
        if depth.max(initial=0.0) <= allowed:
            return
        k = int(np.argmax(depth))
        (one, other), (here, there) = pairs.yarn[k], s[k]
        message = (
            f"increment {increment.index}: yarns {one} and {other} at arc lengths {here:.4g} and {there:.4g} m "
            f"penetrate each other by {depth[k]:.3g} m, unseen by the beams' contact; allowed is {allowed:.3g} m. Use "
            "a smaller load.strain"
        )
        raise CoarseIncrement(message, depth[k])  # yarns may have jumped through each other

    def require_known(self, scene: Scene, increment: Increment, recorder: Recorder) -> None:
        """Refuse a state beyond the verified law of a point; raises as `require_known_contact`."""
        contact, past = self.model.contact, increment.state.contact
        if contact.patch is None:
            return
        here = at_places(contact.curves, contact.places(increment.state).position, past.pairs.yarn, past.s)
        shape, radius = bends(here, contact.radius), contact.radius

        def where(k: int) -> str:
            (one, other), (s, t) = past.pairs.yarn[k], past.s[k]
            return f"yarns {one} and {other} at arc lengths {s:.4g} and {t:.4g} m"

        factor = contact.patch.force(shape).value
        stored = np.minimum(factor, MOST) * contact.law.energy(past.gap)
        internal = increment.response.energy["internal"]
        require_known_contact(
            scene, increment, stored, internal, -past.gap / radius, shape, factor, MOST, where
        )


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
    neighbours = Neighbours(curves, stations.yarn, crossings, tied, yarn.radius)
    pairs = neighbours.first()
    # A patch of Hertz's is larger than the disc of a tie, and yarns touch beside it, from this overlap on.
    carried = np.zeros(len(pairs.start))
    carried[np.sum(~tied) : len(tied)] = scene.tie.radius**2 * yarn.radius
    contact = beam_contact(scene, beams, curves, pairs, int(np.sum(~tied)), carried, neighbours.search)
    model = beams.model(yarn, law, contact)
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    elements = np.column_stack([first, first + 1])
    apart = BeamModel(stations.position, elements, beams.section(yarn, law), yarn.radius)
    return BeamKnit(beams, model, tied, neighbours, apart, crossings)


def beam_contact(scene: Scene, beams: Network, curves: Curves, pairs: Pairs, *further: Any) -> BeamContact:
    """Return the contact of pairs of points on beams; the last arguments are those of `BeamContact`."""
    friction = scene.kind.interaction.friction(scene)
    stations = beams.station_node, beams.station_offset
    rigid = scene.value("yarn.pressing") is None and scene.value("beam.section") == "rigid"
    law, shape = pressing(scene), None if rigid else patch(scene)
    return BeamContact(curves, pairs, *stations, scene.yarn.radius, law, friction, *further, patch=shape)


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
        checks=(beams.require_seen, partial(beams.require_known, scene)),
        constants={"crossing_tied": beams.tied.astype(np.int8)},
        attributes={
            "beam_section": scene.beam.section,
            "beam_ties": scene.beam.tie,
            "contact_coefficient": law.law.coefficient,
            "contact_exponent": law.law.exponent,
            "contact_stick_share": law.law.share,
            "friction": law.friction,
            "contact_points": len(law.pairs.start),
        },
    )
