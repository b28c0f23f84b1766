"""What a mechanical model gives to a solver: a residual and a tangent, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class Response:
    """Internal force of a state, with its tangent if that was asked for.

    Attributes
    ----------
    force : ndarray, shape (size,)
        Internal force conjugate to the unknowns [N, and N m for spins].
    mean_force : float
        Mean magnitude of the nodal forces of the single elements [N]; what a residual is measured against.
    energy : dict of str to float
        Stored energies by form [J], from potentials.
    stiffness : sparse matrix, shape (size, size), or None
        Derivative of `force` with respect to a step of the unknowns.
    node_force : ndarray, shape (N, 3), or None
        Internal force at all nodes of solids, tied ones included [N]: there it is what the tie supplies.
    unsymmetric : bsr matrix, shape (size, size), or None
        What friction and the turning of contact surfaces add to `stiffness`: without it the rest is symmetric and
        as positive as the solids. None where the whole stiffness is.
    touching : ndarray of int
        Nodes of the unknowns that contact acts on; empty without contact.
    moved : ndarray, shape (n, 3), or None
        How far the nodes of the unknowns are from where they were undeformed [m]: with a tangent of solids.
    viscous_force : float
        Sum of the magnitudes of the viscous forces of stabilisation on all nodes [N].
    status : ndarray or None
        Which contact points touch, stick and slip: an increment has converged when that changes no more.
    assembly_seconds : float
        Part of the evaluation's time that summing up took.
    """

    force: np.ndarray
    mean_force: float
    energy: dict[str, float] = field(default_factory=dict)
    stiffness: sp.spmatrix | sp.sparray | None = None
    node_force: np.ndarray | None = None
    unsymmetric: sp.bsr_matrix | None = None
    touching: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    moved: np.ndarray | None = None
    status: np.ndarray | None = None
    viscous_force: float = 0.0
    assembly_seconds: float = 0.0

    def same_status(self, other: Response) -> bool:
        """Return whether contact points have the same status in both."""
        if self.status is None or other.status is None:
            return self.status is other.status
        return np.array_equal(self.status, other.status)


class Memoryless:
    """The part of a `Model` whose response depends on its unknowns alone."""

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
    """Solids, beams, joints or contact, as a solver sees them.

    Attributes
    ----------
    block : int
        Unknowns a node: 3 for solids, 6 for beams (three translations, three of the spin).
    size : int
        Number of unknowns.
    scale : ndarray, shape (size,)
        ``step * scale`` is a displacement [m] and ``force / scale`` a force [N]: 1 for translations, a length
        for rotations.
    length : float
        Element size h [m], the measure of a correction.
    """

    block: int
    size: int
    scale: np.ndarray
    length: float

    def start(self) -> Any:
        """Return the undeformed state."""
        ...

    def advance(self, state: Any, step: np.ndarray) -> Any:
        """Return a new state, a step (size,) further along a straight line; spins act from the left.

        The tangent there may know of the step, and be the better for Newton's method. Of a state that `begin` has
        returned it is the derivative of the force.
        """
        ...

    def begin(self, state: Any, load: float, change: float) -> Any:
        """Return the state in which an increment of the load factor by `change` to `load` starts."""
        ...

    def respond(self, state: Any, stiffness: bool) -> Response:
        """Return force, energies and, if asked, the tangent of a state; no answer depends on earlier calls."""
        ...

    def settle(self, state: Any) -> Any | None:
        """Return None if a balanced state is acceptable, or the state to balance anew.

        Raises
        ------
        ConvergenceError
            If it is not, and nothing will help.
        """
        ...

    def commit(self, state: Any) -> Any:
        """Return the state that a converged increment leaves: what is remembered is up to date."""
        ...
