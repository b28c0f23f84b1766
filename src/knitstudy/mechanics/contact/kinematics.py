"""How gap, normal and convected coordinates of a contact point change with the motion of both surfaces.

All changes are linear in z = (e, a_1, a_2), nine numbers a point: e = Dx - Dy at fixed xi, and a_a = Dy,_a. In terms
of the nodal displacements, z = V Du with the rows [N, -M], [0, M,_1], [0, M,_2] of V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.contact.projection import Projection


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Derivatives with respect to z = (e, a_1, a_2), flattened to nine columns.

    Attributes
    ----------
    xi : ndarray, shape (k, 2, 9)
        Dxi = A^-1 (tau . e + g n . a), A = m - g k with the distance g.
    gap : ndarray, shape (k, 9)
        Dg = n . e.
    tangent : ndarray, shape (k, 2, 3, 9)
        Dtau_a = a_a + y,_ab Dxi^b.
    normal : ndarray, shape (k, 3, 9)
        Dn = -tau^a (n . Dtau_a).
    """

    xi: np.ndarray
    gap: np.ndarray
    tangent: np.ndarray
    normal: np.ndarray

    @classmethod
    def of(cls, projection: Projection) -> Kinematics:
        """Return the derivatives at closest points."""
        tangent, normal, distance = projection.tangent, projection.normal, projection.distance
        k = len(normal)
        metric = np.einsum("kai,kbi->kab", tangent, tangent)
        bend = np.einsum("kai,ki->ka", projection.curvature, normal)
        inverse = _inverse(metric - distance[:, None, None] * bend[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
        pull = np.zeros((k, 2, 9))  # tau_a . e + g n . a_a
        pull[:, :, :3] = tangent
        pull[:, 0, 3:6] = pull[:, 1, 6:9] = distance[:, None] * normal
        xi = inverse @ pull
        gap = np.zeros((k, 9))
        gap[:, :3] = normal
        second = projection.curvature[:, [0, 1, 1, 2]].reshape(k, 2, 2, 3)
        turned = np.einsum("kabi,kbz->kaiz", second, xi)
        turned[:, 0, :, 3:6] += np.eye(3)
        turned[:, 1, :, 6:9] += np.eye(3)
        dual = _inverse(metric) @ tangent
        tilt = np.einsum("ki,kaiz->kaz", normal, turned)
        return cls(xi=xi, gap=gap, tangent=turned, normal=-np.einsum("kai,kaz->kiz", dual, tilt))


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the inverses of symmetric matrices (k, 2, 2)."""
    determinant = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] ** 2
    inverse = -matrix
    inverse[:, [0, 1], [0, 1]] = matrix[:, [1, 0], [1, 0]]
    return inverse / determinant[:, None, None]
