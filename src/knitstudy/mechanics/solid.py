"""Solids as a model: elements of one material, dependent nodes eliminated; Cauchy stress."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.assembly import Assembly
from knitstudy.mechanics.batches import SCRATCH, share, threads
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.model import Response, Stabilisation

# Cauchy stress, and the scalars that are drawn of it


def cauchy_stress(gradient: np.ndarray, material: Material, axes: np.ndarray | None = None) -> np.ndarray:
    """Return the Cauchy stress (k, 3, 3) [Pa], F S F^T / det F, of deformation gradients F (k, 3, 3).

    `axes` (k, 3, 3) are local axes in columns, the first along the yarn, where the material asks for them.
    """
    green = 0.5 * (np.swapaxes(gradient, 1, 2) @ gradient - np.eye(3))
    stress = material.respond(green, False, axes).stress
    return gradient @ stress @ np.swapaxes(gradient, 1, 2) / np.linalg.det(gradient)[:, None, None]


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return sqrt(3/2 s : s) (k,) of the deviators s of stresses (k, 3, 3)."""
    mean = np.einsum("kii->k", stress) / 3
    deviator = stress - mean[:, None, None] * np.eye(3)
    return np.sqrt(1.5 * np.einsum("kij,kij->k", deviator, deviator))


def principal_stresses(stress: np.ndarray) -> np.ndarray:
    """Return the principal values (k, 3) of stresses (k, 3, 3), the largest first."""
    return np.linalg.eigvalsh(stress)[:, ::-1]


