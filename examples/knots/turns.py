"""Overhand knots of n turns with friction: force over shortening (Jawed et al. 2015), and of a braid that ends."""

import loose
import numpy as np
from book import Page
from braid import PER_TURN, braid
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from tied import pulled

FRICTION = 0.1


def shape(x):
    """Return the length of the loop over R where the braid has the length x R: an elastica of modulus m."""
    m = brentq(lambda m: 8 * (ellipk(m) - ellipe(m)) / m - 4 * ellipk(m) - x, 1e-9, 0.999)
    return 4 * ellipk(m)


def theory(shortening, turns, friction):
    """Return F h^2 / B at a shortening e / h: long braids of n turns (PRL 115, 118302).

    n^2 h / e = x^2 / (x + lambda / R) / (8 sqrt(3) pi^2) and n^2 F h^2 / B = mu x^3 / (96 sqrt(3) pi^2).
    """

    def excess(x):
        return x**2 / (x + shape(x)) / (8 * np.sqrt(3) * np.pi**2) - turns**2 / shortening

    x = brentq(excess, 1e-3, 5.9)
    return friction * x**3 / (96 * np.sqrt(3) * np.pi**2) / turns**2


def main(meshes=(0.35, 0.25), picture=None, knots=((1, 100.0), (2, 100.0), (3, 100.0))):
    """Compare the force of knots that tighten with theories at the same shortening.

    `meshes` are lengths of elements over sqrt(h R). `knots` are turns, and radius of the loop as drawn over
    that of the rod. Forces are means over the way that strands slide.
    """
    page = Page("knots of n turns", picture)
    more = braid(3).friction - braid(2).friction
    page.compare("friction of the braid", "a third turn", PER_TURN, [more], 0.01)
    for turns, radius in knots:
        bracket = []
        for size in meshes:
            sliding = list(pulled(radius, turns, size, FRICTION))
            ratios = [
                (force / loose.shortened(turns, e, FRICTION).force, force / theory(e, turns, FRICTION))
                for force, e, *_ in sliding
            ]
            bracket.append(np.mean(ratios, axis=0))
        _, e, curve, *_ = sliding[-1]
        page.axes.plot(*curve[:, :2].T, lw=1, label=f"n = {turns}")
        at, (ends, long) = f"n = {turns}, mu {FRICTION:g}, e / h = {e:.0f}", np.transpose(bracket)
        page.compare("F over theory of a braid that ends", at, 1.0, ends, 0.07)
        page.compare("F over theory of a long braid", at, 1.0, long, None)
    page.axes.set_aspect("equal")
    return page.finish("x / h", "y / h")


if __name__ == "__main__":
    main()
