"""Hexahedron with incompatible modes and eight Gauss points: the reference for the one-point element.

Modes of Wilson et al. (1973), corrected by Taylor, Beresford and Wilson (1976) so that the patch test holds: the
displacement gradient gains sum_m alpha_m (x) G_m with G_m = (j0 / j) J0^-T grad(1 - xi_m^2). The alphas are
vectors that follow the frame of space; the element finds those of least energy by itself, so that its force and
its tangent depend on the displacements alone.
"""

from __future__ import annotations

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.elements.element import ElementResponse, element
from knitstudy.mechanics.elements.hexahedron import (
    GAUSS,
    GRADIENTS,
    deformation_gradient,
    jacobians,
    shape_gradient,
    tangent_moduli,
)
from knitstudy.mechanics.materials import Material

MODES = 3
ITERATIONS = 30


@element("incompatible_modes", "the reference, some ten times slower", abaqus="C3D8I", calculix="C3D8I")
class IncompatibleHexahedron:
    """Eight-point hexahedron with three incompatible modes.

    Parameters
    ----------
    corners : ndarray, shape (E, 8, 3)
        Undeformed nodes [m].
    material : Material
    """

    def __init__(self, corners: np.ndarray, material: Material) -> None:
        self.material = material
        middle = np.swapaxes(corners, 1, 2) @ shape_gradient(np.zeros(3))
        inverse, determinant0 = np.linalg.inv(middle), np.linalg.det(middle)
        self.volume = np.empty((8, len(corners)))
        self.gradient = np.empty((8, len(corners), 8 + MODES, 3))
        for q, (point, natural) in enumerate(zip(GAUSS, GRADIENTS, strict=True)):
            self.volume[q], self.gradient[q, :, :8] = jacobians(corners, natural)
            share = (determinant0 / self.volume[q])[:, None, None]
            self.gradient[q, :, 8:] = -2 * share * point[:, None] * inverse

    def respond(self, batch: slice, displacement: np.ndarray, stiffness: bool) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m].

        Raises
        ------
        ConvergenceError
            If the internal modes of an element find no equilibrium.
        """
        e = len(displacement)
        modes = np.zeros((e, MODES, 3))
        before = np.inf
        for _ in range(ITERATIONS):
            force, energy, blocks = self._integrate(batch, np.concatenate([displacement, modes], axis=1))
            matrix = blocks.reshape(e, 8 + MODES, 8 + MODES, 3, 3).swapaxes(2, 3).reshape(e, 33, 33)
            inner = np.linalg.solve(matrix[:, 24:, 24:], matrix[:, 24:, :24])
            step = np.linalg.solve(matrix[:, 24:, 24:], force[:, 8:].reshape(e, 9, 1))
            size = np.max(np.abs(step), initial=0.0)
            # Newton ends where rounding does: the step no longer falls.
            if size == 0.0 or size >= 0.5 * before:
                break
            before = size
            modes = modes - step.reshape(e, MODES, 3)
        else:
            raise ConvergenceError(
                "incompatible modes: no equilibrium inside an element; use smaller increments"
            )
        condensed = None
        if stiffness:
            outer = matrix[:, :24, :24] - matrix[:, :24, 24:] @ inner
            condensed = outer.reshape(e, 8, 3, 8, 3).swapaxes(2, 3).reshape(e, 64, 9)
        return ElementResponse(force[:, :8], energy, np.zeros(e), condensed)

    def _integrate(self, batch: slice, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return forces (e, 11, 3), energy (e,) and blocks (e, 121, 9) of nodes and modes."""
        e, n = len(motion), 8 + MODES
        force, energy, blocks = np.zeros((e, n, 3)), np.zeros(e), np.zeros((e, n * n, 9))
        for volume, gradient in zip(self.volume[:, batch], self.gradient[:, batch], strict=True):
            h, strain = deformation_gradient(motion, gradient)
            answer = self.material.respond(strain, tangent=True)
            deformation = h + np.eye(3)
            first = volume[:, None, None] * (deformation @ answer.stress)
            force += gradient @ np.swapaxes(first, 1, 2)
            energy += volume * answer.energy
            moduli = volume[:, None, None] * tangent_moduli(deformation, answer.stress, answer.tangent)
            pairs = gradient[:, :, None, :, None] * gradient[:, None, :, None, :]
            blocks += pairs.reshape(e, n * n, 9) @ moduli
        return force, energy, blocks
