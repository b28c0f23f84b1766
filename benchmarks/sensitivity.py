"""How much force and out-of-plane motion of the tied knit depend on numbers that nobody prints.

    python benchmarks/sensitivity.py [--scene dns-tie-course] [--loops 1] [--rows 1]

One number at a time is changed from the scene's value: element size, tie tolerance, hourglass stiffness, increments,
spacing on legs, clearance, material law, ends. Prints and keeps ``results/tables/sensitivity.csv``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from knitstudy import dns
from knitstudy.configuration import load_scene
from knitstudy.errors import KnitstudyError
from knitstudy.geometry.build import build
from knitstudy.geometry.pattern import Knit
from knitstudy.io import write_table
from knitstudy.mesh.knit import mesh_knit
from knitstudy.scene import Scene

TABLE = Path("results/tables/sensitivity.csv")

CHANGES = {
    "mesh.size": (0.6e-3, 0.45e-3, 0.36e-3, 0.3e-3, 0.225e-3),
    "mesh.growth": (1.0, 1.5),
    "mesh.element": ("incompatible_modes",),
    "tie.tolerance": (0.2, 0.5, 1.0),
    "solver.hourglass": (0.0025, 0.01, 0.05),
    "solver.increments": (5, 20, 40),
    "pattern.clearance": (0.005, 0.02, 0.04),
    "yarn.material": ("neo_hookean", "st_venant_kirchhoff"),
    "load.lateral": ("free",),
}
"""Values of each key; the scene's own comes first in the table."""


def main() -> None:
    """Run the sweep, print and keep its table."""
    options = _options()
    scene = load_scene(options.scene)
    for key in ("loops", "rows"):
        scene = scene.replace(f"pattern.{key}", getattr(options, key))
    base = measure(scene)
    rows = [{"key": "none", "value": "", **base}]
    for key, values in CHANGES.items():
        for value in values:
            try:
                rows.append({"key": key, "value": value, **measure(scene.replace(key, value))})
            except KnitstudyError as error:
                rows.append({"key": key, "value": value, "refused": str(error)})
            print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    table["force over the scene's [1]"] = table["force [N]"] / base["force [N]"]
    write_table(table, TABLE)
    print(table.to_string(index=False, float_format="{:.5g}".format))


def measure(scene: Scene) -> dict:
    """Pull a scene and return what came out."""
    knit = Knit.from_dataset(build(scene))
    mesh = mesh_knit(knit, scene.mesh.size, scene.mesh.growth)
    history = dns.run(scene, mesh, knit)
    energy = history["energy"].isel(increment=-1)
    return {
        "degrees of freedom [1]": mesh.nodes.size,
        "force [N]": float(history["force"][-1]),
        "largest u_z [mm]": 1e3 * float(np.abs(history["centreline_displacement"][-1, :, 2]).max()),
        "tied area a crossing [mm2]": 1e6 * float(history["tied_area"].mean()),
        "largest adjustment [mm]": 1e3 * history.attrs["tie_largest_adjustment"],
        "hourglass over internal energy [1]": float(
            energy.sel(form="hourglass") / energy.sel(form="internal")
        ),
    }


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="dns-tie-course", help="DNS scene to start from (%(default)s)")
    parser.add_argument("--loops", type=int, default=1, help="loops of a yarn (%(default)s)")
    parser.add_argument("--rows", type=int, default=1, help="rows of interlocks (%(default)s)")
    return parser.parse_args()


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
