"""The endless knit: force between clamps, limit of square knits as they grow, and moduli of the shell.

Between grips an endless knit cannot contract where it is held, and a sheet that is stiffer across than along carries
that far; in between it necks, which turns its sides into the pull. The sheet is homogeneous and hyperelastic, with the
energy over area e M e / 2 of the stretches e = U - 1 (polar decomposition F = R U, shear doubled); elements are total
Lagrangian with nine nodes. docs/notes/periodic_cell.md compares it with knits.

As a shell, N = A e + B k and M = B^T e + D k with the strains of `knitstudy.mechanics.periodic`; the stiffness (6, 6)
is [[A, B], [B^T, D]], in N/m, N and N m (Jones 1999, Mechanics of Composite Materials, chapters 2 and 4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
import xarray as xr
from scipy.sparse.linalg import spsolve

from knitstudy.errors import ConvergenceError
from knitstudy.loading.history import DIRECTIONS
from knitstudy.study.scene import Scene

ELEMENTS = 24  # Elements in either direction: twice as many change the factor of a square knit by 2e-4
ITERATIONS = 20
ACCURACY = 1e-7  # Largest unbalanced force, over the largest one at the grips
STEP = 1e-6  # Step of the difference quotients for the tangent of the law


def held_over_free(
    membrane: np.ndarray, length: float, width: float, strain: float, elements: int = ELEMENTS
) -> float:
    """Return the force of a sheet that grips hold across at both ends, over that in free tension at the same strain.

    The sheet of a length and width [m] has forces per width by strains `membrane` (3, 3) [N/m], the first along the
    pull, the second across, without coupling to shear. The strain is the displacement of the grips over the length;
    there are `elements` in either direction.
    Raises ConvergenceError if Newton's method finds no equilibrium.
    """
    membrane, lines = np.asarray(membrane, dtype=float), 2 * elements + 1
    number = np.arange(lines**2).reshape(lines, lines)  # of the nodes, line by line across
    corner = 2 * np.arange(elements)[:, None] + np.arange(3)
    nodes = number[corner[:, None, :, None], corner[None, :, None, :]].reshape(-1, 9)
    gradient, area = _gauss_points(length / elements, width / elements)
    unknown = (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), 18)
    row, column = (each.ravel() for each in np.broadcast_arrays(unknown[:, :, None], unknown[:, None]))
    grips = 2 * np.concatenate([number[0], number[-1]])
    free = np.setdiff1d(np.arange(2 * number.size), [grips, grips + 1])
    grid = np.meshgrid(np.linspace(0, length, lines), np.linspace(0, width, lines), indexing="ij")
    place = np.stack(grid, axis=-1).reshape(-1, 2) * [1 + strain, 1]
    for _ in range(ITERATIONS):
        deformation = np.einsum("eni,gnj->egij", place[nodes], gradient)
        with np.errstate(divide="ignore", invalid="ignore"):  # refused below
            stress, tangent = _law(deformation, membrane)
        parts = np.einsum("g,egij,gnj->eni", area, stress, gradient)
        force = np.bincount(unknown.ravel(), parts.ravel(), place.size)
        if not np.all(np.isfinite(force)):
            break
        if np.abs(force[free]).max() <= ACCURACY * np.abs(force).max():
            (along, coupling), across = membrane[0, :2], membrane[1, 1]
            pull = force[2 * number[-1]].sum() / width
            return float(pull / ((along - coupling**2 / across) * strain))
        blocks = np.einsum("g,egijkl,gnj,gml->enimk", area, tangent, gradient, gradient, optimize=True)
        stiffness = sp.coo_array((blocks.ravel(), (row, column)), shape=(place.size, place.size)).tocsr()
        place.reshape(-1)[free] -= spsolve(stiffness[free][:, free].tocsc(), force[free])
    raise ConvergenceError(
        f"a sheet of {length:.4g} x {width:.4g} m between grips finds no equilibrium at a strain of {strain:g}: its "
        "membrane stiffness may not be positive there"
    )


def _gauss_points(length: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Return gradients (9, 9, 2) of the shapes at the Gauss points of an element, and the area (9,) of each."""
    at, weight = np.polynomial.legendre.leggauss(3)
    shape = np.stack([at * (at - 1) / 2, 1 - at * at, at * (at + 1) / 2])
    slope = np.stack([at - 0.5, -2 * at, at + 0.5])
    gradients = [
        np.einsum("ig,jh->ghij", *pair).reshape(9, 9) / (side / 2)
        for pair, side in (((slope, shape), length), ((shape, slope), width))
    ]
    return np.stack(gradients, axis=-1), np.outer(weight, weight).ravel() * length * width / 4


