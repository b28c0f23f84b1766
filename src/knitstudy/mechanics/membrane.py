"""Membranes of finite strain in their plane: total Lagrangian quadrilaterals as a model that a solver can drive.

Elements have (p + 1)^2 nodes, Lagrange's polynomials of degree p on even places and as many Gauss points; p = 1 and 2
are the bilinear and the biquadratic element (Bonet and Wood 2008, chapters 8 and 9).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import MeshError
from knitstudy.mechanics.assembly import Assembly
from knitstudy.mechanics.membrane_law import MembraneLaw
from knitstudy.mechanics.model import Memoryless, Response

# Entries of F^T F that strains are made of: E_11, E_22 and 2 E_12
FIRST, SECOND = [0, 1, 0], [0, 1, 1]


class MembraneModel(Memoryless):
    """Quadrilaterals with a law; unknowns are the displacements of the nodes, and states (N, 2) are their sums."""

    block = 2

    def __init__(
        self,
        nodes: np.ndarray,  # (N, 2) undeformed [m]
        elements: np.ndarray,  # int (E, (p + 1)^2), their nodes, line by line
        law: MembraneLaw,
    ) -> None:
        self.nodes, self.elements, self.law = nodes, elements, law
        shape_slope, weight = _reference(round(elements.shape[1] ** 0.5) - 1)
        jacobian = np.einsum("eai,gaj->egij", nodes[elements], shape_slope)
        size = np.linalg.det(jacobian)
        if not (np.all(size > 0) or np.all(size < 0)):  # either way round, but all alike
            raise MeshError("elements of a membrane are folded: the Jacobian changes its sign")
        self._slope = np.einsum("gaj,egji->egai", shape_slope, np.linalg.inv(jacobian))  # dN/dX
        self.area = np.abs(size) * weight  # (E, g) of the Gauss points [m2]
        self.size = nodes.size
        self.scale = np.ones(self.size)
        self.length = float(np.sqrt(self.area.sum() / len(elements)))
        pairs = elements.shape[1] ** 2 * len(elements)
        self._assembly = Assembly([elements], len(nodes), block=2, pairs=pairs)

    def start(self) -> np.ndarray:
        """Return the undeformed state."""
        return np.zeros_like(self.nodes)

    def advance(self, state: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the state a step (size,) further."""
        return state + step.reshape(-1, 2)

    def deformation(self, state: np.ndarray) -> np.ndarray:
        """Return the deformation gradients F (E, g, 2, 2) at the Gauss points."""
        return np.eye(2) + np.einsum("eai,egaj->egij", state[self.elements], self._slope)

    def principal_forces(self, state: np.ndarray) -> np.ndarray:
        """Return the principal forces per deformed width (E, g, 2) at the Gauss points, rising [N/m]."""
        gradient = self.deformation(state)
        stress = self.law.stress(strains(gradient))[..., [[0, 2], [2, 1]]]
        cauchy = gradient @ stress @ np.swapaxes(gradient, -1, -2)
        return np.linalg.eigvalsh(cauchy / np.linalg.det(gradient)[..., None, None])

    def respond(self, state: np.ndarray, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state."""
        gradient, slope = self.deformation(state), self._slope
        inside_out = np.linalg.det(gradient) <= 0
        strain = np.where(inside_out[..., None], np.nan, strains(gradient))
        with np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused
            density, stress, tangent = self.law.respond(strain)
            tensor = stress[..., [[0, 2], [2, 1]]]
            force = np.einsum("eg,egij,egjk,egak->eai", self.area, gradient, tensor, slope, optimize=True)
        return Response(
            force=self._assembly.sum_forces([force]),
            mean_force=float(np.linalg.norm(force, axis=2).mean()),
            energy={"internal": float(np.vdot(self.area, density))},
            stiffness=self._stiffness(gradient, tensor, tangent) if stiffness else None,
        )

    def _stiffness(self, gradient: np.ndarray, tensor: np.ndarray, tangent: np.ndarray) -> sp.bsr_matrix:
        """Return the tangent stiffness: of the law, and of the stress."""
        slope = self._slope
        # dE_q = B_qai du_ai
        rows = np.einsum("egiq,egaq->egqai", gradient[..., FIRST], slope[..., SECOND])
        rows += np.einsum("egiq,egaq->egqai", gradient[..., SECOND], slope[..., FIRST])
        rows *= np.array([0.5, 0.5, 1.0])[:, None, None]
        count, nodes = len(rows), slope.shape[2]
        flat = rows.reshape(count, -1, 3, 2 * nodes)
        scaled = (self.area[..., None, None] * tangent) @ flat
        total = np.swapaxes(flat.reshape(count, -1, 2 * nodes), 1, 2) @ scaled.reshape(count, -1, 2 * nodes)
        total = total.reshape(count, nodes, 2, nodes, 2).transpose(0, 1, 3, 2, 4)
        of_stress = np.einsum("eg,egai,egij,egbj->eab", self.area, slope, tensor, slope, optimize=True)
        blocks = (total + of_stress[..., None, None] * np.eye(2)).reshape(count, nodes**2, 4)
        summed = self._assembly.begin_stiffness()
        summed.put(0, blocks)
        return self._assembly.matrix(summed)


def strains(gradient: np.ndarray) -> np.ndarray:
    """Return Green's strains (..., 3) of deformation gradients (..., 2, 2).

    Examples
    --------
    >>> strains(np.array([[1.1, 0.0], [0.2, 1.0]])).round(12).tolist()  # E_11, E_22, 2 E_12
    [0.125, 0.0, 0.2]
    """
    square = np.swapaxes(gradient, -1, -2) @ gradient
    return 0.5 * (square[..., FIRST, SECOND] - [1, 1, 0]) * [1, 1, 2]


def _reference(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the slopes (g, a, 2) of the shapes at the Gauss points of the square of side 2, and weights (g,)."""
    at, weight = np.polynomial.legendre.leggauss(degree + 1)
    places = np.linspace(-1, 1, degree + 1)
    powers = np.linalg.inv(np.vander(places, increasing=True))  # (power, shape)
    shape = np.vander(at, degree + 1, increasing=True) @ powers
    slope = np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyder(powers)).T
    pairs = ((slope, shape), (shape, slope))
    slopes = [np.einsum("ga,hb->ghab", *pair).reshape(len(at) ** 2, -1) for pair in pairs]
    return np.stack(slopes, axis=-1), np.outer(weight, weight).ravel()


def rectangle(
    sides: tuple[float, float], elements: tuple[int, int], degree: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return nodes (N, 2) [m] of a rectangle, elements (E, a), and the numbers of the nodes by both places.

    Examples
    --------
    >>> nodes, elements, _ = rectangle((2.0, 1.0), (2, 1), degree=1)
    >>> nodes[elements[1]].tolist()
    [[1.0, 0.0], [1.0, 1.0], [2.0, 0.0], [2.0, 1.0]]
    """
    lines = [degree * count + 1 for count in elements]
    number = np.arange(lines[0] * lines[1]).reshape(lines)
    axes = [np.linspace(0, side, count) for side, count in zip(sides, lines, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    first, second = (degree * np.arange(count)[:, None] + np.arange(degree + 1) for count in elements)
    cells = number[first[:, None, :, None], second[None, :, None, :]]
    return nodes, cells.reshape(-1, (degree + 1) ** 2), number
