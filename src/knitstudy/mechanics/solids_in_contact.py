"""Solids in contact: what contact between their surfaces adds to the model of solids."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.contact.friction import ContactHistory, ContactPoints
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.model import FADED, FreeBodies, Response, summed
from knitstudy.mechanics.solid import Memory, SolidModel, SolidState
from knitstudy.mechanics.sparse_sums import PatternSum


@dataclass(frozen=True)
class ContactMemory(Memory):
    """What solids in contact remember of the last converged increment besides."""

    contact: ContactHistory | None = None


@dataclass(frozen=True)
class ContactState(SolidState):
    """State of solids in contact."""

    memory: ContactMemory | None = None
    augmentations: int = 0  # updates of the contact multipliers within the running increment
    led: float = 1.0  # share of the drag on free bodies: 1, `FADED`, or 0 where contact holds them


@dataclass(frozen=True)
class Penetration:
    """What is done about penetration: the largest allowed [m], and how often multipliers may be updated.

    ``remedy`` says what to change where that does not do.
    """

    limit: float = np.inf
    augmentations: int = 0
    remedy: str = "Use a stiffer contact, or allow more updates"


class SolidsInContact(SolidModel):
    """Solids whose surfaces are in contact.

    Parameters
    ----------
    *solids
        As of `SolidModel`.
    contact : Contact
        Between surfaces of the nodes.
    penetration : Penetration
        Of that contact.
    free_bodies : FreeBodies, optional
        What nothing but that contact can hold; none of its nodes is tied.
    **options
        As of `SolidModel`.
    """

    def __init__(
        self,
        *solids,
        contact: Contact,
        penetration: Penetration = Penetration(),
        free_bodies: FreeBodies | None = None,
        **options,
    ) -> None:
        super().__init__(*solids, **options)
        self.contact, self.penetration, self.free_bodies = contact, penetration, free_bodies
        self._ties: sp.bsr_matrix | None = None  # (3 N, 3 n), T of every component
        if self.transformation is not None:
            weights = self.transformation.data[:, None, None] * np.eye(3)
            pattern = self.transformation.indices, self.transformation.indptr
            self._ties = sp.bsr_matrix((weights, *pattern), shape=(self.nodes.size, self.size))
        self._sum: PatternSum | None = None
        self._evaluated: tuple[ContactState, ContactPoints] | None = None

    def start(self) -> ContactState:
        """Return the undeformed state."""
        rest = np.zeros((self.assembly.retained, 3))
        return ContactState(rest, ContactMemory(rest, contact=ContactHistory.empty()))

    def begin(self, state: ContactState, load: float, change: float) -> ContactState:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""
        return replace(super().begin(state, load, change), augmentations=0, led=1.0)

    def contact_points(self, state: ContactState) -> ContactPoints:
        """Return all pairs of points and surfaces that are near each other."""
        if self._evaluated is None or self._evaluated[0] is not state:
            self._evaluated = state, self.contact.points(*self._places(state), state.memory.contact)
        return self._evaluated[1]

    def respond(self, state: ContactState, stiffness: bool) -> Response:
        """Return internal force, energies and, if asked, the tangent."""
        return self._with_contact(super().respond(state, stiffness), state, stiffness)

    def settle(self, state: ContactState) -> ContactState | None:
        """Return None if nothing penetrates too far, or the state with updated multipliers, or without drag.

        Raises ConvergenceError if the penetration is too large and the updates allowed are used up.
        """
        points = self.contact_points(state)
        if self.free_bodies is not None and state.led:
            if self._held(state, points):
                return replace(state, led=0.0)
            if state.led > FADED:
                return replace(state, led=FADED)
        deepest = -self.contact.smallest_gap(points)
        if deepest <= self.penetration.limit:
            return None
        if state.augmentations == self.penetration.augmentations:
            raise ConvergenceError(
                f"surfaces penetrate each other by {deepest:.3g}; allowed is {self.penetration.limit:.3g} "
                f"({deepest / self.length:.2%} and {self.penetration.limit / self.length:.2%} of the element size), "
                f"after {state.augmentations} updates of the contact pressure. {self.penetration.remedy}"
            )
        memory = replace(state.memory, contact=self.contact.augment(points))
        return replace(state, memory=memory, augmentations=state.augmentations + 1)

    def commit(self, state: ContactState) -> ContactState:
        """Return the state that a converged increment leaves: slip history, and work of viscous forces."""
        history = self.contact.commit(self.contact_points(state))
        return replace(state, memory=ContactMemory(state.displacement, self._damped(state), history))

    def _held(self, state: ContactState, points: ContactPoints) -> bool:
        """Return whether contact alone holds the bodies that nothing else does."""
        stiffness = self.contact.forces(points, stiffness=True).symmetric
        return self.free_bodies.held(stiffness, self._places(state)[0])

    def _places(self, state: ContactState) -> tuple[np.ndarray, np.ndarray]:
        """Return where all nodes (N, 3) are and were at the last converged increment [m]."""
        return (
            self.nodes + self._spread(state.displacement),
            self.nodes + self._spread(state.memory.displacement),
        )

    def _with_contact(self, response: Response, state: ContactState, stiffness: bool) -> Response:
        touch = self.contact.forces(self.contact_points(state), stiffness)
        response = replace(
            response,
            force=response.force + self.assembly.collect(touch.node_force),
            energy=summed(response.energy, touch.energy),
            status=touch.points.signature(),
        )
        if not stiffness:
            return response
        full, symmetric = touch.stiffness, touch.symmetric
        if self._ties is not None:
            full, symmetric = (self._ties.T @ matrix @ self._ties for matrix in (full, symmetric))
            full.sort_indices(), symmetric.sort_indices()
        if self._sum is None or not self._sum.fits(response.stiffness, full):
            self._sum = PatternSum(response.stiffness, full)
            self._room = max(self._room, 2 * self._sum.inserted)  # patterns grow as yarns close
        unsymmetric = (full.data - symmetric.data, full.indices, full.indptr)
        return replace(
            response,
            stiffness=self._sum.add(response.stiffness, full),
            unsymmetric=sp.bsr_matrix(unsymmetric, shape=full.shape),
            touching=np.flatnonzero(np.diff(full.indptr)),
        )

    def _drag(self, state: ContactState) -> np.ndarray | None:
        drag = super()._drag(state)
        if self.free_bodies is None:
            return drag
        at_nodes = self.free_bodies.drag()
        if self.transformation is not None:  # what tied nodes have goes to those that they hang on
            at_nodes = self.transformation.T @ at_nodes
        leading = state.led * np.repeat(at_nodes, 3)
        return leading if drag is None else drag + leading
