"""Solids as a model: hexahedra of one material, with nodes tied to others by elimination."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.fem.assembly import Assembly
from knitstudy.fem.hexahedron import Hexahedron
from knitstudy.fem.model import Response
from knitstudy.fem.parallel import threads


@dataclass(frozen=True)
class SolidState:
    """Displacement (n, 3) of the kept nodes [m]."""

    displacement: np.ndarray


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
        T of the ties; see `knitstudy.fem.assembly`.
    length : float
        Element size h [m].
    """

    block = 3

    def __init__(
        self,
        nodes: np.ndarray,
        hexahedra: np.ndarray,
        elements: Hexahedron,
        length: float,
        dependence: sp.csr_matrix | None = None,
    ) -> None:
        self.nodes, self.hexahedra, self.elements = nodes, hexahedra, elements
        self.dependence = dependence
        self.assembly = Assembly(hexahedra, len(nodes), dependence)
        self.size = 3 * self.assembly.kept
        self.scale = np.ones(self.size)
        self.length = length
        self._threads = threads()

    def start(self) -> SolidState:
        """Return the undeformed state."""
        return SolidState(np.zeros((self.assembly.kept, 3)))

    def advance(self, state: SolidState, step: np.ndarray) -> SolidState:
        """Return the state displaced by `step` (size,) [m]."""
        return SolidState(state.displacement + step.reshape(-1, 3))

    def node_displacement(self, state: SolidState) -> np.ndarray:
        """Return the displacement (N, 3) of all nodes [m], tied ones included."""
        if self.dependence is None:
            return state.displacement
        return self.dependence @ state.displacement

    def respond(self, state: SolidState, stiffness: bool) -> Response:
        """Return internal force, stored energies and, if asked, the tangent."""
        answer = self._gather(state, stiffness)
        started = time.perf_counter()
        node_force = self.assembly.node_forces(answer.force)
        force = self.assembly.collect(node_force)
        return Response(
            force=force,
            node_force=node_force,
            mean_force=float(np.mean(np.linalg.norm(answer.force, axis=2))),
            energy={"internal": float(answer.internal.sum()), "hourglass": float(answer.hourglass.sum())},
            stiffness=None if answer.data is None else self.assembly.matrix(answer.data),
            assembly_seconds=answer.assembly_seconds + time.perf_counter() - started,
        )

    def _gather(self, state: SolidState, stiffness: bool) -> _Gathered:
        """Evaluate all batches; threads share them, and sums are formed in one fixed order."""
        displacement = self.node_displacement(state)
        count = len(self.hexahedra)
        force = np.empty((count, 8, 3))
        internal, hourglass = np.empty(count), np.empty(count)

        def evaluate(batch: slice):
            answer = self.elements.respond(batch, displacement[self.hexahedra[batch]], stiffness)
            force[batch], internal[batch], hourglass[batch] = answer.force, answer.internal, answer.hourglass
            return answer.stiffness

        started = time.perf_counter()
        data = self.assembly.empty_stiffness() if stiffness else None
        summing = time.perf_counter() - started
        batches = self.assembly.batches
        with ThreadPoolExecutor(self._threads) as pool:
            # A window of a few batches keeps the memory of finished ones bounded.
            for first in range(0, len(batches), 2 * self._threads):
                window = batches[first : first + 2 * self._threads]
                for number, blocks in enumerate(pool.map(evaluate, window), start=first):
                    if stiffness:
                        started = time.perf_counter()
                        self.assembly.add_stiffness(data, number, blocks)
                        summing += time.perf_counter() - started
        return _Gathered(force, internal, hourglass, data, summing)


@dataclass(frozen=True)
class _Gathered:
    force: np.ndarray  # (E, 8, 3)
    internal: np.ndarray  # (E,)
    hourglass: np.ndarray  # (E,)
    data: np.ndarray | None  # blocks of the assembled tangent
    assembly_seconds: float
