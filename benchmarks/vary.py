"""Effect of keys of a scene on force, motion, contact and cost: one key at a time, or all combinations.

    python benchmarks/vary.py dns-tie-course --set pattern.loops=1 pattern.rows=1 --vary "mesh.size=[0.5, 0.4]"
    python benchmarks/vary.py pair-pressed-90 --vary "mesh.size=[0.22]" "mesh.refinement=[1, 2, 3]" --product

Prints and keeps ``results/tables/vary_SCENE.csv``. ``KEY1 KEY2=[...]`` gives several keys the same value. For keys that
can be refined (``mesh.size``, ``solver.increments``) and have three values or more, the order of convergence of the
force and its limit are printed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from scipy.optimize import minimize_scalar

from knitstudy.datasets import write_table
from knitstudy.errors import KnitstudyError
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate

FINER = {"mesh.size": 1, "pattern.clearance": 1, "solver.increments": -1, "contact.normal_stiffness": -1}
"""Keys that can be refined, and the power of their value that tends to 0."""


def main() -> None:
    """Run the scenes, print and keep the table."""
    options = _options()
    scene = load_scene(options.scene).vary(_pairs(options.set))
    rows = []
    for changes in _changes(_pairs(options.vary), options.product):
        try:
            keys = {key: value for names, value in changes.items() for key in names.split()}
            found = measure(scene.vary(keys))
        except KnitstudyError as error:
            found = {"refused": str(error)}
        rows.append(changes | found)
        print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    if "force [N]" in table:
        table["force over the first [1]"] = table["force [N]"] / table["force [N]"][0]
    path = Path(f"results/tables/vary_{scene.name}.csv")
    write_table(table, path)
    print(table.to_string(index=False, float_format="{:.5g}".format, na_rep=""))
    for names in set(_pairs(options.vary)) if not options.product else ():
        _print_order(table, names, scene)
    print(f"Kept in {path}")


def _changes(vary: dict[str, list], combined: bool) -> Iterator[dict]:
    """Yield the changes of a scene, first none or the first of all combinations."""
    if combined:
        yield from (dict(zip(vary, values, strict=True)) for values in product(*vary.values()))
        return
    yield {}
    yield from ({names: value} for names, values in vary.items() for value in values)


def measure(scene: Scene) -> dict[str, float]:
    """Simulate a scene and return force, motion and contact at full load, and processor time."""
    start = process_time()
    history = simulate(scene).history
    seconds = process_time() - start
    measured = {
        "degrees of freedom [1]": int(history.attrs["dof"]),
        "increments [1]": history.sizes["increment"] - 1,
        "force [N]": abs(float(history["force"][-1])),
        "largest u_z [mm]": 1e3 * float(np.abs(history["centreline_displacement"][-1, :, 2]).max()),
        "processor time [s]": seconds,
    }
    energy = history["energy"].isel(increment=-1).to_series()
    if "hourglass" in energy:
        measured["hourglass over internal energy [1]"] = energy["hourglass"] / energy["internal"]
    return measured | (_contact(history) if "contact_pressure" in history else {})


def _contact(history: xr.Dataset) -> dict[str, float]:
    """Return the mean area of a crossing and the largest mean pressure of a facet."""
    names = ("yarn", "cell", "area", "cell_area", "pressure")
    last = history["contact_increment"] == history.sizes["increment"] - 1
    pressed = (last & (history["contact_pressure"] > 0) & (history["contact_crossing"] >= 0)).to_numpy()
    if not pressed.any():
        return {"points in contact [1]": 0}
    points = {name: history[f"contact_{name}"].to_numpy()[pressed] for name in names}
    facets = np.column_stack([points["yarn"], points["cell"]])
    _, first, number = np.unique(facets, axis=0, return_index=True, return_inverse=True)
    mean = np.bincount(number.ravel(), points["pressure"] * points["area"]) / points["cell_area"][first]
    return {
        "points in contact [1]": int(pressed.sum()),
        "area of a crossing [mm2]": 0.5e6 * float(points["area"].sum()) / history.sizes["crossing"],
        "largest pressure [MPa]": 1e-6 * float(mean.max()),
    }


def _print_order(table: pd.DataFrame, names: str, scene: Scene) -> None:
    """Print order p and limit of force = limit + factor * fineness**p, by least squares."""
    key = names.split()[0]
    if key not in FINER or names not in table or "force [N]" not in table:
        return
    runs = table[(table[names].notna() | (table.index == 0)) & table["force [N]"].notna()]
    fineness = runs[names].fillna(scene.value(key)).astype(float).to_numpy() ** FINER[key]
    fineness, kept = np.unique(fineness, return_index=True)
    force = runs["force [N]"].to_numpy()[kept]

    def fit(order: float) -> tuple[np.ndarray, float]:
        powers = np.stack([np.ones(len(force)), (fineness / fineness.max()) ** order], axis=-1)
        factors = np.linalg.lstsq(powers, force)[0]
        return factors, float(np.linalg.norm(powers @ factors - force))

    steps = np.diff(force)
    if len(force) < 3 or not (np.all(steps > 0) or np.all(steps < 0)):
        print(f"{names}: no order, the force does not change in one direction over three values")
        return
    order = minimize_scalar(lambda value: fit(value)[1], bounds=(0.1, 8.0), method="bounded").x
    print(f"{names}: order {order:.2f}, limit {fit(order)[0][0]:.5g} N")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", help="scene to start from")
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="other values of the scene")
    parser.add_argument(
        "--vary", nargs="+", required=True, metavar="KEY=[VALUE,...]", help="values to compare"
    )
    parser.add_argument("--product", action="store_true", help="all combinations instead of one at a time")
    return parser.parse_args()


def _pairs(texts: list[str]) -> dict:
    """Return keys and values of texts KEY=VALUE, values as in the configuration's files."""
    return {key: yaml.safe_load(value) for key, _, value in (text.partition("=") for text in texts)}


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
