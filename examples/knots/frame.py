"""Lee's frame: a hinged right angle under a dead force, along a path on which load and deflection turn back."""

import numpy as np
from book import Page

from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.rods import End, Rods

LENGTH, MODULUS, AREA, INERTIA = 120.0, 720.0, 6.0, 2.0  # published limit loads +18.552 and -9.3 E I / L^2


def main(meshes=(10, 20), picture=None):
    """Compare both limit loads along the arc with those of Lee, Manuel and Rossow (1968).

    `meshes` are numbers of elements of a leg, multiples of five.
    """
    page, highest = Page("Lee's frame", picture), []
    section = BeamSection(MODULUS * AREA, MODULUS / 2.6 * AREA, MODULUS * INERTIA, MODULUS * INERTIA, 0.25)
    nan, unit = np.nan, MODULUS * INERTIA / LENGTH**2
    for count in meshes:
        s = np.linspace(0, LENGTH, count + 1)[:, None]
        nodes = np.concatenate([s * [0, 1, 0], s[1:] * [1, 0, 0] + [0, LENGTH, 0]])
        rods = Rods([nodes], 1.0, section)
        ends = {k: End(move=(nan, nan, 0), turn=(0, 0, nan)) for k in range(2 * count + 1)}
        ends[0] = ends[2 * count] = End(turn=(0, 0, nan))
        loaded = count + count // 5
        ends[loaded] = End(move=(nan, nan, 0), turn=(0, 0, nan), force=(0, -20 * unit, 0))
        path = []
        for each in rods.arc_path(ends, 0.25 * LENGTH * np.sqrt(count / 20)):
            path.append((LENGTH - each.curve()[loaded, 1], 20 * each.load))
            if path[-1][1] > 25 or len(path) > 120:
                break
        down, load = np.array(path).T
        highest.append(load[: int(np.argmin(load))].max())
        page.axes.plot(down, load, ".-", ms=3, lw=0.8, label=f"{2 * count} elements")
    page.compare("limit load L^2 / E I", "dead force, by arc length", 18.552, highest, 0.01)
    page.axes.set_ylim(-12, 25)
    return page.finish("deflection", "load L²/EI")


if __name__ == "__main__":
    main()
