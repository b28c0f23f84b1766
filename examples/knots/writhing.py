"""Writhing of a rod between clamps under twist and tension: the moment at which it leaves its straight shape."""

import numpy as np
from book import Page, slender
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from shapes import straight

from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods


def critical_moment(tension):
    """Return the smallest M L / B at a tension T L^2 / B between clamps that may come nearer (Love 1927, 272).

    The deflection w = y + i z has B w'''' - i M w''' - T w'' = 0 with w = w' = 0 at both ends: c_0 + c_1 s + c_2
    exp(i p s) + c_3 exp(i q s) with p, q = (M +- sqrt(M^2 - 4 B T)) / 2 B. Turned by the mean of p and q, the
    determinant of the four conditions is imaginary.
    """

    def determinant(M):
        d = np.sqrt(M**2 - 4 * tension)
        p, q = 0.5 * (M + d), 0.5 * (M - d)
        p_end, q_end = np.exp(1j * p), np.exp(1j * q)
        rows = [
            [1, 0, 1, 1],
            [0, 1, 1j * p, 1j * q],
            [1, 1, p_end, q_end],
            [0, 1, 1j * p * p_end, 1j * q * q_end],
        ]
        return float(np.imag(np.linalg.det(rows) * np.exp(-0.5j * M)) / d)

    M = 2 * np.sqrt(tension) + 1e-6 + np.linspace(0.0, 20.0, 4001)
    sign = np.sign([determinant(each) for each in M])
    first = int(np.flatnonzero(np.diff(sign))[0])
    return brentq(determinant, M[first], M[first + 1])


def main(meshes=(48, 96), picture=None):
    """Compare the moment at which the lowest eigenvalue of the tangent vanishes with the linear theory.

    `meshes` are numbers of elements.
    """
    page, tensions, radius = Page("writhing", picture), (10.0, 50.0, 200.0, 400.0), 1e-3
    section, found = slender(radius), []
    for tension in tensions:
        known, bracket = critical_moment(tension), []
        for count in meshes:
            rods = Rods([straight(1.0, count)], radius, section)
            pull = {0: CLAMPED, count: End(move=(np.nan, 0, 0), force=(tension, 0, 0))}
            *_, pulled = rods.path(pull, steps=1)
            turn = 1.3 * known / section.GJ
            twist = {0: CLAMPED, count: End(move=(np.nan, 0, 0), turn=(turn, 0, 0), force=(tension, 0, 0))}
            path = [(each.support[count, 3], each.lowest_stiffness) for each in rods.path(twist, 12, pulled)]
            moment, lowest = np.array(path).T
            bracket.append(float(CubicSpline(moment, lowest).roots(extrapolate=False)[0]))
        found.append(bracket[-1])
        page.compare("critical moment M L/B", f"T L^2/B = {tension:g}", known, bracket, 0.03)
    fine = np.geomspace(5, 1000, 60)
    page.axes.semilogx(fine, [critical_moment(each) for each in fine], label="clamped (Love)")
    page.axes.semilogx(fine, 2 * np.sqrt(fine), "--", label="2 √(B T), long (Greenhill)")
    page.axes.semilogx(tensions, found, "o", label=f"{meshes[-1]} elements")
    return page.finish("tension T L²/B", "twisting moment M L/B")


if __name__ == "__main__":
    main()
