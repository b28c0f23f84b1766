"""Two hooked loops, an orthogonal clasp: arcs whose ends are pushed together, against solids of the same shape."""

import numpy as np
from book import Page

from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.beams.laws import CrossedCylinders
from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods, drawn_curvature

POISSON = 0.3  # of rods of unit radius and modulus
# Curvature: force of solids where ends have come nearer by 0.1 and 0.2 (tests/verification/test_hooked_yarns.py)
SOLIDS = {0.2: (0.01192, 0.02757), 0.3: (0.01533, 0.03717), 0.4: (0.02284, 0.05688)}


def arc(bend, size, along, side):
    """Return the nodes of an arc of a curvature, its middle at height `side`, bent towards the other one."""
    half = min(3.5, 1.2 / bend)
    s = np.linspace(-half, half, round(2 * half / size) + 1)
    return np.outer(np.sin(bend * s) / bend, along) + np.outer(
        side * (1 - (1 - np.cos(bend * s)) / bend), [0, 0, 1.0]
    )


def main(meshes=(0.35, 0.25), picture=None):
    """Compare the force of the ends with that of solids.

    `meshes` are lengths of elements over the radius; there are four points of contact an element.
    """
    page = Page("clasp", picture)
    for bend, known in SOLIDS.items():
        bracket = []
        for size in meshes:
            curves = [arc(bend, size, along, side) for along, side in (([1, 0, 0], -1), ([0, 1, 0], 1))]
            curvature = np.concatenate([drawn_curvature(curve) for curve in curves])
            section = CurvedSection(1.0, 1.0, POISSON, curvature, pressed=1.0)
            rods = Rods(curves, 1.0, section, CrossedCylinders.elastic(1.0, POISSON, 1.0), per_node=4)
            (a, b), (c, d) = (own[[0, -1]] for own in rods.numbers)
            push = End(move=(0, 0, -0.2))
            path = list(rods.path({a: CLAMPED, b: CLAMPED, c: push, d: push}, 8, stops=(0.5,)))
            half = next(each for each in path if each.load == 0.5)
            bracket.append([-each.support[[c, d], 2].sum() for each in (half, path[-1])])
        for number, way in enumerate((0.1, 0.2)):
            page.compare(
                "force / E R^2",
                f"kR {bend:g}, pushed {way:g} R",
                known[number],
                np.array(bracket)[:, number],
                0.10,
            )
        load = path[-1].state.contact_history.on_stations[rods.numbers[1]]
        s = np.arange(len(load)) - 0.5 * (len(load) - 1)
        page.axes.plot(
            s * meshes[-1], np.linalg.norm(load, axis=1) / meshes[-1], ".-", ms=3, label=f"kR {bend:g}"
        )
    return page.finish("along the upper rod over R", "force of contact / E R")


if __name__ == "__main__":
    main()
