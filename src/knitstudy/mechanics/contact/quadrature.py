"""Gauss points on smooth surfaces: where contact is checked, and the area that each point stands for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from knitstudy.mechanics.contact.surface import Surfaces

CHUNK = 20_000
"""Points evaluated at once; bounds the memory of stencils."""


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Gauss points of all surfaces, numbered surface by surface, row of cells by row of cells.

    Attributes
    ----------
    surface : ndarray of int, shape (P,)
        Surface that a point lies on.
    xi : ndarray, shape (P, 2)
        Its parameters.
    cell : ndarray of int, shape (P, 2)
        Cell that it lies in.
    area : ndarray, shape (P,)
        Undeformed area of the contact surface that it stands for [m2].
    per_cell : int
        Points in one cell; they follow each other.
    first_cell : ndarray of int, shape (G + 1,)
        First cell of every surface, then the number of all cells.
    """

    surface: np.ndarray
    xi: np.ndarray
    cell: np.ndarray
    area: np.ndarray
    per_cell: int
    first_cell: np.ndarray

    @cached_property
    def cell_area(self) -> np.ndarray:
        """Undeformed area (P,) of the cell of every point [m2]."""
        place = np.column_stack([self.surface, self.cell])
        cell = np.cumsum(np.any(np.diff(place, axis=0, prepend=place[:1]), axis=1))
        return np.bincount(cell, self.area)[cell]

    @classmethod
    def on(cls, surfaces: Surfaces, carriers: np.ndarray, points: int) -> Quadrature:
        """Place ``points`` x ``points`` Gauss points in every cell of surfaces with undeformed carriers (M, 3)."""
        position, weight = np.polynomial.legendre.leggauss(points)
        position, weight = 0.5 * (position + 1), 0.5 * weight
        local = np.stack(np.meshgrid(position, position, indexing="ij"), axis=-1).reshape(-1, 2)
        share = np.outer(weight, weight).ravel()
        parts = []
        for number, (rows, columns) in enumerate(surfaces.cells):
            cell = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
            cell = np.repeat(cell.reshape(-1, 2), points**2, axis=0)
            edges = surfaces.edges(number)
            corner, size = (
                np.stack([values[cell[:, a]] for a, values in enumerate(both)], axis=1)
                for both in ([edge[:-1] for edge in edges], [np.diff(edge) for edge in edges])
            )
            xi = corner + size * np.tile(local, (rows * columns, 1))
            surface = np.full(len(xi), number)
            area = np.tile(share, rows * columns) * size.prod(axis=1)
            for low in range(0, len(xi), CHUNK):
                part = slice(low, low + CHUNK)
                area[part] *= _stretch(surfaces, surface[part], xi[part], carriers)
            parts.append((surface, xi, cell, area))
        surface, xi, cell, area = (np.concatenate(values) for values in zip(*parts, strict=True))
        return cls(
            surface=surface,
            xi=xi,
            cell=cell,
            area=area,
            per_cell=points**2,
            first_cell=np.concatenate([[0], np.cumsum(surfaces.cells.prod(axis=1))]),
        )


def _stretch(surfaces: Surfaces, surface: np.ndarray, xi: np.ndarray, carriers: np.ndarray) -> np.ndarray:
    """Return the area (k,) of the contact surface a unit of the parameters' area [m2].

    At a depth o below the interpolated surface it is (1 + o tr(m^-1 k)) times as large, k the curvature form.
    """
    _, tangent, second = surfaces.places(surface, xi, carriers)
    normal = np.cross(tangent[:, 1], tangent[:, 0])
    area = np.linalg.norm(normal, axis=1)
    curvature = np.einsum("kai,ki->ka", second, normal / area[:, None])
    m, k = np.einsum("kai,kbi->abk", tangent, tangent), curvature.T
    trace = (m[1, 1] * k[0] - 2 * m[0, 1] * k[1] + m[0, 0] * k[2]) / (m[0, 0] * m[1, 1] - m[0, 1] ** 2)
    return area * (1 + surfaces.offset[surface] * trace)
