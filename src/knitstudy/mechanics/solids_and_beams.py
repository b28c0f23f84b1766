"""Solids and beams as one model: beam nodes carry sections of the solids through seams."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.model import Response, summed
from knitstudy.mechanics.rotation import hat
from knitstudy.mechanics.solid import SolidModel, SolidState

WIDTHS = 3  # unknowns e of a section [m]: how much wider it is along d_1, along d_2, and sheared in its plane
MOTIONS = 9  # place, spin and widths of a seam, and components of its three coefficients


@dataclass(frozen=True, eq=False)
class Seams:
    """Sections (S,) of solids that nodes of beams carry, without a jump in force.

    A spline yarn ends in a section whose mean place is the coefficient X_0 and whose linear moments are X_1 and X_2,
    half the radius times the directors d_1 and d_2. A node with place x and rotation Q carries them:

        X_0 = x,    X_k = Q (R/2 d_k + sum_l E_kl d_l),    E = [[e_0, e_2], [e_2, e_1]]

    Its widening E in its own plane and all higher coefficients, warping among them, are its own: a rod under tension
    may contract where solid and beam meet. Forces on the section act on the node as the transposed derivative says,

        f_x = f_0,    m = sum_k X_k x f_k,    g_kl = f_k . Q d_l.
    """

    section: np.ndarray  # int (S, 3), nodes of the solids: mean and linear moments of every section
    node: np.ndarray  # int (S,), nodes of the beams
    arms: np.ndarray  # (S, 2, 3), X_1 and X_2 in the reference, of equal length and at right angles [m]

    @property
    def count(self) -> int:
        """Number of seams S."""
        return len(self.node)

    def arms_at(self, rotation: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return X_1 and X_2 (S, 2, 3) [m] of rotations (S, 3, 3) and widths (S, 3) [m]."""
        widened = self.arms + np.einsum("sw,wkl,sli->ski", width, _WIDENING, self._directors)
        return np.einsum("sij,skj->ski", rotation, widened)

    def displacement(
        self,
        position: np.ndarray,  # (S, 3), of the nodes, less where they were [m]
        rotation: np.ndarray,  # (S, 3, 3), of the nodes
        width: np.ndarray,  # (S, 3), e [m]
    ) -> np.ndarray:
        """Return how far the three coefficients (S, 3, 3) are from those of a node at the reference place X_0."""
        moments = self.arms_at(rotation, width) - self.arms
        return np.concatenate([position[:, None], moments], axis=1)

    def derivative(self, rotation: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return the derivative (S, 9, 9) of the coefficients over place, spin and widths."""
        slope = np.zeros((self.count, 3, 3, MOTIONS))
        slope[:, 0, :, :3] = np.eye(3)
        slope[:, 1:, :, 3:6] = -hat(self.arms_at(rotation, width))
        slope[:, 1:, :, 6:] = self._widen(rotation)
        return slope.reshape(-1, MOTIONS, MOTIONS)

    def turning(self, rotation: np.ndarray, width: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the derivative (S, 9, 9) of force, moment and g for fixed forces (S, 3, 3) on the coefficients.

        As of rigid arms it is not symmetric where the moment is not balanced: spins act from the left.
        """
        turn = np.zeros((self.count, MOTIONS, MOTIONS))
        pull = hat(force[:, 1:])  # of X_1 and X_2
        turn[:, 3:6, 3:6] = (pull @ hat(self.arms_at(rotation, width))).sum(axis=1)  # d(X x f) = (w x X) x f
        turn[:, 3:6, 6:] = -(pull @ self._widen(rotation)).sum(axis=1)
        turn[:, 6:, 3:6] = np.swapaxes(turn[:, 3:6, 6:], 1, 2)
        return turn

    @property
    def _directors(self) -> np.ndarray:
        return self.arms / np.linalg.norm(self.arms, axis=2, keepdims=True)

    def _widen(self, rotation: np.ndarray) -> np.ndarray:
        """Derivative (S, 2, 3, 3) of X_1 and X_2 over the widths."""
        return np.einsum("sij,wkl,slj->skiw", rotation, _WIDENING, self._directors)


# E of each of the widths.
_WIDENING = np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]])


@dataclass(frozen=True)
class MixedState:
    """State of solids and beams."""

    solids: SolidState
    beams: BeamState
    width: np.ndarray  # (S, 3), of the seams [m]


