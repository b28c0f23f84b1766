"""Capstan: a rod slides around a rigid rod of its own radius, and an elastic rod around a rigid ring."""

import numpy as np
from book import Page, slender
from scipy.optimize import brentq, fsolve
from shapes import evenly

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods


def growth(mu, radius):
    """Return the growth of the tension with the angle, of a rope of unit radius bent to a radius (Singh 2022).

    Friction acts at the surface: it pulls at a smaller radius, and its couple makes a shear force Q = mu p / radius,
    so that T' = mu p (1 - 1 / radius) and p = T - Q'.
    """
    return brentq(lambda x: x - mu * (1 - 1 / radius) / (1 + mu * x / radius), 0, 1)


def elastic(mu, radius, tension):
    """Return T2 / T1 over half a turn of a rod with B = 1 that slides with the dead force T1 at one end.

    On the drum the bending moment is constant. Where the rod leaves the drum by an angle a it carries a point force P,
    friction mu P and the couple of that; beyond it is an elastica: M^2 / 2 = T (1 - cos a), shear force T sin a.
    """
    rate, h = growth(mu, radius), 1.0

    def shear(T):  # of the couple of friction on the drum
        return h * mu * T / (1 + mu * rate / radius) / radius

    def residual(x):
        (a, b), (P, N), T = x[:2], x[2:4], x[4]
        before = tension * np.cos(a) + mu * P
        after = T * np.cos(b) - mu * N
        return [
            (1 / radius + h * mu * P) ** 2 / 2 - tension * (1 - np.cos(a)),
            (1 / radius - h * mu * N) ** 2 / 2 - T * (1 - np.cos(b)),
            P - tension * np.sin(a) + shear(before),
            N - T * np.sin(b) - shear(after),
            after - before * np.exp(rate * (np.pi - a - b)),
        ]

    a = 1 / radius / np.sqrt(tension)
    guess = [a, a, tension * a, tension * a, tension * np.exp(rate * np.pi)]
    return fsolve(residual, guess, xtol=1e-12)[4] / tension


def around(radius, spacing):
    """Return nodes of a rope of unit radius around half a circle, with straight ends."""
    turn = np.linspace(0, np.pi, 4001)
    arc = radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    down = np.linspace(0, 3 * radius, 2001)[1:, None] * [0, -1.0, 0]
    curve = np.concatenate([(arc[0] + down)[::-1], arc, arc[-1] + down])
    return evenly(curve, round((np.pi + 6) * radius / spacing))


def slid(rods, way, tension):
    """Return T2 / T1 after one end of the first rod has been pulled by `way` against a dead force T1 at the other."""
    last = rods.numbers[0][-1]
    ends = {int(k): End(move=(np.nan, np.nan, 0), turn=(0, 0, np.nan)) for k in rods.numbers[0]}
    ends |= dict.fromkeys(rods.numbers[1], CLAMPED)
    ends[0] = End(move=(np.nan, np.nan, 0), turn=(0, 0, np.nan), force=(0, -tension, 0))
    *_, tight = rods.path(ends | {last: ends[0]}, steps=4)
    *_, end = rods.path(
        ends | {last: End(move=(np.nan, -way, 0), turn=(0, 0, np.nan))}, steps=10, start=tight
    )
    return -end.support[last, 1] / tension


def main(meshes=(0.25, 0.125), picture=None):
    """Compare the ratio of tensions over half a turn with closed forms.

    `meshes` are lengths of elements over the radius of rods that are alike; around the ring four times that.
    """
    page, ratio = Page("capstan", picture), "T2/T1 over 180 degrees"
    angle = np.linspace(-0.3, np.pi + 0.3, 81)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    post = np.linspace(-3, 3, 49)[:, None] * [0, 0, 1.0]
    for mu, bar in ((0.1, 0.03), (0.3, 0.03), (0.5, 0.05)):
        bracket, known = [], np.exp(growth(mu, 2.0) * np.pi)
        for size in meshes:
            curves = [around(2.0, size), post]
            rods = Rods(curves, 1.0, slender(1.0, soft=1e3), Power(0.4), mu, natural=0.0)
            bracket.append(slid(rods, 0.3, 4e-3))
        page.compare(ratio, f"mu {mu:g}, a cord around a rod alike", known, bracket, bar)
    radius, tension = 20.0, 4 / 20.0**2
    for mu in (0.1, 0.3):
        bracket, known = [], elastic(mu, radius, tension)
        for size in meshes:
            curves = [around(radius, 4 * size), (radius - 2) * ring]
            rods = Rods(curves, 1.0, slender(1.0), Power(0.05), mu, natural=0.0, per_node=4)
            bracket.append(slid(rods, 2.0, tension))
        page.compare(ratio, f"mu {mu:g}, T1 r^2/B 4, r/h 20", known, bracket, 0.03)
    fine = np.linspace(0, 0.5, 26)
    thick = [np.exp(growth(mu, 2.0) * np.pi) for mu in fine]
    page.axes.plot(fine, thick, label="cord around its own radius (Singh)")
    page.axes.plot(fine, [elastic(mu, radius, tension) for mu in fine], label="rod, T1 r²/B = 4, r/h = 20")
    page.axes.plot(fine, np.exp(fine * np.pi), "k:", label="Euler")
    page.axes.plot([0.1, 0.3, 0.5], [row["here"] for row in page.rows[:3]], "C0o")
    page.axes.plot([0.1, 0.3], [row["here"] for row in page.rows[3:]], "C1s")
    return page.finish("friction mu", "T2/T1")


if __name__ == "__main__":
    main()
