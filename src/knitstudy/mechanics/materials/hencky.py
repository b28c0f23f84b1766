"""Hencky's law: linear between logarithmic strain and its stress."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.materials.material import VOIGT, Stress, law


@law("hencky", "linear in logarithmic strain")
def hencky(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu sum(ln lambda_a)^2 + lame/2 (ln J)^2, in principal stretches (Ogden 1997, section 6.1.4).

    Differences of nearly equal stretches are divided through ``log1p``, so that neither small strains nor
    repeated stretches lose digits.
    """
    values, axes = np.linalg.eigh(strain)  # (e, 3), (e, 3, 3) with columns N_a
    square = 1 + 2 * values  # squared stretches
    logs = 0.5 * np.log1p(2 * values)
    volume = logs.sum(axis=1)
    energy = mu * (logs**2).sum(axis=1) + 0.5 * lame * volume**2
    principal = (2 * mu * logs + lame * volume[:, None]) / square
    stress = (axes * principal[:, None, :]) @ np.swapaxes(axes, 1, 2)
    if not tangent:
        return Stress(energy, stress, None)
    p, q = VOIGT[3:].T
    first, second = square[:, p], square[:, q]
    ratio = (first - second) / second
    ratio[ratio == 0] = np.finfo(float).tiny  # the quotient below is 1 there
    shear = (mu * np.log1p(ratio) / ratio - 2 * mu * logs[:, q] - lame * volume[:, None]) / (first * second)
    normal = lame / (square[:, :, None] * square[:, None, :])
    a = np.arange(3)
    normal[:, a, a] += (2 * mu - 2 * square * principal) / square**2
    rotation = rotate_strain(axes)
    half = np.empty_like(rotation)
    np.matmul(normal, rotation[:, :3], out=half[:, :3])
    np.multiply(shear[:, :, None], rotation[:, 3:], out=half[:, 3:])
    return Stress(energy, stress, np.swapaxes(rotation, 1, 2) @ half)


def rotate_strain(axes: np.ndarray) -> np.ndarray:
    """Return the matrices (e, 6, 6) that take engineering strains to the axes (e, 3, 3) in columns."""
    i, j = VOIGT.T
    # Component (p, q) in the axes is sum over I, J of N_Ip E_IJ N_Jq, with E_IJ = gamma_IJ / 2 off the diagonal.
    left = axes[:, i[None, :], i[:, None]] * axes[:, j[None, :], j[:, None]]
    right = axes[:, j[None, :], i[:, None]] * axes[:, i[None, :], j[:, None]]
    rotation = 0.5 * (left + right)
    rotation[:, 3:] *= 2
    return rotation