class SolidsAndBeams:
    """Solids, and beams whose nodes carry sections of them.

    Unknowns are those of the solids that belong to no seam, the widths of the seams, then those of the beams.
    """

    block = 1  # two kinds of nodes have no common block

    def __init__(
        self,
        solids: SolidModel,  # no node of it depends on others
        beams: BeamModel,
        # every solid node belongs to one at most, and its node stands where the section's mean is
        seams: Seams,
    ) -> None:
        self.solids, self.beams, self.seams = solids, beams, seams
        free = np.ones(solids.size // 3, dtype=bool)
        free[seams.section.ravel()] = False
        self._own = np.flatnonzero(np.repeat(free, 3))
        self.first_width = len(self._own)
        self.first_beam = self.first_width + WIDTHS * seams.count
        self.size = self.first_beam + beams.size
        ones = np.ones(self.first_beam)
        self.scale = np.concatenate([ones, beams.scale])
        self.length = solids.length
        self._at_rest = beams.nodes
        self._rows = (3 * seams.section[:, :, None] + np.arange(3)).reshape(-1, MOTIONS)
        at_node = self.first_beam + 6 * seams.node[:, None] + np.arange(6)
        widths = self.first_width + np.arange(WIDTHS * seams.count).reshape(-1, WIDTHS)
        self._motions = np.concatenate([at_node, widths], axis=1)  # (S, 9)

    def start(self) -> MixedState:
        """Return the undeformed state."""
        return MixedState(self.solids.start(), self.beams.start(), np.zeros((self.seams.count, WIDTHS)))

    def begin(self, state: MixedState, load: float, change: float) -> MixedState:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""
        return replace(
            state,
            solids=self.solids.begin(state.solids, load, change),
            beams=self.beams.begin(state.beams, load, change),
        )

    def advance(self, state: MixedState, step: np.ndarray) -> MixedState:
        """Return the state a step (size,) further; sections go along with their nodes."""
        width = state.width + step[self.first_width : self.first_beam].reshape(-1, WIDTHS)
        moved = replace(state, beams=self.beams.advance(state.beams, step[self.first_beam :]), width=width)
        node, frame = self.seams.node, moved.beams
        carried = self.seams.displacement((frame.position - self._at_rest)[node], frame.rotation[node], width)
        way = np.zeros(self.solids.size)
        way[self._own] = step[: self.first_width]
        way[self._rows] = carried.reshape(-1, MOTIONS) - state.solids.displacement.ravel()[self._rows]
        return replace(moved, solids=self.solids.advance(state.solids, way))

    def respond(self, state: MixedState, stiffness: bool) -> Response:
        """Return internal force, energies and, if asked, the tangent."""
        solids = self.solids.respond(state.solids, stiffness)
        beams = self.beams.respond(state.beams, stiffness)
        slope = self.seams.derivative(state.beams.rotation[self.seams.node], state.width)
        at_sections = solids.force[self._rows]
        force = np.zeros(self.size)
        force[self.first_beam :] = beams.force
        force[: self.first_width] = solids.force[self._own]
        np.add.at(force, self._motions, np.einsum("sru,sr->su", slope, at_sections))
        return Response(
            force=force,
            mean_force=min(solids.mean_force, beams.mean_force),
            energy=summed(solids.energy, beams.energy),
            node_force=solids.node_force,
            stiffness=self._tangent(solids, beams, state, slope, at_sections) if stiffness else None,
            status=_joined(solids.status, beams.status),
            viscous_force=solids.viscous_force,
            pulled=solids.pulled,
            assembly_seconds=solids.assembly_seconds,
        )

    def settle(self, state: MixedState) -> MixedState | None:
        """Return None if the solids accept the state, or the state to balance anew; raises as they do.

        Beams accept every balanced state.
        """
        settled = self.solids.settle(state.solids)
        return None if settled is None else replace(state, solids=settled)

    def commit(self, state: MixedState) -> MixedState:
        """Return the state that a converged increment leaves."""
        return replace(state, solids=self.solids.commit(state.solids), beams=self.beams.commit(state.beams))

    def seam_forces(self, state: MixedState) -> tuple[np.ndarray, np.ndarray]:
        """Return forces [N] and moments [N m] (S, 2, 3) on the nodes of the seams, from the solids and the beams.

        Both are internal forces, what the elements of either side resist: in a balanced state they add up to zero.
        """
        slope = self.seams.derivative(state.beams.rotation[self.seams.node], state.width)
        at_sections = self.solids.respond(state.solids, False).force[self._rows]
        solid = np.einsum("sru,sr->su", slope, at_sections)[:, :6]
        beam = self.beams.respond(state.beams, False).force.reshape(-1, 6)[self.seams.node]
        both = np.stack([solid, beam], axis=1)
        return both[..., :3], both[..., 3:]

    def _tangent(
        self, solids: Response, beams: Response, state: MixedState, slope: np.ndarray, at_sections: np.ndarray
    ) -> sp.csr_matrix:
        rotation = state.beams.rotation[self.seams.node]
        turning = self.seams.turning(rotation, state.width, at_sections.reshape(-1, 3, 3))
        spread = self._spread(slope)
        inner = sp.coo_matrix(spread.T @ sp.csr_matrix(solids.stiffness) @ spread)
        outer, at = sp.coo_matrix(beams.stiffness), self.first_beam
        entries = np.concatenate([inner.data, outer.data, turning.ravel()])
        row = [inner.row, outer.row + at, np.repeat(self._motions, MOTIONS, axis=1).ravel()]
        column = [inner.col, outer.col + at, np.tile(self._motions, MOTIONS).ravel()]
        places = np.concatenate(row), np.concatenate(column)
        # Sums of triplets keep zeros: the pattern stays the same and structurally symmetric.
        return sp.coo_matrix((entries, places), shape=(self.size, self.size)).tocsr()

    def _spread(self, slope: np.ndarray) -> sp.csr_matrix:
        """Return the derivative (3 N, size) of the solids' nodes over all unknowns."""
        rows = np.concatenate([self._own, np.repeat(self._rows, MOTIONS, axis=1).ravel()])
        columns = np.concatenate([np.arange(self.first_width), np.tile(self._motions, MOTIONS).ravel()])
        values = np.concatenate([np.ones(self.first_width), slope.ravel()])
        return sp.coo_matrix((values, (rows, columns)), shape=(self.solids.size, self.size)).tocsr()


def _joined(*statuses: np.ndarray | None) -> np.ndarray | None:
    """Return the status of all contact points; None if there is none."""
    known = [status for status in statuses if status is not None]
    return np.concatenate([np.ravel(status) for status in known]) if known else None
