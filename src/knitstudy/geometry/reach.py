"""Which loops can be made: course spacings and diameters by what is held fixed, found or refused.

python -m knitstudy.geometry.reach --help
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from knitstudy.errors import GeometryError, KnitstudyError
from knitstudy.files import write_table
from knitstudy.geometry.lay_out import lay_out
from knitstudy.study.configuration import CONFIG, load_scene

RATIOS = (0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3)
DIAMETERS = (1.2e-3, 1.35e-3, 1.5e-3, 1.65e-3, 1.95e-3, 2.1e-3, 2.25e-3)
"""Looked at beside the drawn loop's [m]."""

FREE = {"shape": "z", "wale_spacing": "xyz", "length": "xyz"}
"""What of the control points may move by what is held fixed: where the drawn shape is, heights alone."""

FOUND = "found"
"""What the column ``outcome`` says of a loop that can be made; else it has the reason."""


def main(arguments=None):
    """Lay out every loop and write the table; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m knitstudy.geometry.reach", description=__doc__)
    parser.add_argument("--scene", default="dns-tie-course", help="whose drawn loop is taken")
    parser.add_argument("--config", type=Path, default=CONFIG)
    parser.add_argument("--output", type=Path, default=Path("resources/reference/loops.csv"))
    options = parser.parse_args(arguments)
    try:
        write_table(reach(load_scene(options.scene, options.config)), options.output)
    except KnitstudyError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def reach(scene):
    """Lay out the loops at `RATIOS`, and of `DIAMETERS`, for every reading of what is held fixed.

    Parameters
    ----------
    scene : Scene
        Of a knit as it is drawn.

    Returns
    -------
    pandas.DataFrame
        A row a loop; ``outcome`` is "found" or the reason.
    """
    diameter = scene.yarn.diameter
    wanted = [(ratio, diameter) for ratio in RATIOS] + [(1.0, each) for each in DIAMETERS]
    return pd.DataFrame(loop_row(scene, keep, *each) for keep in FREE for each in wanted)


def loop_row(scene, keep, ratio, diameter):
    """What comes of one loop: dict.

    Parameters
    ----------
    scene : Scene
        As of `reach`.
    keep : str
        A key of `FREE`.
    ratio, diameter : float
        Of the course spacing to the drawn one, and of the yarn [m].
    """
    said = {"held fixed": keep, "course ratio [1]": ratio, "yarn diameter [m]": diameter}
    try:
        varied = scene.vary(
            {
                "pattern.keep": keep,
                "pattern.course_ratio": ratio,
                "yarn.diameter": diameter,
                "geometry.free": [FREE[keep]] * len(scene.pattern.control_points),
            }
        )
        geometry = lay_out(varied)
    except GeometryError as error:
        return said | {"outcome": str(error.__cause__ or error)}
    after, radius = geometry.sel(state="after"), 0.5 * diameter
    target = (2 + float(geometry["clearance"])) * radius
    return said | {
        "outcome": FOUND,
        "wale spacing [m]": float(geometry["wale_spacing"]),
        "yarn in a loop [m]": float(after["loop_length"]),
        "interlock angle [deg]": float(after["interlock_angle"]),
        "leg angle [deg]": float(after["leg_angle"]),
        "R over radius of curvature [1]": radius / float(after["radius_of_curvature"]),
        "contact error over R [1]": np.abs(after["crossing_distance"] - target).max().item() / radius,
        "gap away from crossings over R [1]": float(after["other_gap"]) / radius,
    }


if __name__ == "__main__":
    sys.exit(main())
