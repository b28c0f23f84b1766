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
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
import xarray as xr
from scipy.sparse.linalg import spsolve

from knitstudy.errors import ConvergenceError
from knitstudy.loading.history import DIRECTIONS
from knitstudy.study.scene import Scene

ELEMENTS = 24
"""Elements in either direction: twice as many change the factor of a square knit by 2e-4."""

ITERATIONS = 20

ACCURACY = 1e-7
"""Largest unbalanced force, over the largest one at the grips."""

STEP = 1e-6
"""Step of the difference quotients for the tangent of the law."""


def held_over_free(
    membrane: np.ndarray, length: float, width: float, strain: float, elements: int = ELEMENTS
) -> float:
    """Return the force of a sheet that grips hold across at both ends, over that in free tension at the same strain.

    Parameters
    ----------
    membrane : ndarray, shape (3, 3)
        Forces per width by strains M [N/m], the first along the pull, the second across; without coupling to shear.
    length, width : float
        Size of the sheet along the pull and across [m].
    strain : float
        Displacement of the grips over the length.
    elements : int
        Elements in either direction.

    Raises
    ------
    ConvergenceError
        If Newton's method finds no equilibrium.
    """
    sheet = _Sheet(length, width, elements)
    force = sheet.pulled(np.asarray(membrane, dtype=float), strain) / width
    (along, coupling), across = membrane[0, :2], membrane[1, 1]
    return force / ((along - coupling**2 / across) * strain)


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


@dataclass(frozen=True, eq=False)
class _Sheet:
    """Length, width and elements in either direction of a sheet whose first and last line of nodes are gripped."""

    length: float
    width: float
    elements: int

    @cached_property
    def nodes(self) -> np.ndarray:
        """Undeformed places (N, 2) [m], line by line across."""
        count = 2 * self.elements + 1
        lines = np.linspace(0, self.length, count), np.linspace(0, self.width, count)
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)

    @cached_property
    def connectivity(self) -> np.ndarray:
        """Nodes (E, 9) of the elements."""
        count = 2 * self.elements + 1
        line = 2 * np.arange(self.elements)[:, None] + np.arange(3)
        places = np.arange(count**2).reshape(count, count)
        return places[line[:, None, :, None], line[None, :, None, :]].reshape(-1, 9)

    @cached_property
    def rule(self) -> tuple[np.ndarray, np.ndarray]:
        """Gradients (9, 9, 2) of the shapes at the Gauss points, and the area (9,) that each stands for."""
        at, weight = np.polynomial.legendre.leggauss(3)
        shape = np.stack([at * (at - 1) / 2, 1 - at * at, at * (at + 1) / 2])
        slope = np.stack([at - 0.5, -2 * at, at + 0.5])
        half = self.length / self.elements / 2, self.width / self.elements / 2
        gradients = [
            np.einsum("ig,jh->ghij", *pair).reshape(9, 9) / side
            for pair, side in zip(((slope, shape), (shape, slope)), half, strict=True)
        ]
        return np.stack(gradients, axis=-1), np.outer(weight, weight).ravel() * half[0] * half[1]

    def pulled(self, membrane: np.ndarray, strain: float) -> float:
        """Return the force of the grips at a strain [N]."""
        count = 2 * self.elements + 1
        driven = np.arange(len(self.nodes) - count, len(self.nodes))
        held = np.concatenate([np.arange(count), driven])
        gripped = (2 * held[:, None] + np.arange(2)).ravel()
        free = np.setdiff1d(np.arange(2 * len(self.nodes)), gripped)
        place = self.nodes * [1 + strain, 1]
        for _ in range(ITERATIONS):
            with np.errstate(divide="ignore", invalid="ignore"):  # refused below
                force, stiffness = self._respond(place, membrane)
            if not np.all(np.isfinite(force)):
                break
            if np.abs(force[free]).max() <= ACCURACY * np.abs(force[gripped]).max():
                return float(force[2 * driven].sum())
            place.reshape(-1)[free] -= spsolve(stiffness[free][:, free].tocsc(), force[free])
        raise ConvergenceError(
            f"a sheet of {self.length:.4g} x {self.width:.4g} m between grips finds no equilibrium at a strain of "
            f"{strain:g}: its membrane stiffness may not be positive there"
        )

    def _respond(self, place: np.ndarray, membrane: np.ndarray) -> tuple[np.ndarray, sp.csr_array]:
        """Return the forces (2 N,) and the stiffness (2 N, 2 N) of nodes at places (N, 2)."""
        gradient, area = self.rule
        nodes = self.connectivity
        deformation = np.einsum("eni,gnj->egij", place[nodes], gradient)
        square = np.einsum("egki,egkj->egij", deformation, deformation)[..., [0, 1, 0], [0, 1, 1]]
        stress, tangent = _law(square, membrane)
        # Derivative of C by the places of the nodes; 12 is there once, as in `stretches`.
        first, second = deformation[..., None, :, 0], deformation[..., None, :, 1]
        along, across = gradient[None, ..., 0, None], gradient[None, ..., 1, None]
        by_place = np.stack(
            [2 * first * along, 2 * second * across, first * across + second * along], axis=2
        ).reshape(*stress.shape, 18)
        force = np.einsum("g,egk,egkn->en", area, stress, by_place)
        blocks = np.einsum("g,egkn,egkl,eglm->enm", area, by_place, tangent, by_place, optimize=True)
        own, other = gradient[..., 0], gradient[..., 1]
        pairs = np.stack(
            [
                2 * np.einsum("gn,gm->gnm", own, own),
                2 * np.einsum("gn,gm->gnm", other, other),
                np.einsum("gn,gm->gnm", own, other) + np.einsum("gn,gm->gnm", other, own),
            ],
            axis=1,
        )
        geometric = np.einsum("g,egk,gknm->enm", area, stress, pairs, optimize=True)
        blocks += np.einsum("enm,ij->enimj", geometric, np.eye(2)).reshape(blocks.shape)
        unknown = (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), 18)
        row, column = np.broadcast_arrays(unknown[:, :, None], unknown[:, None])
        stiffness = sp.coo_array(
            (blocks.ravel(), (row.ravel(), column.ravel())), shape=(place.size, place.size)
        )
        return np.bincount(unknown.ravel(), force.ravel(), place.size), stiffness.tocsr()


