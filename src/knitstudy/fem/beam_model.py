"""A network of beams as a model that a solver can drive: six unknowns a node, rigid arms eliminated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.fem import beam, rigid_arm
from knitstudy.fem.assembly import Assembly
from knitstudy.fem.model import Memoryless, Response
from knitstudy.fem.rotation import exp


@dataclass(frozen=True)
class BeamState:
    """Configuration of N nodes.

    Attributes
    ----------
    position : ndarray, shape (N, 3)
        Positions [m].
    rotation : ndarray, shape (N, 3, 3)
        Rotations from the reference, where they are the identity.
    """

    position: np.ndarray
    rotation: np.ndarray


class BeamModel(Memoryless):
    """Straight beam elements between nodes, or between points that nodes carry along.

    Parameters
    ----------
    nodes : ndarray, shape (N, 3)
        Reference positions [m].
    ends : ndarray of int, shape (E, 2)
        The nodes that the two ends of every element belong to.
    section : Section
        Stiffness of the elements.
    radius : float
        Length that makes rotations comparable with displacements [m].
    offsets : ndarray, shape (E, 2, 3), optional
        From the node to the element's end, in the reference [m]; none if left out.
    arms_turn : bool
        Whether the offsets are rigid arms that turn with their node. Arms that only follow its translation
        give all ends at a node equal displacements and rotations, at the price of a couple: see `couples`.
    """

    block = 6

    def __init__(
        self,
        nodes: np.ndarray,
        ends: np.ndarray,
        section: beam.Section,
        radius: float,
        offsets: np.ndarray | None = None,
        arms_turn: bool = True,
    ) -> None:
        self.nodes = np.asarray(nodes, dtype=float)
        self.ends = np.asarray(ends)
        self.offsets = np.zeros((len(self.ends), 2, 3))
        if offsets is not None:
            self.offsets += offsets
        self.arms_turn = arms_turn
        points = self.nodes[self.ends] + self.offsets
        self.elements = beam.Elements.straight(points[:, 1] - points[:, 0], section)
        self.size = self.block * len(self.nodes)
        self.length = float(np.mean(self.elements.length))
        self.radius = float(radius)
        self.scale = np.tile(np.repeat([1.0, self.radius], 3), len(self.nodes))
        self._assembly = Assembly(self.ends, len(self.nodes), block=self.block, chunk=len(self.ends))

    def start(self) -> BeamState:
        """Return the reference state."""
        return BeamState(self.nodes.copy(), np.tile(np.eye(3), (len(self.nodes), 1, 1)))

    def advance(self, state: BeamState, step: np.ndarray) -> BeamState:
        """Return the state a step (size,) further: translations [m] and spins [rad] from the left."""
        step = np.asarray(step).reshape(-1, 2, 3)
        return BeamState(state.position + step[:, 0], exp(step[:, 1]) @ state.rotation)

    def respond(self, state: BeamState, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state."""
        arm = self._arm(state)
        now = self._deform(state, arm)
        at_ends = beam.force(now)
        at_nodes = rigid_arm.force_at_nodes(at_ends, arm) if self.arms_turn else at_ends
        return Response(
            force=self._assembly.sum_forces(at_nodes),
            mean_force=self._mean(at_ends),
            energy={"internal": float(np.sum(beam.energy(self.elements, now)))},
            stiffness=self._tangent(now, at_ends, arm) if stiffness else None,
        )

    def carried(self, state: BeamState, node: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Return the positions (k, 3) [m] of points that nodes (k,) carry at reference offsets (k, 3) [m]."""
        if self.arms_turn:
            offset = np.einsum("kij,kj->ki", state.rotation[node], offset)
        return state.position[node] + offset

    def couples(self, state: BeamState) -> np.ndarray:
        """Return the moments (N, 3) [N m] that joints take from the network and give to no node.

        Zero with turning arms. Ends that a node joins across a distance, with forces F at offsets o from it
        and equal displacements and rotations, leave the sum of o x F out of the node's balance of moments.
        """
        left = np.zeros((len(self.nodes), 3))
        if not self.arms_turn:
            arm = self._arm(state)
            np.add.at(left, self.ends, np.cross(arm, beam.force(self._deform(state, arm))[:, 0::2]))
        return left

    def _arm(self, state: BeamState) -> np.ndarray:
        """Current offsets (E, 2, 3) of the element ends."""
        if not self.arms_turn:
            return self.offsets
        return np.einsum("eaij,eaj->eai", state.rotation[self.ends], self.offsets)

    def _deform(self, state: BeamState, arm: np.ndarray) -> beam.Deformation:
        points = state.position[self.ends] + arm
        rotation = state.rotation[self.ends]
        return beam.deform(self.elements, points[:, 1] - points[:, 0], rotation[:, 0], rotation[:, 1])

    def _tangent(self, now: beam.Deformation, at_ends: np.ndarray, arm: np.ndarray):
        matrices = beam.stiffness(self.elements, now)
        if self.arms_turn:
            matrices = rigid_arm.stiffness_at_nodes(matrices, at_ends, arm)
        blocks = matrices.reshape(-1, 2, 6, 2, 6).swapaxes(2, 3).reshape(-1, 4, 36)
        data = self._assembly.empty_stiffness()
        self._assembly.add_stiffness(data, 0, blocks)
        return self._assembly.matrix(data)

    def _mean(self, at_ends: np.ndarray) -> float:
        """Mean magnitude [N] of end forces and of end moments over the radius.

        Both count: in pure bending there are no forces to measure a residual against.
        """
        lever = np.array([1.0, self.radius, 1.0, self.radius])[:, None]
        return float(np.mean(np.linalg.norm(at_ends / lever, axis=2)))
