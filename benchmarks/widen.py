"""What the yarn in a stitch and the shape at rest add to the intervals of predictions; resources/unknowns.csv.

``python benchmarks/widen.py`` runs cells of the acrylic yarn, four of every stitch and direction, in some 40 s each:

- the free cell, and that with 0.9 and 1.1 of the yarn in a stitch, with loops that are drawn for as much smaller or
  larger spacings: relative changes of the strain at `FORCES`;
- the free cell at the upper end of the interval of the yarn's friction, pulled to 0.3 N/mm, let go to a strain of -10 %
  and pulled again: strains at which no force is left, on both ways. Friction holds the fabric anywhere between.

`paper.tables.fabrics` adds them to the other parts. Cotton takes the values of the acrylic, seed those of rib.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from knitstudy import load_scene, simulate
from knitstudy.errors import ConvergenceError
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.scene.alternatives import read_yarn
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.tables.fabrics import FORCES, Pulled
from knitstudy.run.behaviour import ENDLESS_BEAMS
from knitstudy.run.committed_tables import keep_table

KEPT = RESOURCES / "unknowns.csv"
STITCHES = ("garter", "rib")
YARN, SHARE = "acrylic", 0.1  # of the yarn in a stitch, more and less
COMPRESSED = 0.1
SIZES = ("pattern.loop_length", "pattern.wale_spacing", "pattern.course_spacing")


def pulled(name: str, direction: str, **changes: object) -> Pulled:
    """Return the states of a cell of a scene with changes; those before a gate has ended it, if one has."""
    scene = load_scene(name).vary({"solver.increments": 100, **changes})
    try:
        return Pulled.of(simulate(scene).history, direction)
    except ConvergenceError as error:
        print(f"{name}, {changes}: {error}")
        return Pulled.of(error.history, direction)


def strain_of_length(name: str, direction: str, times: float) -> Floats:
    """Return the strains at `FORCES` of a cell whose stitches have `times` their yarn."""
    scene = load_scene(name)
    return pulled(name, direction, **{key: times * scene.value(key) for key in SIZES}).strain


def rest_band(name: str, direction: str, strain: float) -> tuple[float, float]:
    """Return the lowest and the highest strain without force of a cell on its ways from and to a strain."""
    friction = read_yarn(YARN).values["friction"].interval
    assert friction is not None  # of this yarn
    changes = {"load.turns": [strain, -COMPRESSED], "load.strain": strain / 2, "load.largest_force": None}
    scene = load_scene(name).vary({**changes, "contact.friction": friction[1], "solver.increments": 150})
    history = simulate(scene).history
    axis = DIRECTIONS.index(direction)
    way, force = (history[each].to_numpy()[1:, axis] for each in ("cell_strain", "force_per_width"))
    at = np.flatnonzero(np.diff(np.sign(force)))
    ends = way[at] - force[at] * (way[at + 1] - way[at]) / (force[at + 1] - force[at])
    return min(0.0, float(ends.min())), max(0.0, float(ends.max()))


def measure() -> pd.DataFrame:
    """Return a row for every stitch, direction and force."""
    parts = []
    for stitch in STITCHES:
        for direction in DIRECTIONS:
            name = f"fabric-{YARN}-{stitch}-{direction}-free"
            free = pulled(name, direction).strain
            less, more = (strain_of_length(name, direction, 1 + sign * SHARE) / free - 1 for sign in (-1, 1))
            low, high = rest_band(name, direction, float(free[-1]))
            rows = {
                "stitch": stitch,
                "direction": direction,
                "force_per_width_N_mm": FORCES,
                "less_yarn": less,
                "more_yarn": more,
                "rest_lowest": low,
                "rest_highest": high,
            }
            parts.append(pd.DataFrame(rows))
            print(parts[-1].round(4).to_string(index=False), flush=True)
    return pd.concat(parts, ignore_index=True)


if __name__ == "__main__":
    keep_table(measure().round(4), KEPT, "python benchmarks/widen.py", [ENDLESS_BEAMS])
