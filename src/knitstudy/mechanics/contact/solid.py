"""Solids as a model: elements of one material, contact between their surfaces, dependent nodes eliminated, u = T v.

A node carries an unknown vector: it is a point, or a coefficient; places are weighted sums of coefficients.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.contact.friction import ContactHistory, FrictionPoints
from knitstudy.mechanics.contact.interaction import Contact, ContactResponse
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.assembly import Assembly
from knitstudy.mechanics.core.batches import SCRATCH, Reserve, share, threads
from knitstudy.mechanics.core.model import FADED, Response, Stabilisation, summed
from knitstudy.mechanics.core.pattern_sum import PatternSum
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.solids.elements import ElementGroup

# Cauchy stress, and the scalars that are drawn of it


def cauchy_stress(gradient: Floats, material: Material, axes: np.ndarray | None = None) -> Floats:
    """Return the Cauchy stress (k, 3, 3) [Pa], F S F^T / det F, of deformation gradients F (k, 3, 3).

    `axes` (k, 3, 3) are local axes in columns, the first along the yarn, where the material asks for them.

    Examples
    --------
    >>> from knitstudy.mechanics.materials.isotropic import Hencky
    >>> stretched = np.diag([1.01, 1.0, 1.0])[None]
    >>> float(round(cauchy_stress(stretched, Hencky(1e8, 0.0))[0, 0, 0]))  # E ln(1.01) / 1.01 [Pa]
    985181.0
    """
    green = 0.5 * (np.swapaxes(gradient, 1, 2) @ gradient - np.eye(3))
    stress = material.respond(green, False, axes).stress
    return gradient @ stress @ np.swapaxes(gradient, 1, 2) / np.linalg.det(gradient)[:, None, None]


def von_mises(stress: Floats) -> Floats:
    """Return sqrt(3/2 s : s) (k,) of the deviators s of stresses (k, 3, 3).

    Examples
    --------
    >>> von_mises(np.diag([3.0, 0.0, 0.0])[None]).tolist()  # of tension
    [3.0]
    """
    mean = np.einsum("kii->k", stress) / 3
    deviator = stress - mean[:, None, None] * np.eye(3)
    return np.sqrt(1.5 * np.einsum("kij,kij->k", deviator, deviator))


def principal_axes(stress: Floats) -> tuple[Floats, Floats]:
    """Return the principal values (..., 3) of stresses (..., 3, 3), the largest first, and their axes as rows.

    Axes are lines: their sign means nothing.

    Examples
    --------
    >>> principal_axes(np.diag([1.0, 3.0, 2.0]))[0].tolist()
    [3.0, 2.0, 1.0]
    """
    values, columns = np.linalg.eigh(stress)
    return values[..., ::-1], np.swapaxes(columns, -1, -2)[..., ::-1, :]


# Solids as a model

UNLOADED = 1e-9  # mean force over E h^2 below which solids count as unloaded


@dataclass(frozen=True)
class Memory:
    """History of solids at the last converged increment."""

    displacement: Floats  # (n, 3), of the retained nodes [m]
    damped: float = 0.0  # work that viscous forces have taken so far [J]
    contact: ContactHistory | None = None


@dataclass(frozen=True)
class SolidState:
    """Displacement of the retained nodes, and their history."""

    displacement: Floats  # (n, 3), of the retained nodes [m]
    memory: Memory | None = None  # with contact and viscous forces
    load: float = 0.0  # load factor that the running increment ends at
    change: float = 1.0  # its size
    augmentations: int = 0  # updates of the contact multipliers within the running increment
    led: float = 1.0  # share of the drag on free bodies: 1, then `FADED`
    # (n, 3), straight step to it from where a tangent was formed [m]; None where there was no such step
    step: Floats | None = field(default=None, kw_only=True)
    pulled: bool = False  # whether surfaces that have not touched yet are pulled together

    @property
    def past(self) -> Memory:
        """The history of a state that a model has made."""
        assert self.memory is not None, "this state was made by hand, without a history"
        return self.memory

    @property
    def contact_history(self) -> ContactHistory:
        """The history of contact of a state that a model with contact has made."""
        assert self.past.contact is not None, "this state is of a model without contact"
        return self.past.contact


@dataclass(frozen=True)
class Penetration:
    """Limits of penetration: the largest allowed [m], and how often multipliers may be updated.

    ``remedy`` says which key to change where that is not enough.
    """

    limit: float = np.inf
    augmentations: int = 0
    remedy: str = "Use a stiffer contact, or allow more updates"


class SolidModel:
    """Elements in equilibrium, whose surfaces may be in contact."""

    block = 3

    def __init__(
        self,
        nodes: Floats,  # (N, 3), undeformed, adjusted to the ties [m]
        groups: Sequence[ElementGroup],  # all of one material
        length: float,  # element size h [m]
        # (N, n), T of nodes that depend on others; see `assembly`
        transformation: sp.csr_matrix | None = None,
        stabilisation: Stabilisation | None = None,
        # (N, N), positive semidefinite stiffness between nodes, the same for every component [N/m]; its energy
        # counts as energy of a penalty
        links: sp.csr_matrix | None = None,
        contact: Contact | None = None,  # between surfaces of the nodes
        penetration: Penetration = Penetration(),  # of that contact
        # (N,), stiffness against the way within an increment of nodes that nothing but contact can hold [N/m]
        drag: Floats | None = None,
    ) -> None:
        self.nodes = nodes
        self.groups = tuple(groups)
        self.links = links
        self.transformation, self.stabilisation = transformation, stabilisation
        self.contact, self.penetration = contact, penetration
        connectivity = [group.connectivity for group in self.groups]
        self.assembly = Assembly(connectivity, len(nodes), transformation, links=links)
        self.size = 3 * self.assembly.retained
        if drag is not None:  # forces at tied nodes go to the nodes that they hang on
            drag = np.repeat(drag if transformation is None else transformation.T @ drag, 3)
        self.drag = drag  # (size,)
        self.scale = np.ones(self.size)
        self.length = length
        # Where nothing resists yet, rounding is no measure of a residual.
        self._least_force = UNLOADED * self.groups[0].elements.material.youngs_modulus * length**2
        self._ties: sp.bsr_matrix | None = None  # (3 N, 3 n), T of every component
        if transformation is not None:
            weights = transformation.data[:, None, None] * np.eye(3)
            pattern = transformation.indices, transformation.indptr
            self._ties = sp.bsr_matrix((weights, *pattern), shape=(nodes.size, self.size))
        # Further blocks of the tangent, for contact; memory that is not written to costs nothing.
        self._room = self.assembly.entries // 2 if contact else 0
        self._sum: PatternSum | None = None
        self._reserve = contact.reserve if contact else Reserve()  # of tangents
        self._evaluated: tuple[SolidState, FrictionPoints] | None = None

    def start(self) -> SolidState:
        """Return the undeformed state."""
        rest = np.zeros((self.assembly.retained, 3))
        return SolidState(rest, Memory(rest, contact=ContactHistory.empty() if self.contact else None))

    def begin(self, state: SolidState, load: float, change: float) -> SolidState:
        """Return the state in which an increment of the load factor by `change` to `load` starts.

        Before anything has touched, its tangent has surfaces pulled together: without contact the first step would take
        loops that hang loose through each other.
        """
        pulled = self.contact is not None and state.step is None and not len(state.contact_history.point)
        return replace(state, load=load, change=change, step=None, augmentations=0, led=1.0, pulled=pulled)

    def advance(self, state: SolidState, step: Floats) -> SolidState:
        """Return the state displaced by `step` (size,) [m]."""
        way = step.reshape(-1, 3)
        return replace(state, displacement=state.displacement + way, step=way, pulled=False)

    def motion_of_neighbours(self, state: SolidState, step: Floats) -> float:
        """Return the largest motion against each other of sections of yarns that are near each other [m].

        Where nothing touches, it is the largest motion of all.
        """
        if self.contact is None:
            return float(np.abs(step * self.scale).max())
        return self.contact.motion(self._places(state)[0], self._places(self.advance(state, step))[0])

    def node_displacement(self, state: SolidState) -> Floats:
        """Return the displacement (N, 3) of all nodes [m], tied ones included."""
        return self._spread(state.displacement)

    def contact_points(self, state: SolidState) -> FrictionPoints:
        """Return all pairs of points and surfaces that are near each other."""
        assert self.contact is not None, "this model has no contact"
        if self._evaluated is None or self._evaluated[0] is not state:
            points = self.contact.points(*self._places(state), state.contact_history, state.pulled)
            self._evaluated = state, points
        return self._evaluated[1]

    def respond(self, state: SolidState, stiffness: bool) -> Response:
        """Return internal force, energies and, if asked, the tangent."""
        # Contact's tangent takes more room while it is formed than afterwards: it comes before that of the elements.
        touch = None if self.contact is None else self.contact.forces(self.contact_points(state), stiffness)
        response = self._with_viscosity(self._solids(state, stiffness), state)
        return response if touch is None else self._with_contact(response, touch, state.pulled)

    def loaded(self, response: Response) -> bool:
        """Return whether forces are more than rounding."""
        return response.mean_force > 100 * self._least_force

    def settle(self, state: SolidState) -> SolidState | None:
        """Return None if nothing penetrates too far, or the state with updated multipliers, or with faded drag.

        Raises ConvergenceError if the penetration is too large and the updates allowed are used up.
        """
        if self.contact is None:
            return None
        if self.drag is not None and state.led > FADED:
            return replace(state, led=FADED)
        points = self.contact_points(state)
        deepest = -self.contact.smallest_gap(points)
        limit = self.penetration.limit
        if deepest <= limit:
            return None
        if state.augmentations == self.penetration.augmentations:
            raise ConvergenceError(
                f"surfaces penetrate each other by {deepest:.3g}; allowed is {limit:.3g} "
                f"({deepest / self.length:.2%} and {limit / self.length:.2%} of the element size), "
                f"after {state.augmentations} updates of the contact pressure. {self.penetration.remedy}"
            )
        memory = replace(state.past, contact=self.contact.augment(points))
        return replace(state, memory=memory, augmentations=state.augmentations + 1)

    def commit(self, state: SolidState) -> SolidState:
        """Return the state that a converged increment leaves: slip history, and work of viscous forces."""
        self._reserve.give_back()
        contact = None if self.contact is None else self.contact.commit(self.contact_points(state))
        return replace(state, step=None, memory=Memory(state.displacement, self._damped(state), contact))

    def _spread(self, displacement: Floats) -> Floats:
        return displacement if self.transformation is None else self.transformation @ displacement

    def _places(self, state: SolidState) -> tuple[Floats, Floats]:
        """Return where all nodes (N, 3) are and were at the last converged increment [m]."""
        return (
            self.nodes + self._spread(state.displacement),
            self.nodes + self._spread(state.past.displacement),
        )

    def _viscosity(self, state: SolidState) -> Floats | None:
        """Return the diagonal stiffness (size,) against motion within the increment [N/m]; None if there is none."""
        if self.drag is not None:
            return state.led * self.drag
        if self.stabilisation is not None:
            return self.stabilisation.stiffness(state.load, state.change)
        return None

    def _damped(self, state: SolidState) -> float:
        """Return the work that viscous forces have taken up to a state [J]."""
        viscosity = self._viscosity(state)
        before = state.past
        if viscosity is None:
            return before.damped
        return before.damped + float(viscosity @ (state.displacement - before.displacement).ravel() ** 2)

    def _with_viscosity(self, response: Response, state: SolidState) -> Response:
        viscosity = self._viscosity(state)
        stiffness = response.stiffness
        if viscosity is None:
            return response
        pull = viscosity * (state.displacement - state.past.displacement).ravel()
        if stiffness is not None:
            # Not in place: nodes of images in a periodic cell are in no element, and have no block in the pattern.
            stiffness = sp.bsr_matrix(stiffness + sp.diags(viscosity).tobsr((3, 3)))
        return replace(
            response,
            force=response.force + pull,
            viscous_force=float(np.linalg.norm(pull.reshape(-1, 3), axis=1).sum()),
            energy=response.energy | {"stabilisation": self._damped(state)},
            stiffness=stiffness,
        )

    def _with_contact(self, response: Response, touch: ContactResponse, pulled: bool) -> Response:
        response = replace(
            response,
            force=response.force + self.assembly.collect(touch.node_force),
            energy=summed(response.energy, touch.energy),
            status=touch.points.signature(),
            pulled=pulled,
        )
        if touch.stiffness is None:
            return response
        tangents = [matrix for matrix in (touch.stiffness, touch.symmetric) if matrix is not None]
        if self._ties is not None:
            tangents = [self._ties.T @ matrix @ self._ties for matrix in tangents]
            for matrix in tangents:
                matrix.sort_indices()
        full, *symmetric = tangents
        if self._sum is None or not self._sum.fits(response.tangent, full):
            self._sum = PatternSum(response.tangent, full)
            self._room = max(self._room, 2 * self._sum.inserted)  # patterns grow as yarns close
        for part in symmetric:
            np.subtract(full.data, part.data, out=part.data)
        return replace(
            response,
            stiffness=self._sum.add(response.tangent, full),
            unsymmetric=next(iter(symmetric), None),
            touching=np.flatnonzero(np.diff(full.indptr)),
        )

    def _solids(self, state: SolidState, stiffness: bool) -> Response:
        """Evaluate all batches of elements; threads share them, and sums are formed in one fixed order."""
        displacement = self.node_displacement(state)
        way = self._spread(state.step) if stiffness and state.step is not None else None
        batches = self.assembly.batches
        force = [np.empty((*group.connectivity.shape, 3)) for group in self.groups]
        # Internal energies, and energies of hourglass control.
        energies = [np.empty((2, len(group.connectivity))) for group in self.groups]
        total = self.assembly.begin_stiffness(self._room, self._reserve) if stiffness else None
        magnitude, summing = np.zeros(len(batches)), np.zeros(len(batches))

        def evaluate(number: int) -> None:
            batch = batches[number]
            group = self.groups[batch.group]
            part = batch.part
            width = group.connectivity.shape[1]
            blocks = SCRATCH.array("stiffness", batch.count, width**2, 9) if stiffness else None
            nodes = group.connectivity[part]
            step = None if way is None else way[nodes]
            answer = group.elements.respond(part, displacement[nodes], stiffness, blocks, step)
            force[batch.group][part] = answer.force
            energies[batch.group][:, part] = answer.internal, answer.hourglass
            magnitude[number] = np.sqrt(np.einsum("eai,eai->ea", answer.force, answer.force)).sum()
            if total is not None:
                started = time.perf_counter()
                total.put(number, answer.tangent)
                summing[number] = time.perf_counter() - started

        share(evaluate, len(batches))
        started = time.perf_counter()
        matrix = None if total is None else self.assembly.matrix(total)
        internal, hourglass = np.sum([energy.sum(axis=1) for energy in energies], axis=0).tolist()
        energy = {"internal": internal, "hourglass": hourglass}
        mean = magnitude.sum() / sum(group.connectivity.size for group in self.groups)
        node_force = self.assembly.node_forces(force)
        pull = 0.0
        if self.links is not None:
            pull = self.links @ displacement
            energy["penalty"] = 0.5 * float(np.vdot(pull, displacement))
        return Response(
            force=self.assembly.collect(node_force + pull),
            node_force=node_force,
            mean_force=max(mean, self._least_force),
            energy=energy,
            stiffness=matrix,
            moved=state.displacement if stiffness else None,
            # Threads sum up side by side: their mean counts.
            assembly_seconds=summing.sum() / min(threads(), len(batches)) + time.perf_counter() - started,
        )
