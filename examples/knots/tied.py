"""Knots of the book: rods of unit radius and B = 1, drawn nearly as theory has them, whose ends are pulled out."""

import loose
import numpy as np
from book import slender
from shapes import knot

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import FREE, End, Rods

NAN = np.nan
LIMITS = {"residual_tolerance": 1e-5, "correction_tolerance": 1e-4, "waste": 200, "stride": 0.7}
OUT, STEPS = 1.5, 15  # how far ends move; steps are half a point of contact
SETTLED = 0.4  # share of it from which friction acts in full


def ends(middle, last, out=NAN, pull=0.0):
    """Return what is done to a knot: ends move out along x, or are pulled; the middle of the loop stays above them."""
    pinned = (0, NAN, NAN)
    return {
        0: End((-out, 0, 0), pinned, (-pull, 0, 0)),
        last: End((out, 0, 0), FREE, (pull, 0, 0)),
        middle: End((0, NAN, 0), FREE),
    }


def pulled(radius, turns, size, friction):
    """Yield equilibria of a knot while its strands slide: force, shortening, curve, middle node and energy over work.

    The knot is drawn as theory has it, with a loop that leaves the braid at `radius`. It becomes straight without load
    while a part of the force holds it, and friction comes to balance; then its ends move out. Elements in its braid are
    `size` sqrt(h `radius`) long, points of contact a fifth of the rod's radius apart. The law of contact begins softly,
    which Newton's method needs; rods overlap by a twentieth of their diameter at last.
    """
    theory, step = loose.knot(turns, 1 / radius, friction), size * np.sqrt(radius)
    nodes, middle = knot(theory, turns, size=step)
    last, law = len(nodes) - 1, Power(60 / radius**2, exponent=2.5)
    rods = Rods([nodes], 1.0, slender(1.0), law, friction, natural=0.0, per_node=round(5 * step))
    hold = theory.force * (0.85 if friction else 1.0)
    *_, held = rods.path(ends(middle, last, pull=hold), 6, **LIMITS)
    *_, held = rods.path(ends(middle, last, pull=hold), 1, held, balance=np.inf, **LIMITS)
    for each in rods.path(ends(middle, last, out=OUT), STEPS, held, **LIMITS):
        if each.load >= SETTLED:
            curve = each.curve()
            length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
            short = length - (curve[-1] - curve[0])[0]
            yield each.support[-1, 0], short, curve, middle, 1 - each.gap / each.work


def loop_radius(curve, middle):
    """Return the radius of the circle that fits the outer half of the loop of a knot best."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)))
    s, place = s - s[middle], curve[:, :2]
    bend = np.gradient(np.gradient(place, s, axis=0), s, axis=0)[middle]
    half = np.abs(s) < 0.5 * np.pi / np.linalg.norm(bend)
    system = np.column_stack([2 * place[half], np.ones(half.sum())])
    *centre, rest = np.linalg.lstsq(system, (place[half] ** 2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(rest + np.sum(np.square(centre))))
