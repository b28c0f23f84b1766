"""A knit in contact, pulled by CalculiX and by this code on the same mesh: forces, and what they cost.

    python benchmarks/calculix_contact.py dns-isotropic-course --size 0.45e-3 --increments 12 --log FILE

Both codes get the same mesh, ties, law of contact and number of increments; this code takes CalculiX's law of the
material and the hourglass stiffness nearest to its. Every run has a process of its own, one after the other: leave
the machine alone meanwhile. With ``--first-step`` CalculiX also runs without the step of rest before the load, in
which case its forces depend on the increments (docs/decks.md).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import knits
import measure
import numpy as np
import pandas as pd

from knitstudy.errors import ConvergenceError, KnitstudyError
from knitstudy.exchange import calculix
from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.loading.load_path import DIRECTIONS
from knitstudy.models.simulate import solve
from knitstudy.models.yarn_contact import contact_law
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene

STRAINS = (0.01, 0.03, 0.05)

CALCULIX_HOURGLASS = 0.008
"""What CalculiX's hourglass coefficient is in this code's normalisation, over 1 + nu (docs/decks.md)."""


def main() -> None:
    """Run the comparison that the command line asks for, and print and keep its table."""
    options = _options()
    scene = _scene(options)
    rows = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        knits.prepare(scene, folder)
        rows["this code"] = measure.run(
            "calculix_contact:here", options.threads, scene=scene.to_dict(), folder=scratch
        )
        rows["CalculiX"] = there(scene, folder, options.threads)
        if options.first_step:
            rows["CalculiX, no step of rest"] = there(scene, folder, options.threads, rests=False)
    text = _table(scene, rows, options.threads)
    print(text, end="")
    if options.log:
        Path(options.log).write_text(text, encoding="utf-8")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", help="a dns scene of a knit in config/scenes")
    parser.add_argument("--loops", type=int, help="instead of the scene's")
    parser.add_argument("--rows", type=int, help="instead of the scene's")
    parser.add_argument("--size", type=float, help="element size in m, instead of the scene's")
    parser.add_argument("--increments", type=int, help="instead of the scene's")
    parser.add_argument("--tied-edges", choices=("outer", "none"), help="instead of the scene's")
    parser.add_argument("--friction", type=float, help="instead of the scene's")
    parser.add_argument("--first-step", action="store_true", help="CalculiX without a step of rest as well")
    parser.add_argument("--threads", type=int, default=1, help="of both codes (%(default)s)")
    parser.add_argument("--log", help="file that keeps the table")
    return parser.parse_args()


def _scene(options: argparse.Namespace) -> Scene:
    """The scene with the command line's changes, in St Venant-Kirchhoff's material and without stops."""
    scene = load_scene(options.scene)
    asked = {
        "pattern.loops": options.loops,
        "pattern.rows": options.rows,
        "mesh.size": options.size,
        "solver.increments": options.increments,
        "contact.tied_edges": options.tied_edges,
        "contact.friction": options.friction,
    }
    alike = {
        "yarn.material": "st_venant_kirchhoff",
        "solver.hourglass": CALCULIX_HOURGLASS * (1 + scene.yarn.poisson_ratio),
        "load.stops": [],
    }
    return scene.vary(alike | {key: value for key, value in asked.items() if value is not None})


def here(scene: dict, folder: str) -> dict:
    """Run this code on the knit and the mesh in a folder."""
    knit, mesh = knits.load(folder)
    measure.ready()
    history = solve(Scene.from_dict(scene), knit, mesh=mesh)
    strain, force = (history[name].to_numpy() for name in ("strain", "force"))
    return {
        "dof": int(history.attrs["dof"]),
        "increments": history.sizes["increment"] - 1,
        "newton_iterations": int(history["newton_iterations"].sum()),
        **_forces(strain, force),
    }


def there(scene: Scene, folder: Path, threads: int, rests: bool = True) -> dict:
    """Run CalculiX on the knit and the mesh in a folder; without contact nothing `rests` before the load."""
    knit, mesh = knits.load(str(folder))
    deck = specimen_deck(scene, knit, mesh)
    write_inp(replace(deck, fields=False, rests=rests), folder / "peer.inp", "calculix")
    try:
        run = calculix.run(folder / "peer.inp", threads)
    except ConvergenceError as error:
        return {"dof": mesh.nodes.size, "note": str(error)}
    at_rest = float(rests)  # that step lasts as long as one increment
    share = (run.time - at_rest) / (run.time[-1] - at_rest)
    return {
        "dof": mesh.nodes.size,
        "increments": len(run.time) - int(rests),
        "newton_iterations": int(run.iterations.sum()),
        **_forces(scene.load.strain * share, run.force[:, DIRECTIONS.index(scene.load.direction)]),
        "wall_s": run.seconds,
        "memory_growth_MB": run.memory_growth / 1e6,
        "memory_peak_MB": run.memory_peak / 1e6,
        "note": " ".join(run.warnings),
    }


def _forces(strain: np.ndarray, force: np.ndarray) -> dict[str, float]:
    """Force in N at the strains of the table, between increments by a straight line."""
    return {
        f"force at {wanted:.0%} [N]": float(np.interp(wanted, strain, force, right=np.nan))
        for wanted in STRAINS
    }


def _table(scene: Scene, rows: dict[str, dict], threads: int) -> str:
    notes = {label: row.pop("note", "") for label, row in rows.items()}
    law = contact_law(scene)
    return "\n".join(
        [
            f"{scene.name}, {scene.pattern.loops} x {scene.pattern.rows}, strain {scene.load.strain:g}, "
            f"{scene.interaction}, tied edges {scene.contact.tied_edges}",
            f"h = {1e3 * scene.mesh.size:g} mm, {law.normal:.4g} and {law.tangential:.4g} Pa/m, "
            f"friction {law.friction:g}, {threads} threads",
            "",
            pd.DataFrame(rows).to_string(float_format="{:.5g}".format, na_rep=""),
            *(f"{label}: {note}" for label, note in notes.items() if note),
            "",
        ]
    )


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
