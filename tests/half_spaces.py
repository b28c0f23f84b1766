"""Half spaces that touch, by Hertz and Mindlin: the limit of small patches of `laws.CrossedCylinders`."""

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from knitstudy.mechanics.beams.laws import Patch, Power


def overlap(law: Power, force: float) -> float:
    """Return the overlap at which a force acts [m]."""
    return (force / law.coefficient) ** (1 / law.exponent)


def hertz(
    youngs_modulus: float,  # [Pa]
    poisson_ratio: float,
    radius: float,  # of both [m]
) -> Power:
    """Return the approach of two equal cylinders that cross at a right angle (Johnson 1985, sections 4.1 and 7.2).

    F = 4/3 E* sqrt(R) delta^1.5 with E* = E / 2 (1 - nu^2), as of a sphere of radius R on a plane. Against elastic slip
    the same patch is 2 (1 - nu) / (2 - nu) as stiff (Mindlin 1949): hardly at all where yarns just touch, so that
    friction and rough contact begin and end without a jump.
    """
    contact_modulus = youngs_modulus / (2 * (1 - poisson_ratio**2))
    mindlin = 2 * (1 - poisson_ratio) / (2 - poisson_ratio)
    return Power(4 / 3 * contact_modulus * np.sqrt(radius), 1.5, mindlin, Patch(poisson_ratio))


def surface(x, y, k):
    """Height over R of the upper side of a yarn along x that bends upwards with kR = k, over the plane it touches."""
    # Of a torus: the distance from its circle of radius 1 / k about (0, 1 / k) in the plane of x and z is 1.
    if k == 0:
        return np.sqrt(1 - y**2) - 1
    inner = 1 / k - np.sqrt(1 - y**2)
    return 1 / k - np.sign(k) * np.sqrt(inner**2 - x**2) - 1


def curvatures(angle, bends, step=1e-3):
    """Principal values (2,) of the second derivatives of the gap of both surfaces, times R, and their axes."""

    def gap(x, y):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        return -surface(x, y, bends[0]) - surface(c * x + s * y, c * y - s * x, bends[1])

    i, j = step * np.eye(2)
    second = [
        [(gap(*(a + b)) - gap(*(a - b)) - gap(*(b - a)) + gap(*(-a - b))) / (4 * step**2) for a in (i, j)]
        for b in (i, j)
    ]
    return np.linalg.eigh(second)


def hertz_ellipse(flat, steep, depth, poisson_ratio):
    """Force over E, and semi-axes, of equal bodies of gap (flat x^2 + steep y^2) / 2 (Johnson 1985, section 4.2)."""

    def integrals(m):  # of the squared eccentricity
        return ellipk(m), ellipe(m), (1 - m) ** 0.5

    def misfit(m):
        K, E, ratio = integrals(m)
        return (E / ratio**2 - K) / (K - E) - steep / flat

    m = brentq(misfit, 1e-9, 1 - 1e-9) if steep / flat > 1 + 1e-6 else 1e-9
    K, E, ratio = integrals(m)
    # With p0 the largest pressure: A = flat / 2 = p0 b (K - E) / (E* m a^2), delta = p0 b K / E*, F = 2/3 pi p0 a b
    a = np.sqrt(2 * depth * (K - E) / (K * m * flat))
    return 2 / 3 * np.pi / (2 * (1 - poisson_ratio**2)) * depth * a / K, a, ratio * a


def stick_stiffness(a, b, poisson_ratio):
    """Force over slip and E (2,), along a and along b, of half spaces that stick over an ellipse (Mindlin 1949).

    The traction is Q / 2 pi a b (1 - x^2/a^2 - y^2/b^2)^(-1/2), which moves the middle
    by int q ((1 - nu) / r + nu x^2 / r^3) / 2 pi G.
    """
    nu, turn = poisson_ratio, np.linspace(0, np.pi, 4001)[:-1]
    reach = a * b / np.sqrt((b * np.cos(turn)) ** 2 + (a * np.sin(turn)) ** 2)
    means = (
        np.mean(np.pi / 2 * reach * (1 - nu + nu * along)) for along in (np.cos(turn) ** 2, np.sin(turn) ** 2)
    )
    return np.array([2 * np.pi * a * b / (2 * (1 + nu)) / (2 * mean) for mean in means])
