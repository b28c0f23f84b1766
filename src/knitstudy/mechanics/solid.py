"""Solids as a model: hexahedra of one material, tied nodes eliminated, surfaces in contact."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.assembly import Assembly
from knitstudy.mechanics.contact.history import ContactHistory
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.points import ContactPoints
from knitstudy.mechanics.elements import Hexahedron
from knitstudy.mechanics.free_bodies import FreeBodies
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.parallel import share, threads
from knitstudy.mechanics.scratch import SCRATCH
from knitstudy.mechanics.stabilisation import Stabilisation

UNLOADED = 1e-9
"""Mean force over E h^2 below which solids count as unloaded."""


@dataclass(frozen=True)
class Memory:
    """What solids in contact remember of the last converged increment.

    Attributes
    ----------
    displacement : ndarray, shape (n, 3)
        Of the kept nodes [m].
    contact : ContactHistory
    damped : float
        Work that stabilisation has taken so far [J].
    """

    displacement: np.ndarray
    contact: ContactHistory
    damped: float = 0.0


@dataclass(frozen=True)
class SolidState:
    """Displacement (n, 3) of the kept nodes [m]; with contact or stabilisation, what came before.

    Attributes
    ----------
    displacement : ndarray, shape (n, 3)
    memory : Memory or None
    load, change : float
        Load factor that the running increment ends at, and its size.
    augmentations : int
        Updates of the contact multipliers within the running increment.
    led : bool
        Whether a drag leads free bodies to their first contact: not any more where contact holds them.
    """

    displacement: np.ndarray
    memory: Memory | None = None
    load: float = 0.0
    change: float = 1.0
    augmentations: int = 0
    led: bool = True


@dataclass(frozen=True)
class Penetration:
    """What is done about penetration: the largest allowed [m], and how often multipliers may be updated."""

    limit: float = np.inf
    augmentations: int = 0


class SolidModel:
    """Hexahedra in equilibrium, u = T v.

    Parameters
    ----------
    nodes : ndarray, shape (N, 3)
        Undeformed nodes, adjusted to the ties [m].
    hexahedra : ndarray of int, shape (E, 8)
        Elements in VTK order.
    elements : Hexahedron
        The batch that answers for them.
    dependence : csr matrix, shape (N, n), optional
        T of the ties; see `knitstudy.mechanics.assembly`.
    length : float
        Element size h [m].
    contact : Contact, optional
        Between surfaces of the nodes.
    penetration : Penetration
        Of that contact.
    stabilisation : Stabilisation, optional
    free_bodies : FreeBodies, optional
        What nothing but that contact can hold; none of its nodes is tied.
    """

    block = 3

    def __init__(
        self,
        nodes: np.ndarray,
        hexahedra: np.ndarray,
        elements: Hexahedron,
        length: float,
        dependence: sp.csr_matrix | None = None,
        contact: Contact | None = None,
        penetration: Penetration = Penetration(),
        stabilisation: Stabilisation | None = None,
        free_bodies: FreeBodies | None = None,
    ) -> None:
        self.nodes, self.hexahedra, self.elements = nodes, hexahedra, elements
        self.dependence = dependence
        self.contact, self.penetration, self.stabilisation = contact, penetration, stabilisation
        self.free_bodies = free_bodies
        self.assembly = Assembly(hexahedra, len(nodes), dependence)
        self.size = 3 * self.assembly.kept
        self.scale = np.ones(self.size)
        self.length = length
        # Where nothing resists yet, rounding is no measure of a residual.
        self._least_force = UNLOADED * elements.material.youngs_modulus * length**2
        self._evaluated: tuple[SolidState, ContactPoints] | None = None

    def start(self) -> SolidState:
        """Return the undeformed state."""
        rest = np.zeros((self.assembly.kept, 3))
        if self.contact is None and self.stabilisation is None:
            return SolidState(rest)
        return SolidState(rest, Memory(rest, ContactHistory.empty()))

    def begin(self, state: SolidState, load: float, change: float) -> SolidState:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""
        return replace(state, load=load, change=change, augmentations=0, led=True)

    def advance(self, state: SolidState, step: np.ndarray) -> SolidState:
        """Return the state displaced by `step` (size,) [m]."""
        return replace(state, displacement=state.displacement + step.reshape(-1, 3))

    def node_displacement(self, state: SolidState) -> np.ndarray:
        """Return the displacement (N, 3) of all nodes [m], tied ones included."""
        return self._spread(state.displacement)

    def contact_points(self, state: SolidState) -> ContactPoints:
        """Return all pairs of points and surfaces that are near each other."""
        if self._evaluated is None or self._evaluated[0] is not state:
            self._evaluated = state, self.contact.points(*self._places(state), state.memory.contact)
        return self._evaluated[1]

    def respond(self, state: SolidState, stiffness: bool) -> Response:
        """Return internal force, energies and, if asked, the tangent."""
        answer = self._gather(state, stiffness)
        started = time.perf_counter()
        node_force = self.assembly.node_forces(answer.force)
        response = Response(
            force=self.assembly.collect(node_force),
            node_force=node_force,
            mean_force=max(float(np.mean(np.linalg.norm(answer.force, axis=2))), self._least_force),
            energy={"internal": float(answer.internal.sum()), "hourglass": float(answer.hourglass.sum())},
            stiffness=answer.stiffness,
        )
        summing = answer.assembly_seconds + time.perf_counter() - started
        if self.contact is not None:
            response = self._with_contact(response, state, stiffness)
        if self.stabilisation is not None or self.free_bodies is not None:
            response = self._with_drag(response, state)
        return replace(response, assembly_seconds=summing)

    def loaded(self, response: Response) -> bool:
        """Return whether forces are more than rounding."""
        return response.mean_force > 100 * self._least_force

    def settle(self, state: SolidState) -> SolidState | None:
        """Return None if nothing penetrates too far, or the state with updated multipliers, or without drag.

        Raises
        ------
        ConvergenceError
            If the penetration is too large and the updates allowed are used up.
        """
        if self.contact is None:
            return None
        points = self.contact_points(state)
        if self.free_bodies is not None and state.led and self._held(state, points):
            return replace(state, led=False)
        deepest = -self.contact.smallest_gap(points)
        if deepest <= self.penetration.limit:
            return None
        if state.augmentations == self.penetration.augmentations:
            raise ConvergenceError(
                f"yarns penetrate each other by {deepest:.3g} m; allowed is {self.penetration.limit:.3g} m "
                f"({deepest / self.length:.2%} and {self.penetration.limit / self.length:.2%} of the element size), "
                f"after {state.augmentations} updates of the contact pressure. Use a larger "
                "contact.normal_stiffness or contact.augmentations"
            )
        memory = replace(state.memory, contact=self.contact.augment(points))
        return replace(state, memory=memory, augmentations=state.augmentations + 1)

    def commit(self, state: SolidState) -> SolidState:
        """Return the state that a converged increment leaves: slip history, and work of stabilisation."""
        if state.memory is None:
            return state
        history = state.memory.contact
        if self.contact is not None:
            history = self.contact.commit(self.contact_points(state))
        return replace(state, memory=Memory(state.displacement, history, self._damped(state)))

    def _held(self, state: SolidState, points: ContactPoints) -> bool:
        """Return whether contact alone holds the bodies that nothing else does."""
        stiffness = self.contact.forces(points, stiffness=True).symmetric
        return self.free_bodies.held(stiffness, self._places(state)[0])

    def _spread(self, displacement: np.ndarray) -> np.ndarray:
        return displacement if self.dependence is None else self.dependence @ displacement

    def _places(self, state: SolidState) -> tuple[np.ndarray, np.ndarray]:
        """Return where all nodes (N, 3) are and were at the last converged increment [m]."""
        return (
            self.nodes + self._spread(state.displacement),
            self.nodes + self._spread(state.memory.displacement),
        )

    def _with_contact(self, response: Response, state: SolidState, stiffness: bool) -> Response:
        touch = self.contact.forces(self.contact_points(state), stiffness)
        response = replace(
            response,
            force=response.force + self.assembly.collect(touch.node_force),
            energy=response.energy | touch.energy,
            status=touch.points.signature(),
        )
        if not stiffness:
            return response
        full = self._collected(touch.stiffness)
        return replace(
            response,
            stiffness=sp.bsr_matrix(response.stiffness + full),
            unsymmetric=full - self._collected(touch.symmetric),
            touching=np.flatnonzero(np.diff(full.indptr)),
        )

    def _collected(self, matrix: sp.bsr_matrix) -> sp.bsr_matrix:
        """Return T^T K T (3 n, 3 n) of a matrix over all nodes that has few entries."""
        if self.dependence is None:
            return matrix
        spread = sp.kron(self.dependence, sp.identity(3), format="csr")
        return sp.bsr_matrix(spread.T @ matrix.tocsr() @ spread, blocksize=(3, 3))

    def _drag(self, state: SolidState) -> np.ndarray:
        """Return the diagonal stiffness (size,) against what moves within the increment [N/m]."""
        drag = np.zeros(self.size)
        if self.stabilisation is not None:
            drag += self.stabilisation.stiffness(state.load, state.change)
        if self.free_bodies is not None and state.led:
            drag += np.repeat(self._collected_nodes(self.free_bodies.drag()), 3)
        return drag

    def _collected_nodes(self, values: np.ndarray) -> np.ndarray:
        """Return what the nodes (N,) have at the kept ones (n,), tied ones going to those that they hang on."""
        return values if self.dependence is None else self.dependence.T @ values

    def _with_drag(self, response: Response, state: SolidState) -> Response:
        drag = self._drag(state)
        moved = (state.displacement - state.memory.displacement).ravel()
        stiffness = response.stiffness
        if stiffness is not None:
            diagonal = np.zeros((len(drag) // 3, 3, 3))
            diagonal[:, [0, 1, 2], [0, 1, 2]] = drag.reshape(-1, 3)
            node = np.arange(len(diagonal) + 1)
            stiffness = sp.bsr_matrix(
                stiffness + sp.bsr_matrix((diagonal, node[:-1], node), shape=stiffness.shape)
            )
        return replace(
            response,
            force=response.force + drag * moved,
            viscous_force=float(np.linalg.norm((drag * moved).reshape(-1, 3), axis=1).sum()),
            energy=response.energy | {"stabilisation": self._damped(state)},
            stiffness=stiffness,
        )

    def _damped(self, state: SolidState) -> float:
        """Return the work that viscous forces have taken up to a state [J]."""
        if self.stabilisation is None and self.free_bodies is None:
            return 0.0
        drag = self._drag(state)
        moved = (state.displacement - state.memory.displacement).ravel()
        return state.memory.damped + float(drag @ moved**2)

    def _gather(self, state: SolidState, stiffness: bool) -> _Gathered:
        """Evaluate all batches; threads share them, and sums are formed in one fixed order."""
        displacement = self.node_displacement(state)
        count, batches = len(self.hexahedra), self.assembly.batches
        force = np.empty((count, 8, 3))
        internal, hourglass = np.empty(count), np.empty(count)
        total = self.assembly.begin_stiffness() if stiffness else None
        summing = np.zeros(len(batches))

        def evaluate(number: int) -> None:
            batch = batches[number]
            blocks = SCRATCH.array("stiffness", batch.stop - batch.start, 64, 9) if stiffness else None
            answer = self.elements.respond(batch, displacement[self.hexahedra[batch]], stiffness, blocks)
            force[batch], internal[batch], hourglass[batch] = answer.force, answer.internal, answer.hourglass
            if stiffness:
                started = time.perf_counter()
                total.put(number, answer.stiffness)
                summing[number] = time.perf_counter() - started

        share(evaluate, len(batches))
        started = time.perf_counter()
        matrix = self.assembly.matrix(total) if stiffness else None
        # Threads sum up side by side: their mean counts.
        seconds = summing.sum() / min(threads(), len(batches)) + time.perf_counter() - started
        return _Gathered(force, internal, hourglass, matrix, seconds)


@dataclass(frozen=True)
class _Gathered:
    force: np.ndarray  # (E, 8, 3)
    internal: np.ndarray  # (E,)
    hourglass: np.ndarray  # (E,)
    stiffness: sp.bsr_matrix | None
    assembly_seconds: float
