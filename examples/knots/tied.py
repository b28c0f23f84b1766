"""Knots of the book: rods drawn as open knots, which straighten as far as the pull lets them, and are pulled then."""

import numpy as np
from book import slender
from curves import knot

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import FREE, End, Equilibrium, Rods

NAN = np.nan
LIMITS = {"residual_tolerance": 1e-5, "correction_tolerance": 1e-4, "waste": 200}


def ends(middle, last, out=NAN, pull=0.0):
    """Return what is done to the ends: both move out along x, or are pulled; the middle of the loop stays over both."""
    pinned, turning = (0, NAN, NAN), FREE
    return {
        0: End((-out, 0, 0), pinned, (-pull, 0, 0)),
        last: End((out, 0, 0), turning, (pull, 0, 0)),
        middle: End((0, NAN, 0), FREE),
    }


def relaxed(radius, turns=1, size=0.25, points=0.25, steps=8):
    """Return a knot without friction under the pull B / 2 `radius`^2, and its middle.

    Elements in the braid are `size` sqrt(h `radius`) long, and points of contact `points` h apart.
    """
    step = size * np.sqrt(radius)
    nodes, middle = knot(radius, turns, size=step)
    # A soft start keeps Newton's method on its way; rods overlap by a twentieth of their diameter at last.
    law = Power(30 / radius**2, exponent=2.5)
    rods = Rods([nodes], 1.0, slender(1.0), law, natural=0.0, per_node=max(round(step / points), 1))
    *_, tied = rods.path(ends(middle, len(nodes) - 1, pull=0.5 / radius**2), steps, **LIMITS)
    return tied, middle


def with_friction(tied: Equilibrium, mu):
    """Return rods in the same state that rub from there on."""
    old = tied.rods
    line = old.contact.line
    rods = Rods(
        [tied.rods.nodes],
        1.0,
        slender(1.0),
        line.repulsion.law,
        mu,
        0.0,
        per_node=len(line.yarn) // len(old.nodes),
    )
    return rods


def loop_radius(curve, middle):
    """Return the radius of the circle that fits the upper half of the loop of a knot best."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    s -= s[middle]
    x, y = curve[:, 0], curve[:, 1]
    reach = 0.5 * np.ptp(x[np.abs(s) < 20]) if False else None
    radius = 1.0 / max(np.hypot(*np.gradient(np.gradient(curve[:, :2], s, axis=0), s, axis=0)[middle]), 1e-12)
    half = np.abs(s) < 0.5 * np.pi * radius
    system = np.column_stack([2 * x[half], 2 * y[half], np.ones(half.sum())])
    a, b, c = np.linalg.lstsq(system, x[half] ** 2 + y[half] ** 2, rcond=None)[0]
    return float(np.sqrt(c + a**2 + b**2))
