"""An endless knit as a shell: its stiffness in other axes and planes, and the moduli that follow from it.

N = A e + B k and M = B^T e + D k with the strains of `knitstudy.mechanics.periodic`; the stiffness (6, 6) is [[A, B],
[B^T, D]], in N/m, N and N m. Jones 1999, Mechanics of Composite Materials, chapters 2 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def rotated(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """Return the stiffness (6, 6) of the shell turned in its plane by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    strains = np.array(
        [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    )  # in the axes of the shell, from those in space
    turn = np.kron(np.eye(2), strains)
    return turn.T @ stiffness @ turn


def referred(stiffness: np.ndarray, height: float) -> np.ndarray:
    """Return the stiffness (6, 6) about a plane that lies higher by `height` [m]."""
    # The old plane is strained by e - k height.
    shift = np.eye(6) - height * np.eye(6, k=3)
    return shift.T @ stiffness @ shift


@dataclass(frozen=True)
class Moduli:
    """Moduli of a sheet that is free in all other components.

    Attributes
    ----------
    course, wale, shear : float
        Force per width over strain [N/m].
    contraction_of_course, contraction_of_wale : float
        Poisson's ratios: contraction across a pull in course and in wale direction, over the strain along it.
    """

    course: float
    wale: float
    shear: float
    contraction_of_course: float
    contraction_of_wale: float


def moduli(membrane: np.ndarray) -> Moduli:
    """Return the moduli from forces per width by strains in the plane (3, 3) [N/m]."""
    compliance = np.linalg.inv(membrane)
    along = np.diag(compliance)
    return Moduli(*(1 / along), -compliance[1, 0] / along[0], -compliance[0, 1] / along[1])
