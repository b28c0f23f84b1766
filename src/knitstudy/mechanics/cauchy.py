"""Cauchy stress, and the scalars that are drawn of it."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.materials import Material


def cauchy_stress(gradient: np.ndarray, material: Material) -> np.ndarray:
    """Return the Cauchy stress (k, 3, 3) [Pa], F S F^T / det F, of deformation gradients F (k, 3, 3)."""
    green = 0.5 * (np.swapaxes(gradient, 1, 2) @ gradient - np.eye(3))
    stress = material.respond(green, False).stress
    return gradient @ stress @ np.swapaxes(gradient, 1, 2) / np.linalg.det(gradient)[:, None, None]


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return sqrt(3/2 s : s) (k,) of the deviators s of stresses (k, 3, 3)."""
    mean = np.einsum("kii->k", stress) / 3
    deviator = stress - mean[:, None, None] * np.eye(3)
    return np.sqrt(1.5 * np.einsum("kij,kij->k", deviator, deviator))


def principal_stresses(stress: np.ndarray) -> np.ndarray:
    """Return the principal values (k, 3) of stresses (k, 3, 3), the largest first."""
    return np.linalg.eigvalsh(stress)[:, ::-1]


def principal_axes(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal values (..., 3) of stresses (..., 3, 3), the largest first, and their axes as rows.

    Axes are lines: their sign means nothing.
    """
    values, columns = np.linalg.eigh(stress)
    return values[..., ::-1], np.swapaxes(columns, -1, -2)[..., ::-1, :]
