"""An overhand knot: the force that tightens it, towards the limit of a loose loop (Audoly et al. 2007)."""

import numpy as np
from book import Page
from tied import loop_radius, pulled

FRICTIONS = (0.0, 0.1, 0.3)


def theory(e, friction):
    """Return F h^2 / B at e = sqrt(h / R) below 0.3: leading terms of small e (PRL 99, 164301)."""
    return e**4 / 2 + 0.492 * friction * e**3


def main(meshes=(0.35, 0.25), picture=None, radii=(30.0, 100.0, 300.0)):
    """Compare the force with the leading terms of the theory, at radii of the loop that tend to infinity.

    `meshes` are lengths of elements over sqrt(h R): a bracket at the smallest radius, the finest elsewhere.
    `radii` are radii of the loop as drawn, over that of the rod.
    """
    page, found = Page("overhand knot", picture), []
    for radius in radii:
        bracket = []
        for size in meshes if radius == radii[0] else meshes[-1:]:
            knots = pulled(radius, 1, size, FRICTIONS)
            bracket.append(
                [(loop_radius(knot.curve(), middle) ** -0.5, knot.support[-1, 0]) for knot, middle in knots]
            )
        found.append(bracket[-1])
        for number, friction in enumerate(FRICTIONS):
            # The theory at the radius of each mesh, and the force over it
            ratios = [force / theory(e, friction) for e, force in np.array(bracket)[:, number]]
            e = bracket[-1][number][0]
            page.compare("F over theory", f"mu {friction:g}, e = {e:.3f}", 1.0, ratios, None)
    found = np.array(found)
    for number, friction in enumerate(FRICTIONS):
        e, force = found[:, number].T
        ratio = force / theory(e, friction)
        if len(radii) > 2:
            # Corrections are of first order in e: lines through the last two and through all points
            limits = [np.polyfit(e[part], ratio[part], 1)[-1] for part in (slice(-2, None), slice(None))]
            page.compare("F over theory, extrapolated to e = 0", f"mu {friction:g}", 1.0, limits, 0.1)
        page.axes.plot(e, ratio, "o-", label=f"mu = {friction:g}")
    page.axes.axhline(1.0, color="k", ls="--", lw=0.8)
    page.axes.set_xlim(left=0.0)
    return page.finish("e = √(h/R)", "F over leading terms (Audoly)")


if __name__ == "__main__":
    main()
