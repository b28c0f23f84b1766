"""Compliance of patches of load on the side of a straight elastic cylinder, in closed form."""

from __future__ import annotations

from functools import cache

import numpy as np

from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats, Ints

# Directions of load and displacement of a straight yarn, as its coordinates x1, x2 and s at the patch.
NORMAL, ACROSS, ALONG = range(3)

# Largest wave number that is summed up, over the inverse of the patch's radius: 0.02 % of the compliance of the
# mean are left out, 0.5 % of that of linear moments.
SHORTEST = 16.0
# Signs of moments, and of components, in the mirror that the normal and the yarn's axis span.
MIRROR = np.array([1, 1, -1])
WAVES = 4096  # waves at a time; bounds the memory


def polar_rule(rings: int) -> tuple[Floats, Floats]:
    """Return points (q, 2) and weights (q,) of the mean over the unit disc, on so many rings.

    Gauss points in the square of the radius and equal angles; exact for polynomials of degree 4 rings - 1.

    Examples
    --------
    >>> points, weights = polar_rule(2)
    >>> float(round(weights @ points[:, 0] ** 2, 12))  # mean of x^2 over the unit disc
    0.25
    """
    return disc.on_rings(rings, 4 * rings, 0.5 * (np.arange(rings)[:, None] % 2))


def moments(rule: Floats) -> Floats:
    """Return the functions (3, q) whose means over the disc are joined: 1, and both coordinates at unit mean square.

    Examples
    --------
    >>> moments(np.array([[0.5, 0.0]])).ravel().tolist()
    [1.0, 1.0, 0.0]
    """
    return np.stack([np.ones(len(rule)), 2 * rule[:, 0], 2 * rule[:, 1]])


def surface_compliance(
    m: Ints,  # (...), waves around
    k: np.ndarray,  # (...), waves along, times the radius; not 0
    poisson_ratio: float,
) -> np.ndarray:
    """Return G (..., 3, 3) times E, in the components r, theta, z; Hermitian and positive.

    To a traction t exp(i (m theta + k z)) the surface of a straight elastic cylinder of radius 1 answers with the
    displacement G t exp(i (m theta + k z)). With f = I_m(k r) exp(i (m theta + k z)) / I_m(k) and D = r d/dr, three
    solutions of Navier's equations that stay finite on the axis are

        grad f,    curl (f e_z),    grad (D f) + 4 (1 - nu) i k f e_z.

    As D D f = (m^2 + k^2 r^2) f, I_m enters through D f / f = k I_m'(k) / I_m(k) alone.

    Examples
    --------
    >>> k = 0.01  # long waves along the yarn stretch it: E u'' = -2 t
    >>> float(round(k**2 * surface_compliance(0, k, poisson_ratio=0.3)[2, 2].real, 3))
    2.0
    """
    m, k = np.broadcast_arrays(m, np.asarray(k, dtype=float))
    rate = _logarithmic_slope(np.abs(m), np.abs(k))
    nu = poisson_ratio
    zero = np.zeros(m.shape)
    im = 1j * m
    ik = 1j * k
    square = m**2 + k**2
    stretch = 2 * (1 - nu) * k**2
    turned = 2 * (1 - nu) * rate
    displacement = np.array(  # (solution, component, ...)
        [[rate, im, ik], [im, -rate, zero], [square, im * rate, ik * (rate + 4 * (1 - nu))]]
    )
    traction = np.array(  # over 2 G = E / (1 + nu)
        [
            [square - rate, im * (rate - 1), ik * rate],
            [im * (rate - 1), rate - m**2 - k**2 / 2, -m * k / 2],
            [stretch + square * (rate - 1), im * (square - rate), ik * (square + turned)],
        ]
    )
    last = (np.moveaxis(moments, (0, 1), (-2, -1)) for moments in (traction, displacement))
    return (1 + nu) * np.swapaxes(np.linalg.solve(*last), -1, -2)


def _logarithmic_slope(m: Ints, k: Floats) -> Floats:
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


# Compliance of a patch on the side of a yarn, beyond that of the yarn as a beam
# A patch of radius a on a straight yarn carries a force, spread evenly over it, and every A along the yarn another one
# of the opposite sign. The mean displacement of the patch is known in closed form, of the elastic cylinder
# (`surface_compliance`), and so is that of Timoshenko's beam with the force at the end of a rigid arm.
# Their difference is c_0 + c_1 A to within e^-A: c_0 is local, the indentation; c_1 goes with the bending moment, which
# changes the section under the patch. Beams with joints that yield by c_0 leave out c_1.

