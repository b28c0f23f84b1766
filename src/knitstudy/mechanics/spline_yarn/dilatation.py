"""Mean dilatation of spans, which keeps low degrees over the section from locking as Poisson's ratio nears 1/2.

The energy lame/2 theta^2 of the dilatation theta = ln det F is that of its mean over a span: the projection, in the L2
norm of the undeformed span, onto functions M_r that are polynomials of degree p - 1 over the section and constant
along the yarn,

    theta_r = int M_r theta dV,   int M_r M_s dV = delta_rs,   W = lame/2 sum over r of theta_r^2,

a B-bar and F-bar projection (Elguedj et al. 2008, doi:10.1016/j.cma.2008.01.012) span by span. Displacements of degree
p over the section have every divergence of degree p - 1, so that no strain along the yarn is locked there; along it,
means ask one thing of each span, and splines have one unknown to answer it. The rest of the law, with a first Lame
constant of zero, resists every strain with twice the shear modulus: no mode becomes soft. The mean pressure
lame sum of theta_r M_r acts pointwise; the products lame d theta_r d theta_r are the rest of the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.batches import determinant, inverse


@dataclass(frozen=True, eq=False)
class Dilatation:
    """The mean dilatation of a few spans in one configuration."""

    deformation: np.ndarray  # (3, 3, points), F
    volume_ratio: np.ndarray  # (points,), det F
    slope: np.ndarray  # (3, 3, points), d theta / d F
    pressure: np.ndarray  # (points,), of the means [Pa]
    energy: np.ndarray  # (e,), stored [J]


class MeanDilatation:
    """The energy lame/2 theta^2 of the mean dilatation of all spans of a batch; tensors have their components first."""

    def __init__(
        self,
        lame: float,  # [Pa]
        logarithmic: bool,  # whether theta is ln det F; else the trace of Green's strain
        functions: np.ndarray,  # (m, r), at the points of a section
        weight: np.ndarray,  # (m, E, g), volumes of the points [m3]
    ) -> None:
        self.lame, self._logarithmic = lame, logarithmic
        self._functions, self._weight = functions, weight
        gram = functions.T @ (weight.sum(axis=2).T[..., None] * functions)
        self.orthonormal = np.linalg.inv(np.linalg.cholesky(gram))  # (E, r, r), from given functions to M_r

    def at(self, spans: slice, gradient: np.ndarray) -> Dilatation:
        """Return the mean dilatation of a few spans with displacement gradients (3, 3, points)."""
        deformation = gradient + np.eye(3)[..., None]
        trace = np.einsum("iip->p", gradient)
        if self._logarithmic:
            # det F - 1 of all its digits
            minors = 0.5 * (trace**2 - np.einsum("ijp,jip->p", gradient, gradient))
            change = trace + minors + determinant(gradient.transpose(2, 0, 1))
            theta = np.log1p(np.where(change > -1, change, np.nan))
            back, ratio = inverse(deformation.transpose(2, 0, 1))
            slope = back.transpose(2, 1, 0)
        else:
            theta = trace + 0.5 * np.einsum("ijp,ijp->p", gradient, gradient)
            slope, ratio = deformation, determinant(deformation.transpose(2, 0, 1))
        mean = self._means(spans, theta)
        energy = 0.5 * self.lame * (mean**2).sum(axis=1)
        return Dilatation(deformation, ratio, slope, self._pressure(spans, mean), energy)

    def added_stress(self, spans: slice, slope: np.ndarray, strain: np.ndarray) -> np.ndarray:
        """Return the stress (3, 3, points) that strains (3, 3, points) add."""
        metric = np.broadcast_to(np.eye(3)[..., None], strain.shape)  # d theta / d E
        if self._logarithmic:
            metric = np.einsum("kip,kjp->ijp", slope, slope)
        mean = self._means(spans, np.einsum("ijp,ijp->p", metric, strain))
        return self._pressure(spans, mean) * metric

    def _means(self, spans: slice, theta: np.ndarray) -> np.ndarray:
        """Return theta_r (e, r)."""
        m, e, g = self._weight[:, spans].shape
        sums = self._functions.T @ (self._weight[:, spans].reshape(m, -1) * theta.reshape(m, -1))
        return (self.orthonormal[spans] @ sums.reshape(-1, e, g).sum(axis=2).T[..., None])[..., 0]

    def _pressure(self, spans: slice, mean: np.ndarray) -> np.ndarray:
        of_given = (mean[:, None] @ self.orthonormal[spans])[:, 0]
        return np.repeat(self.lame * (self._functions @ of_given.T), self._weight.shape[2], axis=1).reshape(
            -1
        )
