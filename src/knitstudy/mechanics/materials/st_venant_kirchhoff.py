"""St Venant-Kirchhoff's law: linear between Green's strain and its stress."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.materials.material import Stress, law


@law(
    "st_venant_kirchhoff",
    "linear in Green's strain",
)
def st_venant_kirchhoff(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu E:E + lame/2 (tr E)^2. Softens in compression: for comparison below 1% strain or with CalculiX."""
    trace = np.trace(strain, axis1=1, axis2=2)
    energy = mu * np.einsum("eij,eij->e", strain, strain) + 0.5 * lame * trace**2
    stress = 2 * mu * strain + lame * trace[:, None, None] * np.eye(3)
    constant = np.broadcast_to(linear_stiffness(mu, lame), (len(strain), 6, 6)) if tangent else None
    return Stress(energy, stress, constant)


def linear_stiffness(mu: float, lame: float) -> np.ndarray:
    """Return the stiffness (6, 6) of small strains [Pa]."""
    stiffness = np.diag([2 * mu] * 3 + [mu] * 3).astype(float)
    stiffness[:3, :3] += lame
    return stiffness