APART = (6.0, 12.0)  # distances of forces in radii, A: the one from the other gives c_0


@cache
def local_compliance(
    radius: float,  # of the patch, over that of the yarn
    poisson_ratio: float,
) -> tuple[float, float, float]:
    """Return c_0 along the normal, along the yarn and across both, times E R.

    Examples
    --------
    >>> round(float(local_compliance(0.3, 0.4)[0]), 3)
    1.212
    """
    near, far = (
        np.diag(cylinder_patch(radius, apart, poisson_ratio, 1)) - _beam_patch(radius, apart, poisson_ratio)
        for apart in APART
    )
    share = APART[0] / (APART[1] - APART[0])
    normal, along, across = (near + share * (near - far)).tolist()
    return normal, along, across


def _beam_patch(radius: float, apart: float, poisson_ratio: float) -> Floats:
    """Compliance (3,) of such forces on a beam, times E R: normal, along the yarn, across both."""
    _, along, weight = patch_rule(radius, rings=int(SHORTEST / 2) + 6)
    k = np.pi * np.arange(1, int(SHORTEST / radius * apart / np.pi) + 1, 2) / apart
    wave = np.abs(np.exp(-1j * k[:, None] * along) @ weight[0]) ** 2
    nu = poisson_ratio
    area = np.pi
    inertia = np.pi / 4
    shear = 0.5 / (1 + nu)
    per_shear = (7 + 14 * nu + 8 * nu**2) / (6 * (1 + nu) ** 2) / (shear * area)  # as `curved_rod`
    bent = 1 / (inertia * k**4) + per_shear / k**2
    # The arm, of length 1, turns with bending under a force along the yarn, with twist under one across it.
    stretched = 1 / (area * k**2) + 1 / (inertia * k**2)
    twisted = bent + 1 / (2 * shear * inertia * k**2)
    return 2 / apart * np.array([np.sum(wave * amplitude) for amplitude in (bent, stretched, twisted)])


def patch_rule(radius: float, rings: int) -> tuple[Floats, Floats, Floats]:
    """Return angle (q,), place along (q,) and weights (3, q) of the moments of a patch.

    The patch is the disc in the tangent plane, seen from the axis.
    """
    rule, weight = polar_rule(rings)
    along, across = radius * rule.T
    return np.arctan(across), along, moments(rule) * weight


@cache
def cylinder_patch(radius: float, apart: float, poisson_ratio: float, count: int = 3) -> Floats:
    """Return the compliance (3 count, 3 count) of the first moments of patches on a straight yarn, times E R."""
    largest = SHORTEST / radius
    angle, along, weight = patch_rule(radius, rings=int(SHORTEST / 2) + 6)
    k = np.pi * np.arange(1, int(largest * apart / np.pi) + 1, 2) / apart
    weight = weight[:count]
    size = 3 * count
    length = np.exp(-1j * along[:, None] * k)  # (q, k)
    parts = np.concatenate([weight * np.cos(angle), weight * np.sin(angle), weight])  # (part and moment, q)
    total = np.zeros((size, size))
    for m in np.array_split(np.arange(int(largest) + 1), 1 + int(largest) * len(k) // WAVES):
        around = np.exp(-1j * m[:, None] * angle)
        waves = ((around[:, None] * parts).reshape(-1, len(angle)) @ length).reshape(len(m), 3, count, len(k))
        load = np.zeros(
            (len(m), len(k), count, 3, 3), dtype=complex
        )  # moment, component of the force, r theta z
        cosine, sine, one = np.moveaxis(waves, 3, 1).transpose(2, 0, 1, 3)
        load[..., 0, 0] = cosine
        load[..., 0, 1] = -sine
        load[..., 1, 2] = one
        load[..., 2, 0], load[..., 2, 1] = sine, cosine
        loads = load.reshape(len(m), -1, size, 3)
        answer = loads @ np.swapaxes(surface_compliance(m[:, None], k, poisson_ratio), 2, 3)
        share = np.where(m == 0, 0.5, 1.0)[:, None, None, None]
        flat = np.moveaxis(share * loads, 2, 0).reshape(size, -1)
        total += np.real(flat.conj() @ np.moveaxis(answer, 2, 0).reshape(size, -1).T)
    # Waves of -k are the conjugates of the waves of k and -m; waves of -m are their mirror images.
    mirror = np.outer(MIRROR[:count], MIRROR).ravel()
    return (total + mirror[:, None] * total * mirror) / (np.pi * apart)
