"""Hexahedron with twenty nodes and eight Gauss points: quadratic, its edges curved, with reduced integration.

Serendipity functions (Zienkiewicz, Taylor and Zhu 2013, section 6.7.2) in total Lagrangian form. Nodes are in the
order of VTK, which is that of C3D20R in Abaqus and CalculiX as well: corners, then the middles of the lower edges, of
the upper ones, and of those between them.
"""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.batches import SCRATCH, determinant
from knitstudy.mechanics.elements import ElementResponse, element
from knitstudy.mechanics.elements.hexahedron import (
    CORNERS,
    GAUSS,
    gradient_stiffness,
    jacobians,
    natural_axes,
    tangent_moduli,
)
from knitstudy.mechanics.materials import Material

EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
)
"""Corners (12, 2) that the nodes 8 to 19 lie between."""

NATURAL = np.concatenate([CORNERS, CORNERS[EDGES].mean(axis=1)])  # natural coordinates (20, 3) of the nodes
NODES = len(NATURAL)
POINTS = len(GAUSS)
CACHE = 64  # elements whose points fit into a processor's cache together


def quadratic_shape(natural: np.ndarray) -> np.ndarray:
    """Return the shape functions (k, 20) at natural coordinates (k, 3)."""
    factor = 1 + NATURAL * natural[:, None]  # (k, 20, 3)
    product = factor.prod(axis=2)
    reach = (CORNERS * natural[:, None]).sum(axis=2) - 2
    bubble = 1 - natural**2
    along = np.argmin(np.abs(NATURAL[8:]), axis=1)
    return np.concatenate([product[:, :8] * reach / 8, product[:, 8:] * bubble[:, along] / 4], axis=1)


def quadratic_shape_gradient(natural: np.ndarray) -> np.ndarray:
    """Return the gradients (k, 20, 3) of the shape functions at natural coordinates (k, 3)."""
    factor = 1 + NATURAL * natural[:, None]  # (k, 20, 3)
    product = factor.prod(axis=2, keepdims=True)
    others = factor[:, :, [1, 0, 0]] * factor[:, :, [2, 2, 1]]
    slope = NATURAL * others
    reach = (CORNERS * natural[:, None]).sum(axis=2, keepdims=True) - 2
    gradient = np.empty((len(natural), NODES, 3))
    gradient[:, :8] = (slope[:, :8] * reach + product[:, :8] * CORNERS) / 8
    along = np.eye(3)[np.argmin(np.abs(NATURAL[8:]), axis=1)]  # (12, 3), the direction of the edge
    bubble = ((1 - natural**2)[:, None] * along).sum(axis=2, keepdims=True)
    turn = -2 * natural[:, None] * along
    gradient[:, 8:] = (slope[:, 8:] * bubble + product[:, 8:] * turn) / 4
    return gradient


GRADIENTS = quadratic_shape_gradient(GAUSS)  # natural gradients (8 points, 20 nodes, 3) at the Gauss points


@element("quadratic", "20 nodes on curved edges, reduced integration", nodes=NODES)
class QuadraticHexahedron:
    """Twenty-node hexahedron with 2 x 2 x 2 Gauss points.

    Eight points see 48 of the 54 deformations of one element: six of its modes cost no energy. A single row of elements
    has some of them as well; where two by two lie side by side, as in the section of any yarn, there are none left.

    Raises MeshError if an element is folded at one of its points.
    """

    def __init__(
        self,
        corners: np.ndarray,  # (E, 20, 3), undeformed nodes [m]
        material: Material,
    ) -> None:
        self.material = material
        count = len(corners)
        self.weight = np.empty((count, POINTS))
        self.gradient = np.empty((count, NODES, POINTS, 3))
        for q, natural in enumerate(GRADIENTS):
            self.weight[:, q], self.gradient[:, :, q] = jacobians(corners, natural)
        self.volume = self.weight.sum(axis=1)
        self.axes = np.swapaxes(natural_axes(corners, GAUSS), 0, 1) if material.directional else None

    def respond(
        self, batch: slice, displacement: np.ndarray, stiffness: bool, out: np.ndarray | None = None
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 20, 3) [m].

        Forces are not numbers where an element is folded at one of its points.
        """
        gradient, weight = self.gradient[batch], self.weight[batch]
        count = len(displacement)
        force, energy = np.empty((count, NODES, 3)), np.empty(count)
        if stiffness and out is None:
            out = np.empty((count, NODES**2, 9))
        for first in range(0, count, CACHE):
            few = slice(first, min(first + CACHE, count))
            blocks = out[few] if stiffness else None
            axes = None if self.axes is None else self.axes[batch][few].reshape(-1, 3, 3)
            force[few], energy[few] = self._integrate(
                gradient[few], weight[few], displacement[few], axes, blocks
            )
        return ElementResponse(force, energy, np.zeros(count), out if stiffness else None)

    def _integrate(
        self,
        gradient: np.ndarray,
        weight: np.ndarray,
        displacement: np.ndarray,
        axes: np.ndarray | None,
        out: np.ndarray | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return force (e, 20, 3) and energy (e,); put the stiffness into `out`."""
        e = len(displacement)
        flat = gradient.reshape(e, NODES, POINTS * 3)
        rows = (np.swapaxes(flat, 1, 2) @ displacement).reshape(-1, 3, 3)  # H transposed, of all points
        columns = np.swapaxes(rows, 1, 2)
        strain = 0.5 * (rows + columns + rows @ columns)
        answer = self.material.respond(strain, out is not None, axes)
        deformation = columns + np.eye(3)
        share = weight.reshape(-1, 1, 1)
        stress = share * answer.stress
        first = stress @ np.swapaxes(deformation, 1, 2)  # P transposed, times the volume of the point
        force = flat @ first.reshape(e, POINTS * 3, 3)
        energy = np.einsum("eq,eq->e", weight, answer.energy.reshape(e, POINTS))
        # An element turned inside out has no energy in terms of E: let the load path see it.
        force[(determinant(deformation) <= 0).reshape(e, POINTS).any(axis=1)] = np.nan
        if out is not None:
            moduli = SCRATCH.array("tangent moduli", e * POINTS, 9, 9)
            tangent_moduli(deformation, stress, share * answer.tangent, moduli)
            gradient_stiffness(flat, np.swapaxes(gradient, 1, 2), moduli.reshape(e, POINTS, 9, 9), out)
        return force, energy