def _law(deformation: np.ndarray, membrane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives P (..., 2, 2) and (..., 2, 2, 2, 2) of the energy over area by F (..., 2, 2)."""
    steps = STEP * np.eye(4).reshape(4, 2, 2)
    slopes = [
        (_stress(deformation + step, membrane) - _stress(deformation - step, membrane)) / (2 * STEP)
        for step in steps
    ]
    return _stress(deformation, membrane), np.stack(slopes, axis=-1).reshape(*deformation.shape, 2, 2)


def _stress(deformation: np.ndarray, membrane: np.ndarray) -> np.ndarray:
    square = np.einsum("...ki,...kj->...ij", deformation, deformation)[..., [0, 1, 0], [0, 1, 1]]
    strain, derivative = stretches(square)
    by_square = np.einsum("...i,ij,...jk->...k", strain, membrane, derivative)
    symmetric = (by_square * [2, 2, 1])[..., [[0, 2], [2, 1]]]
    return deformation @ symmetric  # P = F S


def stretches(square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return U - 1 as (k, 3), shear doubled, and its derivative (k, 3, 3) by C = U U, each as 11, 22, 12.

    Of two-by-two matrices U = (C + J 1) / t with J = sqrt(det C) and t = tr U (Hoger and Carlson 1984, Quarterly of
    Applied Mathematics 42).
    """
    first, second, mixed = np.moveaxis(square, -1, 0)
    jacobian = np.sqrt(first * second - mixed**2)
    trace = np.sqrt(first + second + 2 * jacobian)[..., None]
    stretch = np.stack([first + jacobian, second + jacobian, 2 * mixed], axis=-1) / trace
    by_jacobian = np.stack([second, first, -2 * mixed], axis=-1) / (2 * jacobian[..., None])
    by_trace = (np.array([1.0, 1.0, 0.0]) + 2 * by_jacobian) / (2 * trace)
    slope = np.array([[1.0, 1.0, 0.0]]).T * by_jacobian[..., None, :] + np.diag([1.0, 1.0, 2.0])
    derivative = (slope - stretch[..., None] * by_trace[..., None, :]) / trace[..., None]
    return stretch - [1.0, 1.0, 0.0], derivative


MOST = 4  # Number of the largest knits through which a limit is sought

# Scene of one cell of the endless knit, free across, by the series of square knits
# (`measures.cost.SERIES`).
CELLS = {
    "domain-yarns-tie-course": "cell-course",
    "domain-yarns-tie-wale": "cell-wale",
}


def limit(cells: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Return the limit of values as knits grow, and its uncertainty from the choice of knits and law.

    Edges are the 1 / n-th part of a knit of n cells in a row, corners the square of that. Of a + b / n through the
    largest two, three and four knits, and a + b / n + c / n^2 through the largest four, the middle of the least and
    the largest a is the limit, half of their distance its uncertainty. Three knits or more, in rising order.
    """
    part, values = 1 / np.asarray(cells, dtype=float)[-MOST:], np.asarray(values, dtype=float)[-MOST:]
    found = [np.polyfit(part[-count:], values[-count:], 1)[1] for count in range(2, len(part) + 1)]
    found.append(np.polyfit(part, values, 2)[2])
    return (min(found) + max(found)) / 2, (max(found) - min(found)) / 2


def between_grips(history: xr.Dataset, scene: Scene, increment: int) -> float:
    """Return the factor by which the force of a cell grows in a large square knit, whose grips hold it across.

    The cell is tied and free across. The stiffness of the sheet is the mean of the cell's along its path: in free
    tension the sheet has the force and the contraction of the cell at that strain.
    """
    axis = DIRECTIONS.index(scene.load.deformation)
    order = [axis, 1 - axis, 2]
    way = history.isel(increment=slice(None, increment + 1))
    strain = way["strain"].to_numpy()
    mean = np.trapezoid(way["tangent_per_width"].to_numpy(), strain, axis=0) / strain[-1]
    membrane = 0.5 * (mean + mean.T)[np.ix_(order, order)]
    sides = np.array([scene.pattern.wale_spacing, scene.pattern.course_spacing])[order[:2]]
    return held_over_free(membrane, *sides, float(strain[-1]))


# Force per width over strain, free of force in all other components, and Poisson's ratios of both pulls.
MODULI = (
    "course modulus at rest [N/m]",
    "wale modulus at rest [N/m]",
    "shear modulus at rest [N/m]",
    "Poisson's ratio of course tension at rest [1]",
    "Poisson's ratio of wale tension at rest [1]",
)


def moduli(membrane: np.ndarray) -> dict[str, float]:
    """Return `MODULI` from forces per width by strains in the plane (3, 3) [N/m]."""
    compliance = np.linalg.inv(membrane)
    along = np.diag(compliance)
    contractions = (-compliance[1, 0] / along[0], -compliance[0, 1] / along[1])
    return dict(zip(MODULI, (*(1 / along), *contractions), strict=True))
