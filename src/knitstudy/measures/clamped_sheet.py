"""A sheet between grips that hold it across: what they add to its force in free tension, at finite strains.

Between grips an endless knit is not pulled as its cell is: it cannot contract where it is held, and a sheet that is
stiffer across than along carries that far. In between it necks, which turns its sides into the pull. The sheet is
homogeneous and hyperelastic: half of e M e is its energy over area, e its stretches less one (U - 1 of the polar
decomposition F = R U, shear doubled) and M the forces per width by them. Total Lagrangian elements of nine nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from knitstudy.errors import ConvergenceError

ELEMENTS = 24
"""Elements in either direction: the factor of a square knit is within 2e-4 of that of twice as many."""

ITERATIONS = 20

ACCURACY = 1e-7
"""Largest unbalanced force, over the largest one at the grips."""

STEP = 1e-6
"""Of the difference quotients that the tangent of the law is; what is found does not hang on it."""


def held_over_free(
    membrane: np.ndarray, length: float, width: float, strain: float, elements: int = ELEMENTS
) -> float:
    """Return the force of a sheet that grips hold across at both ends, over that of free tension at the same strain.

    Parameters
    ----------
    membrane : ndarray, shape (3, 3)
        Forces per width by strains M [N/m], the first along the pull, the second across; shear is not coupled to them,
        as in a sheet that is its own mirror image.
    length, width : float
        Of the sheet, along the pull and across [m].
    strain : float
        By which the grips part.
    elements : int
        In either direction.

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
        """Return the force of the grips that part by a strain [N]."""
        count = 2 * self.elements + 1
        driven = np.arange(len(self.nodes) - count, len(self.nodes))
        held = np.concatenate([np.arange(count), driven])
        gripped = (2 * held[:, None] + np.arange(2)).ravel()
        free = np.setdiff1d(np.arange(2 * len(self.nodes)), gripped)
        place = self.nodes * [1 + strain, 1]
        for _ in range(ITERATIONS):
            with np.errstate(divide="ignore", invalid="ignore"):  # what is not finite is refused
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
        # Of C by the places of the nodes; 12 is there once, as in `stretches`.
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
