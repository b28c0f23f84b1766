"""Hertz' contact of rods that cross at any angle, and Mindlin's cycle of a shear that points along no axis."""

import numpy as np
from book import Page, slender
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from knitstudy.mechanics.beams.laws import Patch, Power
from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods

MODULUS, POISSON, DEEP, MU = 1.0, 0.3, 0.002, 0.3  # of rods of unit radius; approach


def hertz(angle):
    """Return the force of rods that cross at an angle [degrees] and approach by DEEP (Johnson 1985, section 4.2)."""
    c = np.cos(np.radians(angle))
    A, B = (1 - c) / 2, (1 + c) / 2  # of the gap A x^2 + B y^2 of surfaces of curvature 1

    def ratio(m):
        return (ellipe(m) / (1 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - B / A

    m = brentq(ratio, 1e-9, 1 - 1e-9) if angle < 90 else 1e-9
    # p_0 = 3 F / 2 pi a b; DEEP = p_0 b K / E*, A = p_0 b / (E* e^2 a^2) (K - E), b^2 = (1 - m) a^2
    K, E, modulus = ellipk(m), ellipe(m), MODULUS / 2 / (1 - POISSON**2)
    a = np.sqrt(DEEP * (K - E) / (m * A * K))
    return 2 * np.pi / 3 * modulus * DEEP * a / K, a


def mindlin(share, normal):
    """Return slip at the peak of a cycle of shear +- share mu N of a circular patch, and its loss (Mindlin 1949)."""
    shear_modulus, a = MODULUS / 2 / (1 + POISSON), hertz(90)[1]
    scale = 3 * (2 - POISSON) * MU * normal / (8 * shear_modulus * a)

    def unloading(q):  # from the peak down to q mu N
        return scale * (2 * (1 - (share - q) / 2) ** (2 / 3) - (1 - share) ** (2 / 3) - 1)

    peak = scale * (1 - (1 - share) ** (2 / 3))
    q = np.linspace(-share, share, 20001)
    return peak, 2 * np.trapezoid(unloading(q) * MU * normal, q)


def rigid(angle, spacing, friction=0.0):
    """Return two rods that cross, whose nodes all are held, and the nodes of the upper one."""
    s = np.arange(-1.0, 1.0, spacing)[:, None] + 0.3 * spacing
    t = np.radians(angle)
    lower, upper = s * [1, 0, 0], s * [np.cos(t), np.sin(t), 0] + [0, 0, 2.0]
    # Half spaces; `CrossedCylinders` adds the compliance of a rod as a whole, 4 % of the force at this approach
    law = Power(
        2 / 3 * MODULUS / (1 - POISSON**2), share=2 * (1 - POISSON) / (2 - POISSON), patch=Patch(POISSON)
    )
    return Rods([lower, upper], 1.0, slender(1.0), law, friction, per_node=1)


def moved(rods, way, steps, start=None):
    """Return force (3,) on the upper rod and energies after every increment of a leg that moves it by `way`."""
    ends = dict.fromkeys(rods.numbers[0], CLAMPED) | dict.fromkeys(rods.numbers[1], End(move=way))
    return list(rods.path(ends, steps, start))


def upper_force(rods, each):
    """Return the force (3,) that moves the upper rod."""
    return each.support[rods.numbers[1], :3].sum(axis=0)


def main(meshes=(0.02, 0.0125), picture=None):
    """Compare forces at four angles with Hertz, and slip and loss of a cycle of oblique shear with Mindlin.

    `meshes` are distances between points over the radius.
    """
    page = Page("Hertz and Mindlin", picture)
    for angle in (90, 60, 45, 30):
        bracket = []
        for spacing in meshes:
            rods = rigid(angle, spacing)
            bracket.append(-upper_force(rods, moved(rods, (0, 0, -DEEP), 1)[-1])[2])
        page.compare("normal force", f"{angle} degrees", hertz(angle)[0], bracket, 0.05)
    share, normal, limit = 0.6, hertz(90)[0], MU * hertz(90)[0]
    peak, lost = mindlin(share, normal)
    way = np.array([np.cos(0.5), np.sin(0.5), 0])  # 29 degrees off one rod
    slips, losses = [], []
    for spacing in meshes:
        rods = rigid(90, spacing, MU)
        leg = moved(rods, (0, 0, -DEEP), 8)
        path = []
        for turn in (1, -2, 2, -2):
            leg = moved(rods, turn * peak * way, 24, leg[-1])
            path += [
                (each.load * turn + sum((1, -2, 2, -2)[: len(path) // 24]), upper_force(rods, each) @ way)
                for each in leg
            ]
        place, force = np.array(path).T
        slips.append(force[23] / limit)
        losses.append(abs(np.trapezoid(force[-49:], peak * place[-49:])))
    page.compare(
        "shear over mu N at Mindlin's slip", f"{share:g} mu N, 29 degrees off the axes", share, slips, 0.03
    )
    page.compare("work lost in a cycle", f"{share:g} mu N, 29 degrees off the axes", lost, losses, 0.1)
    page.axes.plot(place, force / limit, ".-", ms=3, lw=0.8, label=f"points {meshes[-1]:g} R apart")
    page.axes.plot([1, -1], [share, -share], "ks", label="Mindlin, turning points")
    page.axes.set_xticks([-1, -0.5, 0, 0.5, 1])
    return page.finish("slip over that at the peak (Mindlin)", "shear over mu N")


if __name__ == "__main__":
    main()
