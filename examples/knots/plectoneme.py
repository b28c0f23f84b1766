"""A plectoneme: a twisted rod whose ends come together winds around itself as a ply (Clauvelin et al. 2009)."""

import numpy as np
from book import Page, slender
from scipy.optimize import brentq

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods

LENGTH, LIMITS = 150.0, {"residual_tolerance": 1e-5, "correction_tolerance": 1e-4, "stride": 0.5}


def ply(angle):
    """Return force F r^2 / B and moment M r / B of a ply of two strands at an angle [rad] on a helix of radius r.

    Clauvelin, Audoly and Neukirch, Biophysical Journal 96 (2009) 3716.
    """
    s = np.sin(angle)
    force = s**3 * (np.cos(angle) * np.tan(2 * angle) - s / 2)
    return force, 2 / np.sin(2 * angle) * (s**4 / 2 + force)


def angle_of(force):
    """Return the angle of a ply that a force F r^2 / B holds [rad]."""
    return brentq(lambda angle: ply(angle)[0] - force, 1e-3, 0.75)


def main(meshes=(2.0, 1.5), picture=None):
    """Compare the moment of the ends with that of a ply under the same force.

    A rod of unit radius is twisted by 14 rad, its ends come nearer, and it is twisted on: a loop leaves the axis, snaps
    into a plectoneme, and that grows.

    `meshes` are lengths of elements over the radius; points of contact are a quarter of the radius apart.
    """
    page, found = Page("plectoneme", picture), []
    for size in meshes:
        last = round(LENGTH / size)
        s = np.linspace(0, 1, last + 1)
        wave = np.sin(np.pi * s) ** 2  # a slight bend out of every plane
        drawn = np.column_stack([LENGTH * s, 0.5 * wave, 0.3 * wave * np.sin(4 * np.pi * s)])
        rods = Rods([drawn], 1.0, slender(1.0), Power(40.0, 2.5), natural=0.0, per_node=round(4 * size))
        legs = (End(turn=(14, 0, 0)), 4), (End(move=(-40, 0, 0)), 20), (End((-35, 0, 0), (26, 0, 0)), 30)
        before, path = None, []
        for what, steps in legs:
            leg = list(rods.path({0: CLAMPED, last: what}, steps, before, **LIMITS))
            path += [each.support[last, [0, 3]] for each in leg]
            before = leg[-1]
        found.append(path[-1])
    force, moment = np.transpose(found)
    angle = angle_of(force[-1])
    ratios = np.array(moment) / [ply(angle_of(each))[1] for each in force] * ply(angle)[1]
    page.compare(
        "moment M r/B",
        f"F r^2/B {force[-1]:.4f}: ply at {np.degrees(angle):.1f} degrees",
        ply(angle)[1],
        ratios,
        0.03,
    )
    fine = np.radians(np.linspace(3, 30, 60))
    page.axes.plot(*ply(fine), label="ply (Clauvelin)")
    page.axes.plot(*np.transpose(path), ".-", ms=3, lw=0.6, label=f"elements {meshes[-1]:g} r long")
    page.axes.set(xlim=(0, 0.04), ylim=(0, 0.16))
    return page.finish("force F r²/B", "moment M r/B")


if __name__ == "__main__":
    main()
