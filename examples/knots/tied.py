"""Knots of the book: rods of unit radius and B = 1, drawn as open knots, which straighten under a pull."""

import numpy as np
from book import slender
from shapes import knot

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import FREE, End, Rods

NAN = np.nan
LIMITS = {"residual_tolerance": 1e-5, "correction_tolerance": 1e-4, "waste": 200, "stride": 0.7}


def ends(middle, last, out=NAN, pull=0.0):
    """Return what is done to a knot: ends move out along x, or are pulled; the middle of the loop stays above them."""
    pinned = (0, NAN, NAN)
    return {
        0: End((-out, 0, 0), pinned, (-pull, 0, 0)),
        last: End((out, 0, 0), FREE, (pull, 0, 0)),
        middle: End((0, NAN, 0), FREE),
    }


def rods_of(nodes, radius, step, friction):
    """Return rods with points of contact a fifth of the rod's radius apart.

    The law begins softly, which Newton's method needs; rods overlap by a twentieth of their diameter at last.
    """
    law = Power(60 / radius**2, exponent=2.5)
    return Rods([nodes], 1.0, slender(1.0), law, friction, natural=0.0, per_node=round(5 * step))


def pulled(radius, turns, size, frictions, share=0.05, steps=5):
    """Yield knots without and with friction whose ends have been pulled out by a share of `radius`, and their middle.

    First, a knot without friction straightens under the pull B / 2 `radius`^2. Elements in its braid are
    `size` sqrt(h `radius`) long.
    """
    step = size * np.sqrt(radius)
    nodes, middle = knot(radius, turns, size=step)
    last = len(nodes) - 1
    *_, loose = rods_of(nodes, radius, step, 0.0).path(ends(middle, last, pull=0.5 / radius**2), 12, **LIMITS)
    for friction in frictions:
        rods = rods_of(nodes, radius, step, friction)
        *_, tight = rods.path(ends(middle, last, out=share * radius), steps, loose, **LIMITS)
        yield tight, middle


def loop_radius(curve, middle):
    """Return the radius of the circle that fits the outer half of the loop of a knot best."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    s, place = s - s[middle], curve[:, :2]
    bend = np.gradient(np.gradient(place, s, axis=0), s, axis=0)[middle]
    half = np.abs(s) < 0.5 * np.pi / np.linalg.norm(bend)
    system = np.column_stack([2 * place[half], np.ones(half.sum())])
    *centre, rest = np.linalg.lstsq(system, (place[half] ** 2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(rest + np.sum(np.square(centre))))
