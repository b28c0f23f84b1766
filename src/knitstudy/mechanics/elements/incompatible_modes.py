"""Hexahedron with incompatible modes and eight Gauss points: the best of the linear ones.

Modes of Wilson et al. (1973), corrected by Taylor, Beresford and Wilson (1976) so that the patch test holds: the
displacement gradient gains sum_m alpha_m (x) G_m with G_m = (j0 / j) J0^-T grad(1 - xi_m^2). The alphas are
vectors that follow the frame of space; the element finds those of least energy by itself, so that its force and
its tangent depend on the displacements alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.batches import SCRATCH, determinant, inverse
from knitstudy.mechanics.elements.element import ElementResponse, element
from knitstudy.mechanics.elements.hexahedron import (
    GAUSS,
    GRADIENTS,
    gradient_stiffness,
    jacobians,
    shape_gradient,
    tangent_moduli,
)
from knitstudy.mechanics.materials import Material

MODES = 3
POINTS = len(GAUSS)
CACHE = 64
"""Elements whose points fit into a processor's cache together."""

ITERATIONS = 12
"""Newton iterations for the modes after which there is none: a good start takes two or three."""

ACCURACY = 1e-14
"""Error that a linear last step may leave in the modes, as a share of the displacement gradient."""

LARGEST_POISSON_RATIO = 0.47
"""Poisson's ratio beyond which a bent yarn of the coarsest round section, five elements across, is 5 % too stiff."""


@dataclass(frozen=True)
class _Points:
    """Response of all points of a few elements to the displacements of nodes and modes."""

    force: np.ndarray  # (e, 11, 3)
    energy: np.ndarray  # (e,)
    moduli: np.ndarray  # (e, 8, 9, 9)
    stretch: np.ndarray  # (e,), largest entry of the displacement gradient
    folded: np.ndarray  # (e,)


