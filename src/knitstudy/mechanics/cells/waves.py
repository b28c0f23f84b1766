"""Waves over several cells of an endless structure, in which it may give way (Bloch's theorem).

Cells at lattice positions R move alike but for a phase, u_R = exp(i q . R) u_0. The tangent against such a wave has
the size of one cell,

    K(q) = sum over R of K_R exp(i q . R),

where K_R u are forces on one cell by a motion u of the cell at R. Where K(q) is positive for all q, no motion of any
number of cells lowers the energy. Waves of q = 0 are motions of all cells alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.cells.tiling import Tiling
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.stability import lowest_eigenvalue

PARTS = (0.0, 1 / 2, 1 / 3, 1 / 4, -1 / 4, -1 / 3)  # of a wave that a cell is long


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
                lowest_eigenvalue(
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
