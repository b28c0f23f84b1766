"""Hexahedron with twenty nodes and eight Gauss points: quadratic, its edges curved, with reduced integration.

Serendipity functions (Zienkiewicz, Taylor and Zhu 2013, section 6.7.2) in total Lagrangian form. Nodes are in the
order of VTK, which is that of C3D20R in Abaqus and CalculiX as well: corners, then the middles of the lower edges, of
the upper ones, and of those between them.
"""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.elements.hexahedron import CORNERS, GAUSS, Hexahedra, jacobians, shape_gradient
from knitstudy.mechanics.materials import Material

EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
)
"""Corners (12, 2) that the nodes 8 to 19 lie between."""

NATURAL = np.concatenate([CORNERS, CORNERS[EDGES].mean(axis=1)])  # natural coordinates (20, 3) of the nodes
NODES = len(NATURAL)


def quadratic_shape(natural: np.ndarray) -> np.ndarray:
    """Return the shape functions (k, 20) at natural coordinates (k, 3).

    Examples
    --------
    >>> float(quadratic_shape(np.zeros((1, 3))).sum().round(12))
    1.0
    """
    factor = 1 + NATURAL * natural[:, None]  # (k, 20, 3)
    product = factor.prod(axis=2)
    reach = (CORNERS * natural[:, None]).sum(axis=2) - 2
    bubble = 1 - natural**2
    along = np.argmin(np.abs(NATURAL[8:]), axis=1)
    return np.concatenate([product[:, :8] * reach / 8, product[:, 8:] * bubble[:, along] / 4], axis=1)


GRADIENTS = shape_gradient(
    GAUSS, quadratic_shape
)  # natural gradients (8 points, 20 nodes, 3) at the Gauss points


@ELEMENTS.register
class QuadraticHexahedron(Hexahedra):
    """Twenty-node hexahedron with 2 x 2 x 2 Gauss points.

    Eight points see 48 of the 54 deformations of one element: six of its modes cost no energy. A single row of elements
    has some of them as well; where two by two lie side by side, as in the section of any yarn, there are none left.

    Raises MeshError if an element is folded at one of its points.
    """

    name, meaning, nodes = "quadratic", "20 nodes on curved edges, reduced integration", NODES
    few = 64

    def __init__(
        self,
        corners: np.ndarray,  # (E, 20, 3), undeformed nodes [m]
        material: Material,
        coefficient: float = 0.0,  # of hourglass control, which it does without
    ) -> None:
        weight, gradient = (
            np.empty((len(corners), len(GAUSS))),
            np.empty((len(corners), NODES, len(GAUSS), 3)),
        )
        for q, natural in enumerate(GRADIENTS):
            weight[:, q], gradient[:, :, q] = jacobians(corners, natural)
        super().__init__(corners, material, GAUSS, weight, gradient)
