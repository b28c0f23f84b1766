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
from functools import cached_property

import numpy as np

from knitstudy.mechanics.batches import determinant, inverse


@dataclass(frozen=True, eq=False)
class Dilatation:
    """The mean dilatation of a few spans in one configuration."""

    lame: float  # [Pa]
    functions: np.ndarray  # (m, r), given, at the points of a section
    orthonormal: np.ndarray  # (e, r, r), from these to M_r
    weight: np.ndarray  # (m, e, g), volumes of the points [m3]
    logarithmic: bool  # ln det F, or else tr E
    theta: np.ndarray  # (points,)
    deformation: np.ndarray  # (3, 3, points), F
    volume_ratio: np.ndarray  # (points,), det F
    slope: np.ndarray  # (3, 3, points), d theta / d F

    @cached_property
    def mean(self) -> np.ndarray:
        """theta_r (e, r)."""
        return self._means(self.theta)

    @property
    def pressure(self) -> np.ndarray:
        """Of the means, at the points [Pa]."""
        return self._pressure(self.mean)

    @property
    def energy(self) -> np.ndarray:
        """Stored energy (e,) [J]."""
        return 0.5 * self.lame * (self.mean**2).sum(axis=1)

    def foreseen(self, strain: np.ndarray) -> np.ndarray:
        """Return the stress (3, 3, points) that strains (3, 3, points) add."""
        metric = np.broadcast_to(np.eye(3)[..., None], strain.shape)  # d theta / d E
        if self.logarithmic:
            metric = np.einsum("kip,kjp->ijp", self.slope, self.slope)
        return self._pressure(self._means(np.einsum("ijp,ijp->p", metric, strain))) * metric

    def _means(self, theta: np.ndarray) -> np.ndarray:
        m, e, g = self.weight.shape
        sums = self.functions.T @ (self.weight.reshape(m, -1) * theta.reshape(m, -1))
        sums = sums.reshape(-1, e, g).sum(axis=2).T
        return (self.orthonormal @ sums[..., None])[..., 0]

    def _pressure(self, mean: np.ndarray) -> np.ndarray:
        of_given = (mean[:, None] @ self.orthonormal)[:, 0]
        return np.repeat(self.lame * (self.functions @ of_given.T), self.weight.shape[2], axis=1).reshape(-1)


class MeanDilatation:
    """The energy lame/2 theta^2 of the mean dilatation of all spans of a batch."""

    def __init__(
        self,
        lame: float,  # [Pa]
        logarithmic: bool,  # whether theta is ln det F; else the trace of Green's strain
        functions: np.ndarray,  # (m, r), at the points of a section
        weight: np.ndarray,  # (m, E, g), volumes of the points [m3]
    ) -> None:
        self._lame, self._logarithmic, self._functions = lame, logarithmic, functions
        gram = functions.T @ (weight.sum(axis=2).T[..., None] * functions)
        self._orthonormal = np.linalg.inv(np.linalg.cholesky(gram))  # (E, r, r)

    def at(self, spans: slice, weight: np.ndarray, gradient: np.ndarray) -> Dilatation:
        """Return the mean dilatation of a few spans: weights (m, e, g), displacement gradients (3, 3, points)."""
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
        return Dilatation(
            self._lame,
            self._functions,
            self._orthonormal[spans],
            weight,
            self._logarithmic,
            theta,
            deformation,
            ratio,
            slope,
        )
