"""A mechanical model as a solver sees it: a residual and a tangent; constraints and viscous forces."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.rotation import hat


@dataclass(frozen=True)
class Response:
    """Internal force of a state, with its tangent if that was asked for."""

    force: Floats  # (size,), internal force conjugate to the unknowns [N, and N m for spins]
    # mean magnitude of the nodal forces of the single elements [N]; residuals are measured against it
    mean_force: float
    energy: dict[str, float] = field(default_factory=dict)  # stored energies by form [J], from potentials
    # (size, size), derivative of `force` with respect to a step of the unknowns
    stiffness: sp.spmatrix | sp.sparray | None = None
    # (N, 3), internal force at all nodes of solids, tied ones included [N]: there the tie supplies it
    node_force: Floats | None = None
    # (size, size), addition to `stiffness` by friction and the turning of contact surfaces: without it the rest is
    # symmetric and as positive as the solids. None where the whole stiffness is
    unsymmetric: sp.bsr_matrix | None = None
    # nodes of the unknowns that contact acts on; empty without contact
    touching: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    # (n, 3), how far the nodes of the unknowns are from where they were undeformed [m]: with a tangent of solids
    moved: Floats | None = None
    # which contact points touch, stick and slip: an increment has converged when that changes no more
    status: Ints | None = None
    # sum of the magnitudes of the viscous forces on all nodes, of stabilisation or drag [N]
    viscous_force: float = 0.0
    pulled: bool = False  # whether the first guess of an increment that begins here is to balance `force`
    assembly_seconds: float = 0.0  # part of the evaluation's time that summing up took

    @property
    def tangent(self) -> sp.bsr_matrix | sp.csr_matrix:
        """The stiffness of a response that was asked for with it."""
        assert self.stiffness is not None, "this response was asked for without its stiffness"
        return self.stiffness

    def same_status(self, other: Response) -> bool:
        """Return whether contact points have the same status in both."""
        if self.status is None or other.status is None:
            return self.status is other.status
        return np.array_equal(self.status, other.status)


def summed(one: dict[str, float], other: dict[str, float]) -> dict[str, float]:
    """Return the energies of both by form [J].

    Examples
    --------
    >>> summed({"elastic": 1.0}, {"elastic": 2.0, "contact": 0.5})["elastic"]
    3.0
    """
    return {form: one.get(form, 0.0) + other.get(form, 0.0) for form in one | other}


class Memoryless:
    """Steps between increments of a `Model` whose response depends on its unknowns alone."""

    def begin(self, state: Any, load: float, change: float) -> Any:
        """Return the state in which an increment starts."""
        return state

    def settle(self, state: Any) -> Any | None:
        """Return None: a balanced state is a converged one."""
        return None

    def commit(self, state: Any) -> Any:
        """Return the state that a converged increment leaves."""
        return state


class Model(Protocol):
    """Solids, beams, joints or contact, as a solver sees them."""

    # A model may name an unknown for messages, by `name_of(unknown: int) -> str`.
    block: int  # unknowns a node: 3 for solids, 6 for beams (three translations, three of the spin)
    size: int  # number of unknowns
    # (size,), ``step * scale`` is a displacement [m] and ``force / scale`` a force [N]: 1 for translations, a
    # length for rotations
    scale: np.ndarray
    length: float  # element size h [m], the measure of a correction

    def start(self) -> Any:
        """Return the undeformed state."""

    def advance(self, state: Any, step: Floats) -> Any:
        """Return a new state, a step (size,) further along a straight line; spins act from the left.

        The tangent of that state may depend on the step, which helps Newton's method. The tangent of a state from
        `begin` is the derivative of the force.
        """

    def begin(self, state: Any, load: float, change: float) -> Any:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""

    def respond(self, state: Any, stiffness: bool) -> Response:
        """Return force, energies and, if asked, the tangent of a state; earlier calls do not change it."""

    def settle(self, state: Any) -> Any | None:
        """Return None if a balanced state is acceptable, or the state to balance again.

        Raises ConvergenceError if the state is unacceptable and cannot be improved.
        """

    def commit(self, state: Any) -> Any:
        """Return the state that a converged increment leaves: its history is up to date."""


# Constraints by elimination: prescribed unknowns in the matrix, and linear ties between nodes


def eliminate(
    matrix: sp.bsr_matrix | sp.csr_matrix,  # (size, size), of structurally symmetric pattern
    fixed: Ints,  # (k,), prescribed unknowns
    diagonal: float | None = None,  # value of their diagonal entries; by default the mean stiffness
) -> None:
    """Set the rows and columns of prescribed unknowns to zero, in place, and their diagonal entries to a value.

    The matrix keeps its pattern and its symmetry, and with the mean stiffness its conditioning; a zero right-hand side
    gives a zero step.

    Examples
    --------
    >>> matrix = sp.bsr_matrix(np.full((2, 2), 3.0), blocksize=(1, 1))
    >>> eliminate(matrix, np.array([0]))
    >>> matrix.toarray().tolist()
    [[3.0, 0.0], [0.0, 3.0]]
    """
    block = matrix.blocksize[0] if matrix.format == "bsr" else 1
    level = float(np.mean(np.abs(matrix.diagonal()))) if diagonal is None else diagonal
    keep = np.ones(matrix.shape[0], dtype=bool)
    keep[fixed] = False
    keep = keep.reshape(-1, block)
    touched = np.any(~keep, axis=1)
    row = np.repeat(np.arange(len(touched), dtype=np.int32), np.diff(matrix.indptr))
    entries = np.flatnonzero(touched[row] | touched[matrix.indices])
    row = row[entries]
    column = matrix.indices[entries]
    data = matrix.data.reshape(-1, block, block)
    i = np.arange(block)
    data[entries] *= keep[row][:, :, None] & keep[column][:, None, :]
    same = row == column
    data[entries[same][:, None], i, i] += level * ~keep[row[same]]


def transformation(
    # (N, N), rows of the identity for retained nodes, weights of retained nodes for all others
    dependence: sp.sparray | sp.spmatrix,
) -> tuple[sp.csr_matrix, np.ndarray]:
    """Return T (N, n), every node as a weighted sum of the retained ones, and these (n,), ascending.

    Examples
    --------
    >>> T, retained = transformation(sp.csr_matrix([[1.0, 0.0, 0.0], [0.5, 0.0, 0.5], [0.0, 0.0, 1.0]]))
    >>> retained.tolist(), T.toarray()[1].tolist()  # the middle one hangs between its neighbours
    ([0, 2], [0.5, 0.5])
    """
    dependence = sp.csr_matrix(dependence)
    retained = np.unique(dependence.indices[dependence.data != 0])
    return sp.csr_matrix(dependence[:, retained]), retained


def rigid_motions(
    position: Floats,  # (n, 3), nodes [m]
    unity: Floats,  # (n,), what the constant 1 has at the nodes: 1 where they are places, else coefficients
    group: Ints,  # (n,), group of every node, 0 to g - 1
) -> Floats:
    """Return the rigid motions (n, 3, 6) of groups of nodes: translations, and rotations about the group's centre.

    Rotations are over the mean radius of gyration. A node that is a coefficient of anything but the constant stays
    where it is in translations.

    Examples
    --------
    >>> ends = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> rigid_motions(ends, np.ones(2), np.zeros(2, dtype=int))[1, 1, 5].tolist()  # along y, about z
    1.0
    """
    count = np.bincount(group, unity**2)
    weighted = unity[:, None] * position
    centre = np.stack([np.bincount(group, weighted[:, i]) / count for i in range(3)], axis=1)
    arm = position - unity[:, None] * centre[group]
    motions = np.zeros((len(group), 3, 6))
    motions[:, [0, 1, 2], [0, 1, 2]] = unity[:, None]
    motions[:, :, 3:] = -hat(arm / np.sqrt(np.sum(arm**2) / count.sum()))
    return motions


# Viscous forces against rigid motions of what nothing holds yet, as in Abaqus/Standard's static stabilisation:
# F = c M (du/dt), M the lumped mass of unit density, time the load factor, c falling to zero at full load.


@dataclass(frozen=True, eq=False)
class Stabilisation:
    """Viscous forces on all unknowns."""

    coefficient: np.ndarray  # (size,) c M at the start [N/m a unit of the load factor]

    @classmethod
    def of(cls, share: float, youngs_modulus: float, length: float, volume: np.ndarray) -> Stabilisation:
        """Return the forces with c = share E / h^2: h [m] the element size, volume (n,) of every node [m3]."""
        return cls(np.repeat(share * youngs_modulus / length**2 * volume, 3))

    def stiffness(self, load: float, change: float) -> Floats:
        """Return the diagonal stiffness (size,) [N/m] within an increment of the load factor to `load`."""
        return self.coefficient * max(1.0 - load, 0.0) / change


# A yarn that only contact holds has drag: a stiffness against its displacement since the increment began. The drag is
# large at first, so that contacts close; it is then reduced to `FADED`, and the state is balanced again.

DRAG = 1e-4  # at first, over E V / h^2, V the volume of a node
# Drag in the end: a loop of 50 radii with elements of R / 3 resists by a hundred EI / L^3, 40,000 times as much. With
# a tenth of this share, rounding moves yarns that do not touch yet.
FADED = 1e-7
