"""A ring cut open: a rod that is straight as drawn closes if it is bent without stress, or by end moments."""

import numpy as np
from book import Page, slender
from shapes import straight

from knitstudy.mechanics.beams.rods import CLAMPED, FREE, End, Rods


def main(meshes=(16, 32), picture=None):
    """Compare the curvature, and the moment that opens the ring, with 2 pi / L.

    `meshes` are numbers of elements.
    """
    page, bend, closed, moment = Page("cut ring", picture), 2 * np.pi, [], []
    for count in meshes:
        rods = Rods([straight(1.0, count)], 1e-3, slender(1e-3), natural=np.array([[0.0, 0.0, bend]]))
        *_, ring = rods.path({0: CLAMPED}, steps=8)
        closed.append(1 - np.linalg.norm(ring.curve()[-1] - ring.curve()[0]))
        # A moment against the natural curvature opens it; where the last node has not turned it is straight.
        half = {0: CLAMPED, count: End(move=FREE, turn=FREE, moment=(0, 0, -bend))}
        *_, opened = rods.path(half, steps=8, start=ring)
        moment.append(np.linalg.norm(opened.curve()[-1] - opened.curve()[0]))
        page.axes.plot(*ring.curve()[:, :2].T, ".-", lw=0.8, label=f"{count} elements")
        page.axes.plot(*opened.curve()[:, :2].T, ".-", lw=0.8)
    page.compare("one less the gap over the length", "natural curvature 2 pi / L", 1.0, closed, 1e-6)
    page.compare("distance of the ends over the length", "opened by M = 2 pi B / L", 1.0, moment, 1e-4)
    page.axes.set_aspect("equal")
    return page.finish("x / L", "y / L")


if __name__ == "__main__":
    main()
