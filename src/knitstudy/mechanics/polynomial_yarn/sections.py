"""Places and their derivatives at the same points of many sections of one yarn: sums along it first, then across."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.polynomial_yarn import disc
from knitstudy.mechanics.polynomial_yarn.space import YarnSpace


def sections(
    yarn: YarnSpace, nodes: np.ndarray, s: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return values (k, q, 3) and derivatives (k, q, 3, 3), the last axis by x1, x2 [m] and s, of nodes of a yarn.

    Parameters
    ----------
    yarn : YarnSpace
    nodes : ndarray, shape (n, 3)
        Of this yarn: places or displacements [m].
    s : ndarray, shape (k,)
        Arc lengths of the sections [m].
    x : ndarray, shape (q, 2)
        Points in a section, over the radius.
    """
    k = np.arange(yarn.stride)
    there = k < np.diff(yarn.first_node)[:, None]
    coefficients = np.where(there[..., None], nodes[np.where(there, yarn.first_node[:-1, None] + k, 0)], 0.0)
    first, along = yarn.spline.basis(s, orders=1)
    here = coefficients[first[:, None] + np.arange(along.shape[2])]  # (k, d + 1, n_p, 3)
    value, slope = np.einsum("okj,kjni->okni", along, here, optimize=True)
    phi, gradient = disc.gradients(yarn.degree, x)
    across = np.moveaxis(gradient, -1, 0)[:, None] @ value  # (2, k, q, 3)
    return phi @ value, np.stack([*across, phi @ slope], axis=-1)


def deformation_gradient(slope: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return F (..., 3, 3) from the derivatives of undeformed places and of displacements that `sections` gives."""
    return np.eye(3) + change @ np.linalg.inv(slope)
