"""How the surface of a straight elastic cylinder yields to tractions, wave by wave, in closed form.

The cylinder is solid, of radius 1 and infinitely long. To a traction t exp(i (m theta + k z)) its surface answers with
the displacement G(m, k) t exp(i (m theta + k z)). With the harmonic f = I_m(k r) exp(i (m theta + k z)) / I_m(k) and
D = r d/dr, three solutions of Navier's equations that stay finite on the axis are

    grad f,    curl (f e_z),    grad (D f) + 4 (1 - nu) i k f e_z.

On the surface they and their tractions need I_m through D f / f = k I_m'(k) / I_m(k) alone, as D D f = (m^2 + k^2
r^2) f.
"""

from __future__ import annotations

import numpy as np


def surface_compliance(m: np.ndarray, k: np.ndarray, poisson_ratio: float) -> np.ndarray:
    """Return G (..., 3, 3) times E, in the components r, theta, z; Hermitian and positive.

    Parameters
    ----------
    m : ndarray of int, shape (...)
        Waves around.
    k : ndarray, shape (...)
        Waves along, times the radius; not 0.
    poisson_ratio : float
    """
    m, k = np.broadcast_arrays(m, np.asarray(k, dtype=float))
    rate = _logarithmic_slope(np.abs(m), np.abs(k))
    nu, zero = poisson_ratio, np.zeros(m.shape)
    im, ik, square = 1j * m, 1j * k, m**2 + k**2
    displacement = np.stack(
        [
            np.stack([rate, im, ik], -1),
            np.stack([im, -rate, zero], -1),
            np.stack([square, im * rate, ik * (rate + 4 * (1 - nu))], -1),
        ],
        axis=-1,
    )  # (..., component, solution)
    traction = np.stack(  # over 2 G
        [
            np.stack([square - rate, im * (rate - 1), ik * rate], -1),
            np.stack([im * (rate - 1), rate - m**2 - k**2 / 2, -m * k / 2], -1),
            np.stack(
                [
                    2 * (1 - nu) * k**2 + square * (rate - 1),
                    im * (square - rate),
                    ik * (square + 2 * (1 - nu) * rate),
                ],
                -1,
            ),
        ],
        axis=-1,
    )
    # E = 2 G (1 + nu)
    answer = np.linalg.solve(np.swapaxes(traction, -1, -2), np.swapaxes(displacement, -1, -2))
    return (1 + nu) * np.swapaxes(answer, -1, -2)


def _logarithmic_slope(m: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Return k I_m'(k) / I_m(k) = m + k I_(m+1)(k) / I_m(k), by the recurrence of that ratio from far above."""
    waves, place = np.unique(k, return_inverse=True)
    highest = int(m.max(initial=0))
    ratio = np.zeros(len(waves))
    ratios = np.empty((highest + 1, len(waves)))
    for order in range(highest + int(2 * waves.max(initial=0.0)) + 30, -1, -1):
        ratio = 1 / (2 * (order + 1) / waves + ratio)  # I_(order+1) / I_order
        if order <= highest:
            ratios[order] = ratio
    return m + k * ratios[m, place.reshape(k.shape)]