@element(
    "incompatible_modes",
    "the best of linear ones, some five times slower",
    largest_poisson_ratio=LARGEST_POISSON_RATIO,
)
class IncompatibleHexahedron:
    """Eight-point hexahedron with three incompatible modes.

    It locks where a material hardly changes its volume and elements are no bricks, as in a round section: a yarn that
    is bent between two grips, five and six elements across, is 3 and 1.5 % stiffer than with quadratic elements at nu
    of 0.42, 5 and 2 % at 0.47, 8 and 3 % at 0.49, 34 and 15 % at 0.499.

    The search for the modes starts from those of the last response; where it starts shows in its cost alone.

    Parameters
    ----------
    corners : ndarray, shape (E, 8, 3)
        Undeformed nodes [m].
    material : Material
    """

    def __init__(self, corners: np.ndarray, material: Material) -> None:
        self.material = material
        count = len(corners)
        middle = np.swapaxes(corners, 1, 2) @ shape_gradient(np.zeros((1, 3)))[0]
        inverse0, determinant0 = inverse(middle)
        self.weight = np.empty((count, POINTS))
        self.gradient = np.empty((count, 8 + MODES, POINTS, 3))
        for q, (point, natural) in enumerate(zip(GAUSS, GRADIENTS, strict=True)):
            self.weight[:, q], self.gradient[:, :8, q] = jacobians(corners, natural)
            share = (determinant0 / self.weight[:, q])[:, None, None]
            self.gradient[:, 8:, q] = -2 * share * point[:, None] * inverse0
        self.volume = self.weight.sum(axis=1)
        self._start = np.zeros((count, MODES, 3))

    def respond(
        self, batch: slice, displacement: np.ndarray, stiffness: bool, out: np.ndarray | None = None
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m].

        Forces are not numbers where an element is folded or its modes find no equilibrium.
        """
        count = len(displacement)
        force, energy = np.empty((count, 8, 3)), np.empty(count)
        if stiffness and out is None:
            out = np.empty((count, 64, 9))
        elements = np.arange(len(self.volume))[batch]
        for first in range(0, count, CACHE):
            few = slice(first, min(first + CACHE, count))
            blocks = out[few] if stiffness else None
            force[few], energy[few], found = self._condense(elements[few], displacement[few], blocks)
            if not found.all():
                # The modes of another state can be worse than none.
                lost = np.arange(first, few.stop)[~found]
                self._start[elements[lost]] = 0
                again = np.empty((len(lost), 64, 9)) if stiffness else None
                force[lost], energy[lost], found = self._condense(elements[lost], displacement[lost], again)
                force[lost[~found]] = np.nan
                self._start[elements[lost[~found]]] = 0
                if stiffness:
                    out[lost] = again
        return ElementResponse(force, energy, np.zeros(count), out if stiffness else None)

    def _condense(
        self, elements: np.ndarray, displacement: np.ndarray, out: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return force (e, 8, 3), energy (e,) and whether the modes were found (e,); put the stiffness into `out`."""
        e, n = len(elements), 8 + MODES
        gradient, weight = self.gradient[elements], self.weight[elements]
        weighted = SCRATCH.array("weighted gradients", e, POINTS, n, 3)
        np.multiply(np.swapaxes(gradient, 1, 2), weight[:, :, None, None], out=weighted)
        gradient = gradient.reshape(e, n, POINTS * 3)
        motion = np.concatenate([displacement, self._start[elements]], axis=1)
        columns = np.empty((e, n * MODES, 9))
        before, found = np.full(e, np.inf), np.zeros(e, dtype=bool)
        for _ in range(ITERATIONS):
            points = self._points(gradient, weight, motion)
            gradient_stiffness(gradient, weighted[:, :, 8:], points.moduli, columns)
            blocks = columns.reshape(e, n, MODES, 3, 3).swapaxes(2, 3).reshape(e, 3 * n, 3 * MODES)
            step = _solve(blocks[:, 24:], points.force[:, 8:].reshape(e, 9, 1))
            size = np.abs(np.swapaxes(gradient[:, 8:], 1, 2) @ step.reshape(e, MODES, 3)).max(axis=(1, 2))
            lost = ~(size < before) & (before < np.inf) & ~found  # not a number is lost as well
            # What a linear last step leaves out is of second order; a tangent has to be of the place itself.
            enough = size**2 <= ACCURACY * points.stretch
            if out is not None:
                enough &= size <= 1e-9 * points.stretch
            found |= (enough | (size <= 1e-15)) & ~points.folded
            if np.all(found | lost):
                break
            motion[:, 8:] -= np.where(lost[:, None, None], 0.0, step.reshape(e, MODES, 3))
            before = size
        self._start[elements] = np.where(
            found[:, None, None], motion[:, 8:] - step.reshape(e, MODES, 3), self._start[elements]
        )
        force = points.force[:, :8] - (blocks[:, :24] @ step).reshape(e, 8, 3)
        energy = points.energy - 0.5 * np.einsum("ei,ei->e", points.force[:, 8:].reshape(e, 9), step[:, :, 0])
        force[points.folded] = np.nan
        if out is not None:
            self._condensed(gradient[:, :8], weighted[:, :, :8], points.moduli, blocks, out)
        return force, energy, found

    def _points(self, gradient: np.ndarray, weight: np.ndarray, motion: np.ndarray) -> _Points:
        """Integrate over the points of elements with nodes and modes moved by (e, 11, 3)."""
        e = len(motion)
        columns = (np.swapaxes(gradient, 1, 2) @ motion).reshape(-1, 3, 3)  # (e q, J, i): H transposed
        rows = np.swapaxes(columns, 1, 2)
        answer = self.material.respond(0.5 * (rows + columns + columns @ rows), tangent=True)
        deformation = rows + np.eye(3)
        moduli = SCRATCH.array("tangent moduli", e * POINTS, 9, 9)
        tangent_moduli(deformation, answer.stress, answer.tangent, moduli)
        first = answer.stress @ np.swapaxes(deformation, 1, 2)  # P transposed
        first *= weight.reshape(-1, 1, 1)
        return _Points(
            force=gradient @ first.reshape(e, POINTS * 3, 3),
            energy=np.einsum("eq,eq->e", weight, answer.energy.reshape(e, POINTS)),
            moduli=moduli.reshape(e, POINTS, 9, 9),
            stretch=np.abs(columns).reshape(e, -1).max(axis=1),
            folded=(determinant(deformation) <= 0).reshape(e, POINTS).any(axis=1),
        )

    @staticmethod
    def _condensed(
        gradient: np.ndarray, weighted: np.ndarray, moduli: np.ndarray, blocks: np.ndarray, out: np.ndarray
    ) -> None:
        """Put the stiffness of the nodes without the modes, whose columns are `blocks` (e, 33, 9), into `out`."""
        e = len(out)
        gradient_stiffness(gradient, weighted, moduli, out)
        outer = blocks[:, :24]
        taken = outer @ _solve(blocks[:, 24:], np.swapaxes(outer, 1, 2))  # (a, i), (b, k)
        out -= taken.reshape(e, 8, 3, 8, 3).swapaxes(2, 3).reshape(e, 64, 9)


def _solve(matrix: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Return the solutions of systems (e, 9, 9), not a number where there is none."""
    try:
        return np.linalg.solve(matrix, rhs)
    except np.linalg.LinAlgError:
        singular = ~(np.abs(np.linalg.det(matrix)) > 0)
        matrix = np.where(singular[:, None, None], np.eye(matrix.shape[1]), matrix)
        return np.where(singular[:, None, None], np.nan, np.linalg.solve(matrix, rhs))
