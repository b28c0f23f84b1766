"""How much force and out-of-plane motion of a knit depend on numbers that nobody prints.

    python benchmarks/sensitivity.py --scene dns-tie-course --set pattern.loops=1 pattern.rows=1
    python benchmarks/sensitivity.py --scene dns-isotropic-course --vary "mesh.size=[0.45e-3, 0.36e-3]"

One number at a time is changed from the scene's value: element size, increments, clearance and so on (`CHANGES`).
Prints and keeps ``results/tables/sensitivity_SCENE.csv`` and, for what can be refined, the orders at which force and
motion converge, and their limits, in ``sensitivity_SCENE_orders.csv``. Failed increments are reported on the way.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.optimize import minimize_scalar

from knitstudy.errors import KnitstudyError
from knitstudy.files import write_table
from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.mesh.mesher import mesh_scene
from knitstudy.models.simulate import solve
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene

TABLES = Path("results/tables")

EARLY = 0.02
"""Strain at which forces are compared before full load."""

TIE = {
    "mesh.size": (0.6e-3, 0.45e-3, 0.36e-3, 0.3e-3, 0.225e-3),
    "mesh.growth": (1.0, 1.5),
    "solver.hourglass": (0.0025, 0.01, 0.05),
    "solver.increments": (5, 20, 40),
    "pattern.clearance": (0.005, 0.02, 0.04),
    "yarn.material": ("neo_hookean", "st_venant_kirchhoff"),
    "load.lateral": ("free",),
}

CONTACT = {
    "mesh.size": (0.6e-3, 0.45e-3, 0.36e-3, 0.3e-3),
    "solver.increments": (24, 48),
    "pattern.clearance": (0.005, 0.02),
    "contact.normal_stiffness contact.tangential_stiffness": (3, 30),
    "contact.normal_stiffness": (3, 30),
    "contact.tangential_stiffness": (3, 30),
    "contact.points": (2, 4),
}

CHANGES = {"tie": TIE, "rough": CONTACT, "isotropic": CONTACT | {"contact.friction": (0.1, 0.3, 0.44)}}
"""By interaction: values of each key, or of several keys together; the scene's own comes first in the table."""

FINENESS = {
    "mesh.size": 1,
    "solver.increments": -1,
    "pattern.clearance": 1,
    "contact.normal_stiffness contact.tangential_stiffness": -1,
}
"""What can be refined, and the power of it that goes to zero then."""


def main() -> None:
    """Run the sweep, print and keep its tables."""
    options = _options()
    scene = load_scene(options.scene).vary(_pairs(options.set))
    if scene.load.strain > EARLY:
        scene = scene.replace("load.stops", [EARLY])
    table = sweep(scene, _pairs(options.vary) or CHANGES[scene.interaction])
    _keep(table, f"sensitivity_{scene.name}")
    _keep(orders(table, scene), f"sensitivity_{scene.name}_orders")


def sweep(scene: Scene, changes: Mapping[str, Sequence]) -> pd.DataFrame:
    """Return what came out with every change, one a row; refused scenes with the reason."""
    rows = [{"key": "none", "value": "", **measure(scene)}]
    for keys, values in changes.items():
        for value in values:
            try:
                changed = scene.vary(dict.fromkeys(keys.split(), value))
                if changed.hash == scene.hash:
                    continue
                rows.append({"key": keys, "value": value, **measure(changed)})
            except KnitstudyError as error:
                rows.append({"key": keys, "value": value, "refused": str(error)})
            print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    table["force over the scene's [1]"] = table["force [N]"] / table["force [N]"][0]
    return table


