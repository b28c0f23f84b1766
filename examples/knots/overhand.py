"""An overhand knot: the force that tightens it, towards the limit of a loose loop (Audoly et al. 2007)."""

import loose
import numpy as np
from book import Page
from braid import braid
from tied import loop_radius, pulled

FRICTIONS = (0.0, 0.1, 0.3)
PUBLISHED = 0.492  # friction of the braid


def theory(e, friction):
    """Return F h^2 / B at e = sqrt(h / R): the leading terms of small e (PRL 99, 164301)."""
    return e**4 / 2 + PUBLISHED * friction * e**3


def main(meshes=(0.35, 0.25), picture=None, radii=(30.0, 100.0, 700.0)):
    """Compare the force with the leading terms of the theory, and with those and the next ones, as the loop grows.

    `meshes` are lengths of elements over sqrt(h R): a bracket at the smallest radius, the finest elsewhere.
    `radii` are radii of the loop as drawn, over that of the rod. Forces are means over the way that strands slide.
    """
    page, found = Page("overhand knot", picture), []
    page.compare("friction of the braid", "mu B / sqrt(h R^3)", PUBLISHED, [braid(1).friction], 0.01)
    for radius in radii:
        for friction in FRICTIONS:
            bracket = []
            for size in meshes if radius == radii[0] else meshes[-1:]:
                sliding = [
                    (
                        loop_radius(curve, middle) ** -0.5,
                        force / theory(loop_radius(curve, middle) ** -0.5, friction),
                        force / loose.shortened(1, shortening, friction).force,
                        kept,
                    )
                    for force, shortening, curve, middle, kept in pulled(radius, 1, size, friction)
                ]
                bracket.append(np.mean(sliding, axis=0))
            e, first, both, kept = np.transpose(bracket)
            at = f"mu {friction:g}, e = {e[-1]:.3f}"
            page.compare("F over leading terms", at, 1.0, first, None)
            bar = 0.03 + 0.2 * friction if e[-1] < 0.1 else None  # what is left out grows with friction
            page.compare("F over theory with the next terms", at, 1.0, both, bar)
            page.compare("energies over work", at, 1.0, kept, 0.02)
            found.append((friction, e[-1], first[-1], both[-1]))
    for number, friction in enumerate(FRICTIONS):
        _, e, first, both = np.array([row for row in found if row[0] == friction]).T
        page.axes.plot(e, first, "o", color=f"C{number}", label=f"mu = {friction:g}")
        page.axes.plot(e, first / both, "-", color=f"C{number}", lw=0.8)
    page.axes.axhline(1.0, color="k", ls="--", lw=0.8)
    page.axes.set_xlim(left=0.0)
    return page.finish("e = √(h/R)", "F over leading terms; lines: theory")


if __name__ == "__main__":
    main()
