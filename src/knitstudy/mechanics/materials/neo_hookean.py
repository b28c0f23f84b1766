"""A neo-Hookean law."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.materials.material import VOIGT, Stress, law


@law("neo_hookean", "of rubber")
def neo_hookean(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu/2 (tr C - 3) - mu ln J + lame/2 (ln J)^2 (Bonet and Wood 2008, section 6.4.3)."""
    c = np.eye(3) + 2 * strain
    inverse = np.linalg.inv(c)
    log_j = 0.5 * np.log(np.linalg.det(c))
    trace = np.trace(strain, axis1=1, axis2=2)
    energy = mu * (trace - log_j) + 0.5 * lame * log_j**2
    # I - C^-1 = 2 C^-1 E keeps its digits at small strains.
    stress = 2 * mu * inverse @ strain + (lame * log_j)[:, None, None] * inverse
    stress = 0.5 * (stress + np.swapaxes(stress, 1, 2))
    if not tangent:
        return Stress(energy, stress, None)
    i, j = VOIGT.T
    dyad = inverse[:, i, j][:, :, None] * inverse[:, i, j][:, None, :]
    first = inverse[:, i[:, None], i] * inverse[:, j[:, None], j]
    second = inverse[:, i[:, None], j] * inverse[:, j[:, None], i]
    moduli = lame * dyad + (mu - lame * log_j)[:, None, None] * (first + second)
    return Stress(energy, stress, moduli)