def measure(scene: Scene) -> dict:
    """Pull a scene and return what came out."""
    specimen = Fabric.from_dataset(lay_out(scene))
    mesh = mesh_scene(scene, specimen)
    history = solve(scene, specimen, mesh=mesh)
    strain, energy = history["strain"].to_numpy(), history["energy"].isel(increment=-1)
    measured = {
        "degrees of freedom [1]": mesh.nodes.size,
        "increments [1]": history.sizes["increment"] - 1,
        f"force at {EARLY:.0%} [N]": float(np.interp(EARLY, strain, history["force"], right=np.nan)),
        "force [N]": float(history["force"][-1]),
        "largest u_z [mm]": 1e3 * float(np.abs(history["centreline_displacement"][-1, :, 2]).max()),
        "hourglass over internal energy [1]": float(
            energy.sel(form="hourglass") / energy.sel(form="internal")
        ),
    }
    if (history["crossing_tied"] == 1).any():
        measured["tied area a crossing [mm2]"] = 1e6 * float(history["tied_area"].mean())
    if "smallest_gap" in history:
        measured["deepest penetration over h [1]"] = (
            -float(history["smallest_gap"].min()) / scene.mesh.smallest
        )
        measured["augmentations [1]"] = int(history["augmentations"].sum())
    return measured


def orders(table: pd.DataFrame, scene: Scene) -> pd.DataFrame:
    """Return order and limit of force and motion for all that can be refined (`FINENESS`)."""
    rows = []
    for keys, power in FINENESS.items():
        own = scene.value(keys.split()[0])
        runs = table[table["key"].isin(["none", keys]) & table["force [N]"].notna()]
        fineness = runs["value"].replace("", own).astype(float).to_numpy() ** power
        fineness, kept = np.unique(fineness, return_index=True)
        if len(kept) < 3:
            continue
        for name in (f"force at {EARLY:.0%} [N]", "force [N]", "largest u_z [mm]"):
            order, limit = converging(fineness, runs[name].to_numpy()[kept])
            rows.append({"key": keys, "of": name, "order": order, "limit": limit})
    return pd.DataFrame(rows)


def converging(fineness: np.ndarray, value: np.ndarray) -> tuple[float, float]:
    """Return order p and limit of value = limit + factor * fineness**p, by least squares.

    Parameters
    ----------
    fineness : ndarray, shape (k,)
        At least three different positive numbers that go to zero as what they belong to is refined.
    value : ndarray, shape (k,)
        What was computed with them.

    Returns
    -------
    order, limit : float
        Not a number if the values do not change in one direction, or not ever less.
    """
    lowest, highest = 0.1, 8.0

    def fit(order: float) -> tuple[np.ndarray, float]:
        powers = np.stack([np.ones(len(value)), (fineness / fineness.max()) ** order], axis=-1)
        factors = np.linalg.lstsq(powers, value)[0]
        return factors, float(np.linalg.norm(powers @ factors - value))

    order = minimize_scalar(lambda order: fit(order)[1], bounds=(lowest, highest), method="bounded").x
    steps = np.diff(value[np.argsort(fineness)])
    if not (np.all(steps > 0) or np.all(steps < 0)) or not lowest + 0.01 < order < highest - 0.01:
        return np.nan, np.nan
    return float(order), float(fit(order)[0][0])


def _keep(table: pd.DataFrame, name: str) -> None:
    write_table(table, TABLES / f"{name}.csv")
    print(table.to_string(index=False, float_format="{:.5g}".format, na_rep=""))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="dns-tie-course", help="DNS scene to start from (%(default)s)")
    parser.add_argument(
        "--set", nargs="+", default=[], metavar="KEY=VALUE", help="keys with other values than the scene's"
    )
    parser.add_argument(
        "--vary",
        nargs="+",
        default=[],
        metavar="KEY=[VALUE,...]",
        help="changes to make instead of the usual ones",
    )
    return parser.parse_args()


def _pairs(texts: Sequence[str]) -> dict[str, Any]:
    """Return keys and values of texts KEY=VALUE, values as in the configuration's files."""
    return {key: yaml.safe_load(value) for key, _, value in (text.partition("=") for text in texts)}


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
