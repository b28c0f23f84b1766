"""What refinement at crossings is worth: error of contact against unknowns and time, beside finer meshes everywhere.

    python benchmarks/refinement.py --case hertz
    python benchmarks/refinement.py --case cell --elements quadratic --sizes 5 6 --refinements 1 2

`hertz`: two cylinders of 1 mm that cross at an angle (`--angle`), pressed on each other by 0.05 mm without friction.
`cell`: one cell of the knit with friction, pulled to 5 %. Sizes are elements over the diameter. Prints and keeps
``results/tables/refinement_CASE.csv``; with `--picture` draws the errors of force and area over the unknowns, against
`--force` and `--area` or the finest mesh of the table.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml

from knitstudy.errors import KnitstudyError
from knitstudy.files import write_table
from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.mesh.mesher import mesh_scene
from knitstudy.models.simulate import solve
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene

TABLES = Path("results/tables")

DIAMETER, PRESS, GAP = 1e-3, 0.05e-3, 2e-6
"""Of the cylinders [m]: the test of Hertz's problem, with a gap that no mesh closes before anything moves."""

NAMES = ("yarn", "cell", "area", "cell_area", "pressure")
"""Columns of points in contact."""

ROOM = {"gates.hourglass": 0.5, "gates.ledger": 0.9, "gates.elements_across": 3.0}
"""Coarse meshes and three increments are compared here, not refused."""


def main() -> None:
    """Run the cases, print and keep their table."""
    options = _options()
    rows = []
    for element, across, refinement in product(options.elements, options.sizes, options.refinements):
        try:
            keys = {"mesh.element": element, "mesh.refinement": refinement}
            scene = case(options, across).vary(keys | pairs(options.set))
            found = measure(scene)
        except KnitstudyError as error:
            found = {"refused": str(error)}
        rows.append({"element": element, "across": across, "refinement": refinement, **found})
        print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    write_table(table, TABLES / f"refinement_{options.case}.csv")
    print(table.to_string(index=False, float_format="{:.5g}".format, na_rep=""))
    if options.picture:
        draw(table, options)


def case(options: argparse.Namespace, across: float) -> Scene:
    """Return the scene of a case with so many elements over the diameter."""
    if options.case == "cell":
        scene = load_scene("dns-isotropic-course")
        one = {"pattern.loops": 1, "pattern.rows": 1, "contact.tied_edges": "none", "load.stops": [0.02]}
        return scene.vary(
            one | ROOM | {"mesh.size": scene.yarn.diameter / across, "solver.linear": "three_scale"}
        )
    turn = np.sin(np.radians(options.angle))
    return load_scene(f"pair-pressed-{90 if options.angle > 60 else 30}").vary(
        {
            "pair.angle": options.angle,
            "yarn.diameter": DIAMETER,
            "pair.length": 2.5 * DIAMETER / turn,
            "pair.clearance": 2 * GAP / DIAMETER,
            "yarn.poisson_ratio": 0.4,
            "contact.friction": 0.0,
            "contact.augmentations": 100,
            "load.path": [[0, 0, -(PRESS + GAP)]],
            "mesh.size": DIAMETER / across,
            "mesh.growth": 1.0,
            "solver.increments": 3,
            "outputs": [],
        }
        | ROOM
    )


def measure(scene: Scene) -> dict[str, float]:
    """Load a scene and return force, area and pressure of contact, and what they cost."""
    specimen = Fabric.from_dataset(lay_out(scene))
    mesh = mesh_scene(scene, specimen)
    start = process_time()
    history = solve(scene, specimen, mesh=mesh)
    seconds = process_time() - start
    area, pressure, points = touched(history)
    return {
        "degrees of freedom [1]": int(history.attrs["dof"]),
        "points in contact [1]": points,
        "force [N]": abs(float(history["force"][-1])),
        "area of a crossing [mm2]": 1e6 * area,
        "largest pressure [MPa]": 1e-6 * pressure,
        "largest u_z [mm]": 1e3 * float(np.abs(history["centreline_displacement"][-1, :, 2]).max()),
        "CPU time [s]": seconds,
    }


def touched(history: xr.Dataset) -> tuple[float, float, int]:
    """Return the mean area of a crossing and its sides [m2], the largest pressure [Pa], and how many points touch.

    Pressures are means of facets, as in the contacts of a scene.
    """
    last = history["contact_increment"] == history.sizes["increment"] - 1
    pressed = (last & (history["contact_pressure"] > 0) & (history["contact_crossing"] >= 0)).to_numpy()
    points = {name: history[f"contact_{name}"].to_numpy()[pressed] for name in NAMES}
    area = 0.5 * float(points["area"].sum()) / history.sizes["crossing"]
    facets = np.column_stack([points["yarn"], points["cell"]])
    _, first, number = np.unique(facets, axis=0, return_index=True, return_inverse=True)
    mean = np.bincount(number.ravel(), points["pressure"] * points["area"]) / points["cell_area"][first]
    return area, float(mean.max()), int(pressed.sum())


def draw(table: pd.DataFrame, options: argparse.Namespace) -> None:
    """Draw errors of force and area over degrees of freedom: dashes by element, colours by refinement."""
    from matplotlib.figure import Figure

    done = table[table["force [N]"].notna()]
    finest = done.loc[done["degrees of freedom [1]"].idxmax()]
    colours = {value: f"C{number}" for number, value in enumerate(sorted(done["refinement"].unique()))}
    dashes = dict(zip(done["element"].unique(), ("-o", "--s", ":^"), strict=False))
    panels = (("force [N]", options.force), ("area of a crossing [mm2]", options.area))
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    for axes, (name, limit) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        for (element, refinement), rows in done.groupby(["element", "refinement"]):
            label = f"{element}, {refinement:g}"
            error = 100 * (rows[name] / (limit or finest[name]) - 1)
            freedom = 1e-3 * rows["degrees of freedom [1]"]
            axes.semilogx(freedom, error, dashes[element], c=colours[refinement], ms=4, label=label)
        axes.axhline(0, c="k", lw=0.6)
        axes.set_xticks([5, 10, 20, 50], ["5", "10", "20", "50"])
        axes.set_xticks([], minor=True)
        axes.set_xlabel("degrees of freedom (thousands)")
        axes.set_title(f"error of the {name.split(' [')[0]} (%)", fontsize=9)
        axes.grid(True, lw=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right center", fontsize=7)
    figure.savefig(options.picture, dpi=110)


def pairs(texts: list[str]) -> dict[str, Any]:
    """Return keys and values of texts KEY=VALUE, values as in the configuration's files."""
    return {key: yaml.safe_load(value) for key, _, value in (text.partition("=") for text in texts)}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--case", choices=["hertz", "cell"], default="hertz")
    parser.add_argument("--angle", type=float, default=90.0, help="at which cylinders cross (degrees)")
    parser.add_argument("--elements", nargs="+", default=["one_point"])
    parser.add_argument(
        "--sizes", nargs="+", type=float, default=[6.0, 8.0], help="elements over the diameter"
    )
    parser.add_argument("--refinements", nargs="+", type=float, default=[1.0, 1.5, 2.0, 3.0])
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="keys with other values")
    parser.add_argument("--picture", type=Path, help="file of the picture")
    parser.add_argument("--force", type=float, help="converged force [N]")
    parser.add_argument("--area", type=float, help="converged area of a crossing [mm2]")
    return parser.parse_args()


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