def principal_axes(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal values (..., 3) of stresses (..., 3, 3), the largest first, and their axes as rows.

    Axes are lines: their sign means nothing.
    """
    values, columns = np.linalg.eigh(stress)
    return values[..., ::-1], np.swapaxes(columns, -1, -2)[..., ::-1, :]


# Solids as a model: elements of one material, dependent nodes eliminated. Contact: `mechanics.solids_in_contact`
# A node is what an unknown vector belongs to: a point, or a coefficient of which places are weighted sums.

UNLOADED = 1e-9  # mean force over E h^2 below which solids count as unloaded


@dataclass(frozen=True)
class Memory:
    """What solids with viscous forces remember of the last converged increment."""

    displacement: np.ndarray  # (n, 3), of the retained nodes [m]
    damped: float = 0.0  # work that viscous forces have taken so far [J]


@dataclass(frozen=True)
class SolidState:
    """Displacement of the retained nodes; with viscous forces, what came before."""

    displacement: np.ndarray  # (n, 3), of the retained nodes [m]
    memory: Memory | None = None
    load: float = 0.0  # load factor that the running increment ends at
    change: float = 1.0  # its size
    # (n, 3), what it came by, straight from where a tangent was formed [m]; None where it came by no such way
    step: np.ndarray | None = field(default=None, kw_only=True)


class SolidModel:
    """Elements in equilibrium, u = T v.

    Parameters
    ----------
    nodes : ndarray, shape (N, 3)
        Undeformed nodes, adjusted to the ties [m].
    groups : sequence of ElementGroup
        All of one material.
    length : float
        Element size h [m].
    transformation : csr matrix, shape (N, n), optional
        T of nodes that depend on others; see `knitstudy.mechanics.assembly`.
    stabilisation : Stabilisation, optional
    links : csr matrix, shape (N, N), optional
        Positive semidefinite stiffness between nodes, the same for every component [N/m]; what it stores counts as
        energy of a penalty.
    """

    block = 3
    _room = 0  # blocks of the tangent that what is added to it needs besides

    def __init__(
        self,
        nodes: np.ndarray,
        groups: Sequence[ElementGroup],
        length: float,
        transformation: sp.csr_matrix | None = None,
        stabilisation: Stabilisation | None = None,
        links: sp.csr_matrix | None = None,
    ) -> None:
        self.nodes, self.groups, self.links = nodes, tuple(groups), links
        self.transformation = transformation
        self.stabilisation = stabilisation
        connectivity = [group.connectivity for group in self.groups]
        self.assembly = Assembly(connectivity, len(nodes), transformation, links=links)
        self.size = 3 * self.assembly.retained
        self.scale = np.ones(self.size)
        self.length = length
        # Where nothing resists yet, rounding is no measure of a residual.
        self._least_force = UNLOADED * self.groups[0].elements.material.youngs_modulus * length**2

    def start(self) -> SolidState:
        """Return the undeformed state."""
        rest = np.zeros((self.assembly.retained, 3))
        return SolidState(rest, Memory(rest) if self.stabilisation else None)

    def begin(self, state: SolidState, load: float, change: float) -> SolidState:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""
        return replace(state, load=load, change=change, step=None)

    def advance(self, state: SolidState, step: np.ndarray) -> SolidState:
        """Return the state displaced by `step` (size,) [m]."""
        way = step.reshape(-1, 3)
        return replace(state, displacement=state.displacement + way, step=way)

    def node_displacement(self, state: SolidState) -> np.ndarray:
        """Return the displacement (N, 3) of all nodes [m], tied ones included."""
        return self._spread(state.displacement)

    def respond(self, state: SolidState, stiffness: bool) -> Response:
        """Return internal force, energies and, if asked, the tangent."""
        answer = self._gather(state, stiffness)
        started = time.perf_counter()
        node_force = self.assembly.node_forces(answer.force)
        force, energy = node_force, {"internal": answer.internal, "hourglass": answer.hourglass}
        if self.links is not None:
            displacement = self.node_displacement(state)
            pull = self.links @ displacement
            force = node_force + pull
            energy["penalty"] = 0.5 * float(np.vdot(pull, displacement))
        response = Response(
            force=self.assembly.collect(force),
            node_force=node_force,
            mean_force=max(answer.mean_force, self._least_force),
            energy=energy,
            stiffness=answer.stiffness,
            moved=state.displacement if stiffness else None,
        )
        summing = answer.assembly_seconds + time.perf_counter() - started
        drag = self._drag(state)
        if drag is not None:
            response = self._with_drag(response, state, drag)
        return replace(response, assembly_seconds=summing)

    def loaded(self, response: Response) -> bool:
        """Return whether forces are more than rounding."""
        return response.mean_force > 100 * self._least_force

    def settle(self, state: SolidState) -> SolidState | None:
        """Return None: a balanced state is a converged one."""
        return None

    def commit(self, state: SolidState) -> SolidState:
        """Return the state that a converged increment leaves: with the work of viscous forces."""
        if state.memory is None:
            return replace(state, step=None)
        return replace(state, step=None, memory=Memory(state.displacement, self._damped(state)))

    def _spread(self, displacement: np.ndarray) -> np.ndarray:
        return displacement if self.transformation is None else self.transformation @ displacement

    def _drag(self, state: SolidState) -> np.ndarray | None:
        """Return the diagonal stiffness (size,) against what moves within the increment [N/m]; None if nothing is."""
        if self.stabilisation is None:
            return None
        return self.stabilisation.stiffness(state.load, state.change)

    def _with_drag(self, response: Response, state: SolidState, drag: np.ndarray) -> Response:
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
        drag = self._drag(state)
        if drag is None:
            return state.memory.damped
        moved = (state.displacement - state.memory.displacement).ravel()
        return state.memory.damped + float(drag @ moved**2)

    def _gather(self, state: SolidState, stiffness: bool) -> _Gathered:
        """Evaluate all batches; threads share them, and sums are formed in one fixed order."""
        displacement = self.node_displacement(state)
        way = self._spread(state.step) if stiffness and state.step is not None else None
        batches = self.assembly.batches
        force = [np.empty((*group.connectivity.shape, 3)) for group in self.groups]
        energy = [
            np.empty((2, len(group.connectivity))) for group in self.groups
        ]  # internal, of hourglass control
        total = self.assembly.begin_stiffness(self._room) if stiffness else None
        magnitude, summing = np.zeros(len(batches)), np.zeros(len(batches))

        def evaluate(number: int) -> None:
            batch = batches[number]
            group, part = self.groups[batch.group], batch.part
            width = group.connectivity.shape[1]
            blocks = SCRATCH.array("stiffness", batch.count, width**2, 9) if stiffness else None
            nodes = group.connectivity[part]
            known = {"step": way[nodes]} if group.mixed and way is not None else {}
            answer = group.elements.respond(part, displacement[nodes], stiffness, blocks, **known)
            force[batch.group][part] = answer.force
            energy[batch.group][:, part] = answer.internal, answer.hourglass
            magnitude[number] = np.sqrt(np.einsum("eai,eai->ea", answer.force, answer.force)).sum()
            if stiffness:
                started = time.perf_counter()
                total.put(number, answer.stiffness)
                summing[number] = time.perf_counter() - started

        share(evaluate, len(batches))
        started = time.perf_counter()
        matrix = self.assembly.matrix(total) if stiffness else None
        # Threads sum up side by side: their mean counts.
        seconds = summing.sum() / min(threads(), len(batches)) + time.perf_counter() - started
        internal, hourglass = np.sum([each.sum(axis=1) for each in energy], axis=0).tolist()
        mean = magnitude.sum() / sum(group.connectivity.size for group in self.groups)
        return _Gathered(force, internal, hourglass, mean, matrix, seconds)


@dataclass(frozen=True)
class _Gathered:
    force: list[np.ndarray]  # (E, a, 3) of every group
    internal: float
    hourglass: float
    mean_force: float  # mean magnitude of the nodal forces of the elements
    stiffness: sp.bsr_matrix | None
    assembly_seconds: float
