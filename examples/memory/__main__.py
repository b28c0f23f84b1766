"""Shapes at rest and memory of knits that slide with friction: `python examples/memory [jersey rib]`.

Writes resources/memory.csv and docs/notes/memory.webp; docs/notes/memory.md says what they show. Some ten minutes.
"""

import sys
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from knitstudy import load_scene, simulate
from knitstudy.run.behaviour import ENDLESS_BEAMS
from knitstudy.run.committed_tables import keep_table

ROOT = Path(__file__).resolve().parents[2]
TABLE, PICTURE = ROOT / "resources" / "memory.csv", ROOT / "docs" / "notes" / "memory.webp"
DIRECTIONS = ("course", "wale")


def along(history, direction):
    """Return strains (n,) and forces per width (n,) [N/m] of a history along its load."""
    axis = DIRECTIONS.index(direction)
    return (history[name].to_numpy()[:, axis] for name in ("cell_strain", "force_per_width"))


def rest_shapes(history, direction):
    """Return width and height (m, 2) [mm] of the cell wherever its force along the load passes through zero."""
    strain, (_, force) = history["cell_strain"].to_numpy()[:, :2], along(history, direction)
    size = 1e3 * np.array([history.attrs["cell_width"], history.attrs["cell_height"]])
    at = 1 + np.flatnonzero(np.diff(np.sign(force[1:])))  # the first state is at rest
    share = (force[at] / (force[at] - force[at + 1]))[:, None]
    return size * (1 + np.vstack([strain[:1], strain[at] + share * (strain[at + 1] - strain[at])]))


def at_corners(history, direction, turns):
    """Return the forces per width [N/m] at the turns of a load path."""
    strain, force = along(history, direction)
    way = np.cumsum(np.abs(np.diff(strain, prepend=0.0)))
    corners = np.cumsum(np.abs(np.diff(turns, prepend=0.0)))
    return np.interp(corners, way, force)


def jersey(axes, frictions=(0.0, 0.1, 0.3, 0.5), strain=0.2, increments=50):
    """Draw the shapes at rest of a jersey of soft yarn by friction, and return rows of the table.

    The cell comes to rest from its drawn loops, is pulled to a strain in course or in wale direction, let go, pressed
    to -10 %, and let go again: three shapes without force for each direction.
    """
    rows = []
    for friction in frictions:
        begun, shapes = time.process_time(), []
        for direction in DIRECTIONS:
            changes = {
                "contact.friction": friction,
                "load.turns": [strain, -0.1],
                "load.strain": 0.1,
                "load.largest_force": None,
                "solver.increments": increments,
            }
            history = simulate(
                load_scene(f"fabric-acrylic-stockinette-{direction}-free").vary(changes)
            ).history
            shapes.append(rest_shapes(history, direction))
        every, spent = np.vstack(shapes), time.process_time() - begun
        order = np.argsort(every[:, 0])
        axes.plot(*every[order].T, "o-", ms=4, label=f"friction {friction:g}")
        for axis, name in enumerate(("width", "height")):
            band, known = np.ptp(every[:, axis]) / every[0, axis], np.nan if friction else 0.0
            rows.append(
                ("jersey", f"band of the {name} at rest over it", f"mu {friction:g}", known, band, spent)
            )
    axes.set(xlabel="wale spacing at rest [mm]", ylabel="course spacing at rest [mm]")
    axes.legend(fontsize=7)
    return rows


def rib(axes, friction=0.3, increments=170):
    """Draw cycles of a rib, and return how well its force wipes out and repeats them.

    Wiping-out: after a cycle between two strains the force is what it was before, and so is the way that follows.
    Congruency: cycles between the same strains are alike, whatever was before them.
    """
    begun = time.process_time()
    low, high = 0.2, 0.35
    turns = (high, low, high, 0.45, low, high, low, high, 0.1)
    changes = {
        "contact.friction": friction,
        "load.turns": turns[:-1],
        "load.strain": turns[-1],
        "load.largest_force": None,
        "solver.increments": increments,
    }
    history = simulate(load_scene("fabric-acrylic-rib-wale-free").vary(changes)).history
    axes.plot(*along(history, "wale"), lw=1)
    axes.set(xlabel="strain of a rib along wales", ylabel="force per width [N/m]")
    force = at_corners(history, "wale", turns)
    first, second, third = force[0] - force[1], force[5] - force[4], force[5] - force[6]
    opened = force[2] - force[0]
    upper, lower, alike = opened / first, (force[6] - force[4]) / second, third / first
    of, spent = f"{low:g} to {high:g} on", time.process_time() - begun
    return [
        ("rib", "change of the upper force by a cycle, over the cycle", f"{of} loading", 0.0, upper, spent),
        ("rib", "change of the lower force by a cycle, over the cycle", f"{of} unloading", 0.0, lower, spent),
        ("rib", "cycle on unloading over that on loading", f"{low:g} to {high:g}", 1.0, alike, spent),
    ]


def main(names=("jersey", "rib"), table=TABLE, picture=PICTURE):
    """Run experiments by their names; write the rows of the table, and the picture of all that have run.

    Parameters
    ----------
    names : sequence of str
        jersey, rib.
    table, picture : Path
        Files to write.

    Returns
    -------
    pandas.DataFrame
        Experiment, quantity, parameter, known value, value here, seconds.
    """
    figure, panels = plt.subplots(
        1, len(names), figsize=(4.2 * len(names), 3.3), layout="constrained", squeeze=False
    )
    columns = ["experiment", "quantity", "parameter", "known", "here", "seconds"]
    parts = []
    for name, axes in zip(names, panels[0], strict=True):
        rows = pd.DataFrame({"jersey": jersey, "rib": rib}[name](axes), columns=columns)
        parts.append(rows)
        print(rows.to_string(index=False), flush=True)
    every = pd.concat(parts, ignore_index=True)
    keep_table(every, table, "python examples/memory", [ENDLESS_BEAMS], digits=4)
    figure.savefig(picture, dpi=90)
    return every


if __name__ == "__main__":
    main(sys.argv[1:] or ("jersey", "rib"))
