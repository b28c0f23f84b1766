"""A sliding cycle that closes: rods that cross are pressed and moved around a square, twice."""

import numpy as np
from book import Page
from hertz import DEEP, MU, hertz, moved, rigid, upper_force

SIDE, STEPS = 0.2, 40  # of the square; increments along a side


def main(meshes=(0.04, 0.025), picture=None):
    """Compare friction on the way, the work of a cycle and what becomes of it with Coulomb's law.

    `meshes` are distances between points over the radius.
    """
    page, limit, turn = Page("sliding cycle", picture), MU * hertz(90)[0], 0.5
    along, across = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
    sides = SIDE * np.array([along, across, -along, -across] * 2)
    frictions, works, kept, repeats = [], [], [], []
    for spacing in meshes:
        rods = rigid(90, spacing, MU)
        last = moved(rods, (0, 0, -DEEP), 4)[-1]
        stored, path, place = (
            [sum(last.response.energy.values())],
            [[*np.zeros(3), *upper_force(rods, last)]],
            np.zeros(3),
        )
        for side in sides:
            for each in moved(rods, side, STEPS, last):
                path.append([*(place + each.load * side), *upper_force(rods, each)])
                last = each
            place = place + side
            stored.append(sum(last.response.energy.values()))
        x, force = np.split(np.array(path), 2, axis=1)
        work = np.einsum("ni,ni->n", 0.5 * (force[1:] + force[:-1]), np.diff(x, axis=0))
        second = work[4 * STEPS :].sum()
        frictions.append(
            np.linalg.norm(force[-STEPS // 2 :, :2], axis=1).mean() / -force[-STEPS // 2 :, 2].mean()
        )
        works.append(second)
        kept.append((stored[8] - stored[4]) / second)
        repeats.append(np.linalg.norm(force[-1] - force[4 * STEPS]) / np.linalg.norm(force[-1]) + 1)
    page.compare("friction over normal force", "17 and 73 degrees off the rods", MU, frictions, 0.03)
    page.compare("work of the second cycle", "a square of 0.2 R", 4 * SIDE * limit, works, 0.05)
    page.compare("energy lost over work", "second cycle", 1.0, kept, 0.03)
    page.compare("one, and the change of the force from cycle to cycle", "second cycle", 1.0, repeats, 0.03)
    way = np.arange(len(force)) / STEPS
    page.axes.plot(
        way, np.linalg.norm(force[:, :2], axis=1) / -force[:, 2], lw=0.8, label="friction over force"
    )
    page.axes.axhline(MU, color="k", ls="--", label="Coulomb")
    return page.finish("sides of the square", "friction over normal force")


if __name__ == "__main__":
    main()
