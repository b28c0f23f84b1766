"""Buckling and post-buckling of a clamped column: Euler's load, and the elastica of its shortened shape."""

import numpy as np
from book import Page, slender
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from shapes import evenly, straight

from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods

EULER = 4 * np.pi**2  # critical load L^2 / B of a column between clamps


def elastica(shortening):
    """Return load L^2 / B of a clamped inextensible column shortened by a share of its length (Love 1927, 263).

    A quarter of it is an elastica of modulus k: load 16 K^2, length along the load 2 E / K - 1.
    """
    m = brentq(lambda m: 2 - 2 * ellipe(m) / ellipk(m) - shortening, 1e-9, 0.95)
    return 16 * ellipk(m) ** 2


def main(meshes=(32, 64), picture=None):
    """Compare Euler's load and the load after 15 to 40 % of shortening with the elastica.

    `meshes` are numbers of elements.
    """
    page, ways, euler, load = Page("column between clamps", picture), (0.15, 0.2, 0.3, 0.4), [], []
    for count in meshes:
        rods = Rods([straight(1.0, count)], 1e-3, slender(1e-3))
        # Eigenvalue of the tangent under a dead load: zero at Euler's load, linear in between.
        sliding = (np.nan, 0, 0)
        press = {0: CLAMPED, count: End(move=sliding, force=(-0.999 * EULER, 0, 0))}
        low = [each.lowest_stiffness for each in rods.path(press, steps=2, stops=(0.9,))][-2:]
        euler.append(0.999 * EULER * (0.9 + 0.1 * low[0] / (low[0] - low[1])))
        # Drawn as a wave and straight if nothing held it; then its ends come nearer.
        x = np.linspace(0, 1, 4001)
        wave = np.column_stack([x, 0.125 * (1 - np.cos(2 * np.pi * x)), 0 * x])
        drawn = evenly(wave, count)
        drawn /= np.linalg.norm(np.diff(drawn, axis=0), axis=1).sum()
        rods, first = Rods([drawn], 1e-3, slender(1e-3), natural=0.0), 1 - drawn[-1, 0]
        *_, bent = rods.path({0: CLAMPED, count: CLAMPED}, steps=2)
        press, stops = (
            {0: CLAMPED, count: End(move=(first - ways[-1], 0, 0))},
            (np.array(ways) - first) / (ways[-1] - first),
        )
        path = list(rods.path(press, 8, bent, tuple(stops[:-1])))
        load.append([-each.support[count, 0] for each in path if np.isclose(each.load, stops).any()])
    page.compare("critical load L^2/B", "eigenvalue", EULER, euler, 0.005)
    for number, way in enumerate(ways):
        page.compare(
            "load L^2/B", f"shortened by {way:g}", elastica(way), [each[number] for each in load], 0.01
        )
    fine = np.linspace(0.001, 0.45, 50)
    page.axes.plot(fine, [elastica(each) for each in fine], label="elastica")
    page.axes.plot(ways, load[-1], "o", label=f"{meshes[-1]} elements")
    return page.finish("shortening over length", "load L²/B")


if __name__ == "__main__":
    main()
