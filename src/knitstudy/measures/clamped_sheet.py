"""A sheet between grips that hold it across: what they add to its force in free tension.

Between grips an endless knit is not pulled as its cell is: it cannot contract where it is held, and a sheet that is
stiffer across than along carries that far. Linear elasticity of a homogeneous sheet with the same membrane stiffness.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

ELEMENTS = 48
"""Elements of nine nodes in either direction: the factor of a square knit is within 2e-4 of that of twice as many."""


def held_over_free(membrane: np.ndarray, length: float, width: float, elements: int = ELEMENTS) -> float:
    """Return the force of a sheet that grips hold across at both ends, over that of free tension at the same strain.

    Parameters
    ----------
    membrane : (3, 3) array
        Forces per width by strains [N/m], the first along the pull, the second across; shear is not coupled to them, as
        in a sheet that is its own mirror image.
    length, width : float
        Of the sheet, along the pull and across [m].
    elements : int
        In either direction.
    """
    (along, coupling), across = membrane[0, :2], membrane[1, 1]
    shear = membrane[2, 2]
    mass_x, stiff_x, slope_x = _line(length, elements)
    mass_y, stiff_y, slope_y = _line(width, elements)
    # Shapes are products of those of two lines, and so are the integrals over the sheet.
    mixed = coupling * sp.kron(slope_x, slope_y.T) + shear * sp.kron(slope_x.T, slope_y)
    stiffness = sp.block_array(
        [
            [along * sp.kron(stiff_x, mass_y) + shear * sp.kron(mass_x, stiff_y), mixed],
            [mixed.T, across * sp.kron(mass_x, stiff_y) + shear * sp.kron(stiff_x, mass_y)],
        ],
        format="csr",
    )
    count = 2 * elements + 1
    place = np.arange(2 * count**2).reshape(2, count, count)
    driven = place[0, -1]
    held = np.concatenate([place[:, 0].ravel(), place[:, -1].ravel()])
    moved = np.zeros(place.size)
    moved[driven] = length  # a strain of one
    free = np.setdiff1d(place, held)
    moved[free] = spsolve(stiffness[free][:, free].tocsc(), -(stiffness[free] @ moved))
    return (stiffness[driven] @ moved).sum() / (width * (along - coupling**2 / across))


def _line(length: float, elements: int) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
    """Return the integrals of N_i N_j, N_i' N_j' and N_i' N_j over a line of quadratic elements."""
    at, weight = np.polynomial.legendre.leggauss(3)
    shape = np.stack([at * (at - 1) / 2, 1 - at * at, at * (at + 1) / 2])
    slope = np.stack([at - 0.5, -2 * at, at + 0.5])
    half = length / elements / 2
    nodes = 2 * np.arange(elements)[:, None] + np.arange(3)
    row, column = np.repeat(nodes, 3, axis=1).ravel(), np.tile(nodes, 3).ravel()

    def summed(first: np.ndarray, second: np.ndarray, factor: float) -> sp.csr_array:
        block = factor * np.einsum("ig,jg,g->ij", first, second, weight)
        return sp.coo_array((np.tile(block.ravel(), elements), (row, column))).tocsr()

    return summed(shape, shape, half), summed(slope, slope, 1 / half), summed(slope, shape, 1.0)
