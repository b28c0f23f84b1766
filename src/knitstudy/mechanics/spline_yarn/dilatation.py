"""Mean dilatation of spans, which keeps low degrees over the section from locking as Poisson's ratio nears 1/2.

The energy lame/2 theta^2 of the dilatation theta = ln det F is that of its mean over a span: the projection, in the L2
norm of the undeformed span, onto functions M_r that are polynomials of degree p - 1 over the section and constant
along the yarn,

    theta_r = int M_r theta dV,   int M_r M_s dV = delta_rs,   W = lame/2 sum over r of theta_r^2,

a B-bar and F-bar projection (Elguedj et al. 2008, doi:10.1016/j.cma.2008.01.012) span by span. Displacements of degree
p over the section have every divergence of degree p - 1, so that no strain along the yarn is locked there; along it,
means ask one thing of each span, and splines have one unknown to answer it. What is left of the law, with a first Lame
constant of zero, resists every strain with twice the shear modulus: no mode becomes soft. The mean pressure
lame sum of theta_r M_r acts pointwise; the products lame d theta_r d theta_r are the rest of the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.batches import determinant, inverse
from knitstudy.mechanics.materials import VOIGT


@dataclass(frozen=True, eq=False)
class Dilatation:
    """The mean dilatation of a few spans in one configuration; tensors in parent coordinates."""

    lame: float  # [Pa]
    part: np.ndarray  # (e, r, q), M_r times the volume of the points
    mean: np.ndarray  # (e, r), theta_r
    flux: np.ndarray  # (e q, 3, 3), d theta over the change of covariant vectors in columns, times the volume
    orthonormal: np.ndarray  # (e, r, r), from given functions to M_r
    metric: np.ndarray  # (e q, 3, 3), d theta / d E
    moduli_factor: float  # of the pressure in the moduli: 1 for ln det F, 0 for tr E

    @property
    def energy(self) -> np.ndarray:
        """Stored energy (e,) [J]."""
        return 0.5 * self.lame * (self.mean**2).sum(axis=1)

    def stress(self, mean: np.ndarray | None = None) -> np.ndarray:
        """Return the stress (e q, 3, 3) of means (e, r), by default those of here, times the volume of the points."""
        return self._pressure(self.mean if mean is None else mean) * self.metric

    def moduli(self) -> np.ndarray:
        """Return what the pressure adds to the moduli (e q, 6, 6), since d2 theta / dE2 = -2 C^-1 x C^-1."""
        (i, j), m = VOIGT.T, self.metric
        crossed = m[:, i[:, None], i] * m[:, j[:, None], j] + m[:, i[:, None], j] * m[:, j[:, None], i]
        return -self.moduli_factor * self._pressure(self.mean) * crossed

    def means(self, theta: np.ndarray) -> np.ndarray:
        """Return the means (e, r) of a dilatation (e q,)."""
        return (self.part @ theta.reshape(len(self.part), -1, 1))[..., 0]

    def foreseen(self, strain: np.ndarray) -> np.ndarray:
        """Return the stress (e q, 3, 3) that strains (e q, 3, 3) add."""
        return self.stress(self.means(np.einsum("pij,pij->p", self.metric, strain)))

    def _pressure(self, mean: np.ndarray) -> np.ndarray:
        return self.lame * (mean[:, None] @ self.part).reshape(-1, 1, 1)


class MeanDilatation:
    """The energy lame/2 theta^2 of the mean dilatation of all spans of a batch."""

    def __init__(
        self,
        lame: float,  # [Pa]
        logarithmic: bool,  # whether theta is ln det F; else the trace of Green's strain
        functions: np.ndarray,  # (q, r), at the points of a span
        weight: np.ndarray,  # (E, q), volumes of the points [m3]
    ) -> None:
        self.lame, self._logarithmic, self._functions = lame, logarithmic, functions
        gram = functions.T @ (weight[..., None] * functions)
        self._orthonormal = np.linalg.inv(np.linalg.cholesky(gram))  # (E, r, r)

    def at(
        self,
        spans: slice,
        weight: np.ndarray,  # (e q,), volumes of the points [m3]
        to_parent: np.ndarray,  # (e q, 3, 3), d xi / d x in the reference
        gradient: np.ndarray,  # (e q, 3, 3), of the displacement
        current: np.ndarray,  # (e q, 3, 3), covariant vectors in columns
    ) -> Dilatation:
        """Return the mean dilatation of a few spans."""
        orthonormal = self._orthonormal[spans]
        part = orthonormal @ self._functions.T
        part *= weight.reshape(len(part), 1, -1)
        trace = np.trace(gradient, axis1=1, axis2=2)
        if self._logarithmic:
            # det F - 1 of all its digits
            minors = 0.5 * (trace**2 - np.einsum("pij,pji->p", gradient, gradient))
            change = trace + minors + determinant(gradient)
            theta = np.log1p(np.where(change > -1, change, np.nan))
            back = inverse(current)[0]
            slope = np.swapaxes(back, 1, 2)
        else:
            theta = trace + 0.5 * np.einsum("pij,pij->p", gradient, gradient)
            back = to_parent
            slope = current @ back @ np.swapaxes(back, 1, 2)
        metric = back @ np.swapaxes(back, 1, 2)
        mean = (part @ theta.reshape(len(part), -1, 1))[..., 0]
        flux = weight[:, None, None] * slope
        return Dilatation(self.lame, part, mean, flux, orthonormal, metric, float(self._logarithmic))
