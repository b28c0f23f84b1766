"""How a patch on the side of a yarn yields beyond what the yarn does as a beam.

A patch of radius a on a straight yarn carries a force, spread evenly over it, and every A along the yarn another one
of the opposite sign. The mean displacement of the patch is known in closed form, of the elastic cylinder
(`polynomial_yarn.patch_compliance`), and so is that of Timoshenko's beam with the force at the end of a rigid arm.
Their difference is c_0 + c_1 A to within e^-A: c_0 is local, the indentation; c_1 goes with the bending moment, which
widens and narrows the section under the patch. Beams with joints that yield by c_0 leave out c_1.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from knitstudy.mechanics.polynomial_yarn.patch_compliance import SHORTEST, cylinder_patch, patch_rule

APART = (6.0, 12.0)
"""Distances of forces in radii, A: the one from the other gives c_0."""


@cache
def local_compliance(radius: float, poisson_ratio: float) -> tuple[float, float, float]:
    """Return c_0 along the normal, along the yarn and across both, times E R.

    Parameters
    ----------
    radius : float
        Of the patch, over that of the yarn.
    poisson_ratio : float
    """
    near, far = (
        np.diag(cylinder_patch(radius, apart, poisson_ratio))[:3] - _beam_patch(radius, apart, poisson_ratio)
        for apart in APART
    )
    share = APART[0] / (APART[1] - APART[0])
    return tuple(float(each) for each in near + share * (near - far))


def _beam_patch(radius: float, apart: float, poisson_ratio: float) -> np.ndarray:
    """Compliance (3,) of such forces on a beam, times E R: normal, along the yarn, across both."""
    _, along, weight = patch_rule(radius, rings=int(SHORTEST / 2) + 6)
    k = np.pi * np.arange(1, int(SHORTEST / radius * apart / np.pi) + 1, 2) / apart
    wave = np.abs(np.exp(-1j * k[:, None] * along) @ weight[0]) ** 2
    nu = poisson_ratio
    area, inertia, shear = np.pi, np.pi / 4, 0.5 / (1 + nu)
    per_shear = (7 + 14 * nu + 8 * nu**2) / (6 * (1 + nu) ** 2) / (shear * area)  # as `curved_rod`
    bent = 1 / (inertia * k**4) + per_shear / k**2
    # The arm, of length 1, turns with bending under a force along the yarn, with twist under one across it.
    stretched = 1 / (area * k**2) + 1 / (inertia * k**2)
    twisted = bent + 1 / (2 * shear * inertia * k**2)
    return 2 / apart * np.array([np.sum(wave * each) for each in (bent, stretched, twisted)])
