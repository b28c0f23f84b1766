"""Stability of a balanced state: the sign of its tangent, and the motion in which it gives way.

A state in which all forces vanish is a minimum of the energy if the tangent is positive definite (theorem of Lagrange
and Dirichlet), and a saddle from which the structure goes somewhere else if it is not. Factors L D L^T without pivoting
have as many negative pivots as the matrix has negative eigenvalues (Sylvester's law of inertia), so that one
factorisation decides; Lanczos's method on its inverse finds the eigenvalues next to zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from knitstudy.mechanics.core.arrays import Bools, Floats
from knitstudy.mechanics.core.linear import factorise

SMALL = 60  # unknowns up to which all eigenvalues are computed


@dataclass(frozen=True, eq=False)
class Mode:
    """The lowest eigenvalue of a tangent over scaled unknowns, and its mode."""

    stiffness: float  # [N/m]
    motion: Floats  # (size,), change of the unknowns; the largest displacement is 1

    @property
    def unstable(self) -> bool:
        """Whether the state gives way in this mode."""
        return self.stiffness < 0


def lowest_mode(
    stiffness: sp.spmatrix,  # (size, size), the tangent
    scale: Floats,  # (size,), what turns unknowns into displacements: 1, or lengths for rotations
    free: Bools,  # (size,), unknowns that are not held
    neutral: Floats | None = None,  # (size, k), motions that cost nothing
) -> Mode:
    """Return the lowest mode of the symmetric part of a tangent, but for neutral motions.

    Raises ConvergenceError if the tangent is singular.

    Examples
    --------
    >>> mode = lowest_mode(sp.diags([2.0, -1.0, 3.0]), scale=np.ones(3), free=np.full(3, True))
    >>> mode.stiffness, mode.unstable, np.abs(mode.motion).tolist()
    (-1.0, True, [0.0, 1.0, 0.0])
    >>> lowest_mode(sp.diags([2.0, -1.0, 3.0]), np.ones(3), np.full(3, True), neutral=np.eye(3)[:, [1]]).stiffness
    2.0
    """
    unit = sp.diags(1 / scale[free])
    motions = np.empty((np.count_nonzero(free), 0)) if neutral is None else (neutral * scale[:, None])[free]
    values, vectors = lowest_eigenvalue(unit @ sp.csr_matrix(stiffness)[free][:, free] @ unit, motions)
    motion = np.zeros(len(scale))
    motion[free] = vectors / scale[free]
    return Mode(values, motion / np.abs(vectors).max())


def lowest_eigenvalue(matrix: sp.spmatrix, neutral: Floats) -> tuple[float, Floats]:
    """Return the lowest eigenvalue of the Hermitian part of a matrix (n, n), and its vector (n,).

    Springs along neutral motions N (n, k), with the stiffness c of the stiffest unknown, K + c N N^T, are a border of
    K: factors of [K, N; N^T, -1/c] have a negative pivot for each of them.
    """
    hermitian = sp.csc_matrix(0.5 * (matrix + matrix.conj().T))
    n = hermitian.shape[0]
    begin = np.random.default_rng(0).standard_normal(n).astype(hermitian.dtype)
    motions = neutral / np.linalg.norm(neutral, axis=0)
    spring = float(np.abs(hermitian.diagonal()).max())
    if n <= SMALL:
        values, vectors = np.linalg.eigh(hermitian.toarray() + spring * motions @ motions.conj().T)
        return float(values[0]), _directed(vectors[:, 0], begin)
    count = motions.shape[1]
    border = sp.csc_matrix(motions)
    bordered = sp.bmat(
        [[hermitian, border], [border.conj().T, -sp.identity(count) / spring]] if count else [[hermitian]]
    )
    factors = factorise(bordered)
    negative = int(np.count_nonzero(factors.U.diagonal().real < 0)) - count

    def solve(force: Floats) -> Floats:
        return factors.solve(np.append(force, np.zeros(count, dtype=force.dtype)))[:n]

    inverse = spla.LinearOperator((n, n), matvec=solve, dtype=hermitian.dtype)
    # Of the inverse, all negative eigenvalues or the largest one
    wanted, which = (min(negative, n - 2), "SA") if negative > 0 else (1, "LA")
    if np.iscomplexobj(hermitian.data):
        which = {"SA": "SR", "LA": "LR"}[which]
    inverted, vectors = spla.eigsh(inverse, k=wanted, which=which, v0=begin)
    lowest = int(np.argmin(1 / inverted))
    return float(1 / inverted[lowest]), _directed(vectors[:, lowest], begin)


def _directed(vector: Floats, ahead: Floats) -> Floats:
    """Return an eigenvector with the sign, which is arbitrary, of its part along another vector."""
    return vector if np.vdot(ahead, vector).real >= 0 else -vector
