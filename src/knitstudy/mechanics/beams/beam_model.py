"""A network of beams and springs as a model that a solver can drive: six unknowns a node, rigid arms eliminated."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beams import beam
from knitstudy.mechanics.beams.beam import BeamState, LinearSprings
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.assembly import Assembly, Batch
from knitstudy.mechanics.core.batches import share
from knitstudy.mechanics.core.model import Memoryless, Response
from knitstudy.mechanics.core.rotation import exp, hat

if TYPE_CHECKING:  # networks without contact import none of it
    from knitstudy.mechanics.beams.beam_contact import BeamContact

# Force over the force that rounding of places makes in elements, up to which a network counts as unloaded
UNLOADED = 5e6
# Beams that a thread evaluates at a time: their matrices stay in memory that the next ones use again
BATCH = 4096


class BeamModel(Memoryless):
    """Beam elements and springs between nodes, or between points that nodes carry along."""

    block = 6

    def __init__(
        self,
        nodes: Floats,  # (N, 3), reference positions [m]
        ends: Ints,  # (E, 2), the nodes that the two ends of every element belong to
        section: beam.SectionLaw,  # stiffness of the elements
        radius: float,  # length that makes rotations comparable with displacements [m]
        # (E, 2, 3), from the node to the element's end, in the reference [m]; none if left out
        offsets: Floats | None = None,
        # whether the offsets are rigid arms that turn with their node. Arms that only follow its translation
        # give all ends at a node equal displacements and rotations, at the price of a couple: see `couples`
        arms_turn: bool = True,
        # springs between nodes, or between points that they carry in the same way; none if left out
        springs: LinearSprings | None = None,
        contact: BeamContact | None = None,  # of stations on rigid arms
        natural: Floats | float = 0.0,  # (E, 3), curvature of the beams free of stress, see `beam` [1/m]
    ) -> None:
        self.nodes = np.asarray(nodes, dtype=float)
        self.springs = springs or LinearSprings.none()
        self.beams = len(ends)
        # Beams first, then springs: both are pairs of points.
        self.ends = np.concatenate([ends, self.springs.ends])
        beam_offsets = np.zeros((self.beams, 2, 3)) if offsets is None else offsets
        self.offsets = np.concatenate([beam_offsets, self.springs.offsets])
        self.arms_turn, self.contact = arms_turn, contact
        self._evaluated = lru_cache(maxsize=1)(self._evaluate)  # the tangent needs what forces have needed
        points = self.nodes[self.ends] + self.offsets
        self.apart = points[:, 1] - points[:, 0]
        self.elements = beam.BeamElements.between(self.apart[: self.beams], section, natural)
        self.size = self.block * len(self.nodes)
        self.length = float(np.mean(self.elements.length))
        self.radius = float(radius)
        self.scale = np.tile(np.repeat([1.0, self.radius], 3), len(self.nodes))
        # Where nothing resists yet, rounding is no measure of a residual.
        axis = self.elements.axis
        along = np.einsum("ei,eij,ej->e", axis, self.elements.law[:, :3, :3], axis)
        rounding = np.finfo(float).eps * np.ptp(self.nodes, axis=0).max() / self.length
        self._least_force = UNLOADED * rounding * float(along.mean())
        groups = [ends, self.springs.ends] if len(self.springs.ends) else [ends]
        self._assembly = Assembly(groups, len(self.nodes), block=self.block, pairs=4 * BATCH)
        armed = np.any(self.offsets, axis=(1, 2))
        self._armed = [np.flatnonzero(armed[first : first + batch.count]) for batch, first in self._batches()]

    def start(self) -> BeamState:
        """Return the reference state."""
        state = BeamState(self.nodes.copy(), np.tile(np.eye(3), (len(self.nodes), 1, 1)))
        return state if self.contact is None else replace(state, contact=self.contact.start(state))

    def name_of(self, unknown: int) -> str:
        """Return what an unknown is, in words."""
        node, component = divmod(unknown, self.block)
        place = ", ".join(f"{x:.3g}" for x in self.nodes[node])
        return f"node {node} at ({place}) m, {'turning about' if component > 2 else 'along'} {'xyz'[component % 3]}"

    def advance(self, state: BeamState, step: Floats) -> BeamState:
        """Return the state a step (size,) further: translations [m] and spins [rad] from the left."""
        step = np.asarray(step).reshape(-1, 2, 3)
        rotation = exp(step[:, 1]) @ state.rotation
        return replace(state, position=state.position + step[:, 0], rotation=rotation)

    def motion_of_neighbours(self, state: BeamState, step: Floats) -> float:
        """Return the largest motion against each other of points of yarns that are near each other [m].

        A step (size,) moves large knits by many diameters, but yarns that are near each other by little. Where nothing
        touches, it is the largest motion of all.
        """
        if self.contact is None:
            return float(np.abs(step * self.scale).max())
        return self.contact.motion(state, self.advance(state, step))

    def commit(self, state: BeamState) -> BeamState:
        """Return the state that a converged increment leaves."""
        return state if self.contact is None else replace(state, contact=self.contact.commit(state))

    def respond(self, state: BeamState, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state."""
        arm, chord, now, at_ends = self._evaluated(state)
        at_nodes = at_ends.copy()
        if self.arms_turn:
            at_nodes[:, 1::2] += np.cross(arm, at_ends[:, 0::2])
        pull = at_ends[self.beams :, 2]
        stretch = (chord - self.apart)[self.beams :]
        stored = sum(beam.energy(*each).sum() for each in now) + 0.5 * np.vdot(pull, stretch)
        # Forces, and moments over the radius: in pure bending there are no forces to measure a residual against.
        lever = np.array([1.0, self.radius, 1.0, self.radius])[:, None]
        magnitude = np.linalg.norm(at_ends[: self.beams] / lever, axis=2)
        response = Response(
            force=self._assembly.sum_forces([at_nodes]),
            mean_force=max(float(magnitude.mean()), self._least_force),
            energy={"internal": float(stored)},
            stiffness=self._tangent(now, at_ends, arm) if stiffness else None,
        )
        return response if self.contact is None else self.contact.added(response, state)

    def carried(self, state: BeamState, node: Ints, offset: Floats) -> Floats:
        """Return the positions (k, 3) [m] of points that nodes (k,) carry at reference offsets (k, 3) [m]."""
        if self.arms_turn:
            offset = np.einsum("kij,kj->ki", state.rotation[node], offset)
        return state.position[node] + offset

    def couples(self, state: BeamState) -> Floats:
        """Return the moments (N, 3) [N m] that joints take from the network and give to no node.

        With arms that only follow, ends that a node joins across a distance, with forces F at offsets o from it
        and equal displacements and rotations, leave the sum of o x F out of the node's balance of moments. A
        spring with force f at its second point and -f at its first leaves out r x -f with the way r from first to
        second; half of it is put down to either node.
        """
        left = np.zeros((len(self.nodes), 3))
        arm, chord, _, at_ends = self._evaluate(state)
        if not self.arms_turn:
            couple = np.cross(arm, at_ends[:, 0::2])[: self.beams]
            np.add.at(left, self.ends[: self.beams], couple)
        couple = np.cross(chord, at_ends[:, 0])[self.beams :]
        np.add.at(left, self.springs.ends, 0.5 * couple[:, None])
        return left

    def _evaluate(
        self, state: BeamState
    ) -> tuple[Floats, Floats, list[tuple[beam.BeamElements, beam.Deformation]], Floats]:
        """Return current arms, ways from end to end, beams with their deformation, and the forces at all ends.

        Arms are (E + K, 2, 3), ways (E + K, 3), forces and moments (E + K, 4, 3): of beams, then of springs. There are
        as many beams at a time as in the batches of the assembly.
        """
        arm = self.offsets
        if self.arms_turn:
            arm = np.einsum("eaij,eaj->eai", state.rotation[self.ends], arm)
        first, second = np.swapaxes(state.position[self.ends] + arm, 0, 1)
        chord = second - first
        pull = self.springs.at_points((chord - self.apart)[self.beams :])
        parts = [batch.part for batch in self._assembly.batches if not batch.group]

        def deformed(number: int) -> tuple[beam.BeamElements, beam.Deformation]:
            part = parts[number]
            elements = self.elements[part]
            turned = state.rotation[self.ends[part]].swapaxes(0, 1)
            return elements, beam.deform(elements, chord[part], turned[0], turned[1], state.released)

        now = share(deformed, len(parts))
        return arm, chord, now, np.concatenate([*(beam.force(each) for _, each in now), pull])

    def _tangent(
        self, now: list[tuple[beam.BeamElements, beam.Deformation]], at_ends: Floats, arm: Floats
    ) -> sp.spmatrix:
        """Return the tangent of beams and springs, from their forces at all ends and the arms there."""
        total = self._assembly.begin_stiffness()
        batches = self._batches()

        def put(number: int) -> None:
            batch, first = batches[number]
            if batch.group:
                matrices = self.springs[batch.part].stiffness_at_points()
            else:
                matrices = beam.stiffness(*now[number])
            if self.arms_turn:
                armed = self._armed[number]
                end = first + armed
                matrices[armed] = _about_nodes(matrices[armed], at_ends[end], arm[end])
            total.put(number, matrices.reshape(-1, 2, 6, 2, 6).swapaxes(2, 3).reshape(-1, 4, 36))

        share(put, len(batches))
        return self._assembly.matrix(total)

    def _batches(self) -> list[tuple[Batch, int]]:
        """Return the batches of beams (group 0) and springs (group 1), and the first of `ends` of each."""
        return [(batch, batch.part.start + self.beams * batch.group) for batch in self._assembly.batches]


def _about_nodes(stiffness: Floats, force: Floats, arm: Floats) -> Floats:
    """Return the stiffness (E, 12, 12) over the motion of nodes that carry the ends by rigid arms (E, 2, 3).

    The end forces (E, 4, 3), F and M, act on the node as F and M + r x F with the current arm r.
    """
    lever = hat(arm)  # (E, 2, 3, 3)
    # A spin w of the node moves the end by w x r, and turns the force: d(r x F) = (w x r) x F = F^ r^ w.
    motion = np.tile(np.eye(12), (len(arm), 1, 1))
    motion[:, 0:3, 3:6], motion[:, 6:9, 9:12] = -lever[:, 0], -lever[:, 1]
    turning = hat(force[:, 0::2]) @ lever
    at_nodes = np.swapaxes(motion, 1, 2) @ stiffness @ motion
    at_nodes[:, 3:6, 3:6] += turning[:, 0]
    at_nodes[:, 9:12, 9:12] += turning[:, 1]
    return at_nodes
