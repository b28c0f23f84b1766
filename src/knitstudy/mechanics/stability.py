"""Stability of a balanced state: the sign of its tangent, and the motion in which it gives way.

A state in which all forces vanish is a minimum of the energy if the tangent is positive definite (theorem of Lagrange
and Dirichlet), and a saddle from which the structure goes somewhere else if it is not. Factors L D L^T without pivoting
have as many negative pivots as the matrix has negative eigenvalues (Sylvester's law of inertia), so that one
factorisation decides; Lanczos's method on its inverse finds the eigenvalues next to zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from knitstudy.mechanics.arrays import Bools, Floats, Ints
from knitstudy.mechanics.linear import factorise
from knitstudy.mechanics.tiling import Tiling

SMALL = 60  # unknowns up to which all eigenvalues are computed
PARTS = (0.0, 1 / 2, 1 / 3, 1 / 4, -1 / 4, -1 / 3)  # of a wave that a cell is long


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
    values, vectors = _lowest(unit @ sp.csr_matrix(stiffness)[free][:, free] @ unit, motions)
    motion = np.zeros(len(scale))
    motion[free] = vectors / scale[free]
    return Mode(values, motion / np.abs(vectors).max())


def _lowest(matrix: sp.spmatrix, neutral: Floats) -> tuple[float, Floats]:
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


# Waves over several cells (Bloch's theorem)
# Cells at lattice positions R move alike but for a phase, u_R = exp(i q . R) u_0. The tangent against such a wave has
# the size of one cell,
#
#     K(q) = sum over R of K_R exp(i q . R),
#
# where K_R u are forces on one cell by a motion u of the cell at R. Where K(q) is positive for all q, no motion of any
# number of cells lowers the energy. Waves of q = 0 are motions of all cells alike.


@dataclass(frozen=True, eq=False)
class Wave:
    """The wave over several cells against which an endless structure is stiff the least."""

    stiffness: float  # [N/m]
    length: Ints  # (2,), cells along both directions after which it repeats itself

    @property
    def unstable(self) -> bool:
        """Whether the structure gives way in this wave."""
        return self.stiffness < 0


class Waves:
    """The tangent of an endless structure against waves, from that of a larger cell around one of its cells."""

    def __init__(
        self,
        stiffness: sp.spmatrix,  # (6 m + .., ..), of a larger cell in which no cell acts on another one by two ways
        scale: Floats,  # (6 n,) of one cell, as of `lowest_mode`
        tiling: Tiling,  # of the n nodes of a cell
        neutral: Floats,  # (6 n, k), motions of yarns along courses that cost nothing where all cells move alike there
    ) -> None:
        self._node = tiling.place
        self._nodes = len(scale) // 6
        middle = tiling.counts // 2
        self._away = tiling.cell - middle
        inner = np.flatnonzero(np.all(self._away == 0, axis=1))  # in the order of the nodes of a cell
        rows = (6 * inner[:, None] + np.arange(6)).ravel()
        self._unit = sp.diags(1 / np.asarray(scale))
        self._neutral = neutral * np.asarray(scale)[:, None]
        self._forces = self._unit @ sp.csr_matrix(stiffness)[rows][:, : 6 * len(self._node)]

    def tangent(self, phase: Floats) -> sp.csr_matrix:
        """Return K(q) (6 n, 6 n) over scaled unknowns, of the phase (2,) from a cell to the next ones."""
        m = len(self._node)
        turned = np.exp(1j * (self._away @ phase)), (np.arange(m), self._node)
        spread = sp.csr_matrix(turned, (m, self._nodes))
        return sp.csr_matrix(self._forces @ sp.kron(spread, sp.identity(6)) @ self._unit)

    def lowest(self) -> Wave:
        """Return the lowest of waves that repeat themselves after up to four cells in both directions.

        Of those in which the structure gives way, the one that needs the fewest cells.
        """
        waves = [
            Wave(
                _lowest(
                    self.tangent(2 * np.pi * np.array(parts)),
                    self._neutral if parts[0] == 0 else self._neutral[:, :0],
                )[0],
                np.array([Fraction(part).limit_denominator(9).denominator for part in parts]),
            )
            for parts in product(PARTS[:4], PARTS)
            if any(parts) and not (parts[0] in (0.0, 0.5) and parts[1] < 0)  # waves that run the other way
        ]
        unstable = [wave for wave in waves if wave.unstable]
        if unstable:
            return min(unstable, key=lambda wave: (wave.length.prod(), wave.stiffness))
        return min(waves, key=lambda wave: wave.stiffness)