def _law(square: np.ndarray, membrane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives (k, 3) and (k, 3, 3) of the energy over area by C (k, 3)."""
    steps = STEP * np.eye(3)
    slopes = [
        (_slope(square + step, membrane) - _slope(square - step, membrane)) / (2 * STEP) for step in steps
    ]
    return _slope(square, membrane), np.stack(slopes, axis=-1)


def _slope(square: np.ndarray, membrane: np.ndarray) -> np.ndarray:
    strain, derivative = stretches(square)
    return np.einsum("...i,ij,...jk->...k", strain, membrane, derivative)


# ---- square knits and one cell ----

MOST = 4
"""Number of the largest knits through which a limit is sought."""

CELLS = {
    "domain-yarns-tie-course": "cell-course",
    "domain-yarns-tie-wale": "cell-wale",
    "domain-cut-tie-wale": "cell-wale",
}
"""Scene of one cell of the endless knit, free across, by the series of square knits (`measures.domain.SERIES`)."""


def limit(cells: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Return the limit of values as knits grow, and its uncertainty from the choice of knits and law.

    Edges are the 1 / n-th part of a knit, corners the square of that.

    Parameters
    ----------
    cells, values : sequence, (k,)
        Cells in a row, rising, and the value of each knit; three or more.

    Returns
    -------
    limit, uncertainty : float
        The middle of the least and the largest a of a + b / n through the largest two, three and four knits, and of
        a + b / n + c / n^2 through the largest four, and half of what lies between them.
    """
    part, values = 1 / np.asarray(cells, dtype=float)[-MOST:], np.asarray(values, dtype=float)[-MOST:]
    found = [np.polyfit(part[-count:], values[-count:], 1)[1] for count in range(2, len(part) + 1)]
    found.append(np.polyfit(part, values, 2)[2])
    return (min(found) + max(found)) / 2, (max(found) - min(found)) / 2


def between_grips(history: xr.Dataset, scene: Scene, increment: int) -> float:
    """Return the factor by which the force of a cell grows in a large square knit, whose grips hold it across.

    The stiffness of the sheet is the mean of the cell's along its path: in free tension the sheet has the force and the
    contraction of the cell at that strain.

    Parameters
    ----------
    history : Dataset
        History of a tied cell that is free across.
    scene : Scene
    increment : int
        Increment at whose strain both are compared.
    """
    axis = DIRECTIONS.index(scene.load.deformation)
    order = [axis, 1 - axis, 2]
    way = history.isel(increment=slice(None, increment + 1))
    strain = way["strain"].to_numpy()
    mean = np.trapezoid(way["tangent_per_width"].to_numpy(), strain, axis=0) / strain[-1]
    membrane = 0.5 * (mean + mean.T)[np.ix_(order, order)]
    sides = np.array([scene.pattern.wale_spacing, scene.pattern.course_spacing])[order[:2]]
    return held_over_free(membrane, *sides, float(strain[-1]))


# ---- shell stiffness and moduli ----


def rotated(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """Return the stiffness (6, 6) of the shell turned in its plane by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    strains = np.array(
        [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    )  # in the axes of the shell, from those in space
    turn = np.kron(np.eye(2), strains)
    return turn.T @ stiffness @ turn


def referred(stiffness: np.ndarray, height: float) -> np.ndarray:
    """Return the stiffness (6, 6) about a plane that lies higher by `height` [m]."""
    # The old plane is strained by e - k height.
    shift = np.eye(6) - height * np.eye(6, k=3)
    return shift.T @ stiffness @ shift


@dataclass(frozen=True)
class Moduli:
    """Moduli of a sheet that is free of force in all other components.

    Attributes
    ----------
    course, wale, shear : float
        Force per width over strain [N/m].
    contraction_of_course, contraction_of_wale : float
        Poisson's ratios: contraction across a pull in course and in wale direction, over the strain along it.
    """

    course: float
    wale: float
    shear: float
    contraction_of_course: float
    contraction_of_wale: float


def moduli(membrane: np.ndarray) -> Moduli:
    """Return the moduli from forces per width by strains in the plane (3, 3) [N/m]."""
    compliance = np.linalg.inv(membrane)
    along = np.diag(compliance)
    return Moduli(*(1 / along), -compliance[1, 0] / along[0], -compliance[0, 1] / along[1])
