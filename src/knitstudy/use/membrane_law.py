"""Membranes of finite strain in their plane: laws of a fabric, and quadrilaterals that a solver can drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import MeshError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.assembly import Assembly
from knitstudy.mechanics.core.model import Memoryless, Response

# Laws of a fabric as a membrane: energy over undeformed area by the strains in its plane
# Strains are Green's, E = (E_11, E_22, 2 E_12), in axes of the undeformed fabric (1 course, 2 wale); stresses (second
# Piola-Kirchhoff, times thickness) are forces per width S = dW/dE [N/m]. Cells of an endless fabric have stretches
# e = U - 1 instead, and the forces per width T = (dE/de)^T S that do work on them: `green` leads from one to the other.
#
# An energy that is convex in E has a positive tangent wherever principal stresses are not negative: F^T F is convex in
# F (Ogden 1997, Non-linear elastic deformations, section 6.2). Where one is negative a fabric wrinkles.

Parts = tuple[np.ndarray, np.ndarray, np.ndarray]
"""W (...) [J/m2], S (..., 3) [N/m] and dS/dE (..., 3, 3) [N/m] at strains (..., 3)."""


class MembraneLaw:
    """An energy over area with its derivatives; a law has `respond`."""

    def respond(self, strain: Floats) -> Parts:
        """Return energy, stress and tangent at strains (..., 3)."""
        raise NotImplementedError

    def energy(self, strain: Floats) -> Floats:
        """Return W (...) [J/m2]."""
        return self.respond(strain)[0]

    def stress(self, strain: Floats) -> Floats:
        """Return S = dW/dE (..., 3) [N/m]."""
        return self.respond(strain)[1]

    def tangent(self, strain: Floats) -> Floats:
        """Return dS/dE (..., 3, 3) [N/m]."""
        return self.respond(strain)[2]


@dataclass(frozen=True, eq=False)
class ExponentialLaw(MembraneLaw):
    """W = E . A E / 2 + sum of w (exp(a . E) - 1 - a . E) with A >= 0 and w > 0: free of stress at rest, and convex.

    A term stiffens where a . E > 0 and its stress saturates where that is negative, so that such sums come near any
    curve that rises.
    """

    form: Floats  # A (3, 3), symmetric [N/m]
    weight: Floats  # (k,) w [N/m]
    slope: Floats  # (k, 3) a

    def respond(self, strain: Floats) -> Parts:
        """Return energy, stress and tangent at strains (..., 3)."""
        along = strain @ self.slope.T
        linear = strain @ self.form
        growth = np.expm1(along)
        energy = 0.5 * (strain * linear).sum(axis=-1) + (growth - along) @ self.weight
        factor = self.weight * (1 + growth)
        tangent = self.form + np.einsum("...k,ki,kj->...ij", factor, self.slope, self.slope, optimize=True)
        return energy, linear + (self.weight * growth) @ self.slope, tangent


def green(stretch: Floats) -> tuple[Floats, Floats]:
    """Return Green's strains (..., 3) of stretches e = U - 1 (..., 3), shear doubled, and dE/de (..., 3, 3).

    Examples
    --------
    >>> green(np.array([0.1, 0.0, 0.0]))[0].round(12)  # (1.1^2 - 1) / 2
    array([0.105, 0.   , 0.   ])
    """
    one = 1 + stretch[..., 0]
    two = 1 + stretch[..., 1]
    half = 0.5 * stretch[..., 2]
    both = one + two
    none = np.zeros_like(one)
    strain = np.stack([(one**2 + half**2 - 1) / 2, (two**2 + half**2 - 1) / 2, half * both], axis=-1)
    rows = ((one, none, half / 2), (none, two, half / 2), (half, half, both / 2))
    return strain, np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def forces_per_width(law: MembraneLaw, stretch: Floats) -> Floats:
    """Return the forces per undeformed width T (..., 3) [N/m] at stretches e = U - 1 (..., 3).

    Examples
    --------
    >>> law = ExponentialLaw(np.diag([100.0, 50.0, 10.0]), np.empty(0), np.empty((0, 3)))
    >>> forces_per_width(law, np.array([0.1, 0.0, 0.0])).round(9)  # 100 E (1 + e), E = e + e^2 / 2
    array([11.55,  0.  ,  0.  ])
    """
    strain, derivative = green(stretch)
    return np.einsum("...i,...ij->...j", law.stress(strain), derivative)


# Total Lagrangian quadrilaterals
# Elements have (p + 1)^2 nodes, Lagrange's polynomials of degree p on even places and as many Gauss points; p = 1 and 2
# are the bilinear and the biquadratic element (Bonet and Wood 2008, chapters 8 and 9).

# Entries of F^T F that strains are made of: E_11, E_22 and 2 E_12
FIRST, SECOND = [0, 1, 0], [0, 1, 1]


class MembraneModel(Memoryless):
    """Quadrilaterals with a law; unknowns are the displacements of the nodes, and states (N, 2) are their sums."""

    block = 2

    def __init__(
        self,
        nodes: Floats,  # (N, 2) undeformed [m]
        elements: Ints,  # (E, (p + 1)^2), their nodes, line by line
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

    def start(self) -> Floats:
        """Return the undeformed state."""
        return np.zeros_like(self.nodes)

    def advance(self, state: Floats, step: Floats) -> Floats:
        """Return the state a step (size,) further."""
        return state + step.reshape(-1, 2)

    def deformation(self, state: Floats) -> Floats:
        """Return the deformation gradients F (E, g, 2, 2) at the Gauss points."""
        return np.eye(2) + np.einsum("eai,egaj->egij", state[self.elements], self._slope)

    def principal_forces(self, state: Floats) -> Floats:
        """Return the principal forces per deformed width (E, g, 2) at the Gauss points, rising [N/m]."""
        gradient = self.deformation(state)
        stress = self.law.stress(strains(gradient))[..., [[0, 2], [2, 1]]]
        cauchy = gradient @ stress @ np.swapaxes(gradient, -1, -2)
        return np.linalg.eigvalsh(cauchy / np.linalg.det(gradient)[..., None, None])

    def respond(self, state: Floats, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state."""
        gradient = self.deformation(state)
        slope = self._slope
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

    def _stiffness(self, gradient: Floats, tensor: Floats, tangent: Floats) -> sp.bsr_matrix:
        """Return the tangent stiffness: of the law, and of the stress."""
        slope = self._slope
        # dE_q = B_qai du_ai
        rows = np.einsum("egiq,egaq->egqai", gradient[..., FIRST], slope[..., SECOND])
        rows += np.einsum("egiq,egaq->egqai", gradient[..., SECOND], slope[..., FIRST])
        rows *= np.array([0.5, 0.5, 1.0])[:, None, None]
        count = len(rows)
        nodes = slope.shape[2]
        flat = rows.reshape(count, -1, 3, 2 * nodes)
        scaled = (self.area[..., None, None] * tangent) @ flat
        total = np.swapaxes(flat.reshape(count, -1, 2 * nodes), 1, 2) @ scaled.reshape(count, -1, 2 * nodes)
        total = total.reshape(count, nodes, 2, nodes, 2).transpose(0, 1, 3, 2, 4)
        of_stress = np.einsum("eg,egai,egij,egbj->eab", self.area, slope, tensor, slope, optimize=True)
        blocks = (total + of_stress[..., None, None] * np.eye(2)).reshape(count, nodes**2, 4)
        summed = self._assembly.begin_stiffness()
        summed.put(0, blocks)
        return self._assembly.matrix(summed)


def strains(gradient: Floats) -> Floats:
    """Return Green's strains (..., 3) of deformation gradients (..., 2, 2).

    Examples
    --------
    >>> strains(np.array([[1.1, 0.0], [0.2, 1.0]])).round(12).tolist()  # E_11, E_22, 2 E_12
    [0.125, 0.0, 0.2]
    """
    square = np.swapaxes(gradient, -1, -2) @ gradient
    return 0.5 * (square[..., FIRST, SECOND] - [1, 1, 0]) * [1, 1, 2]


def _reference(degree: int) -> tuple[Floats, Floats]:
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
) -> tuple[Floats, Ints, Ints]:
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
