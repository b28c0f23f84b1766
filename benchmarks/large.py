"""Large knits of solid yarns, tied and with friction, to 5 %: time, memory and Krylov iterations as the knit grows.

    python benchmarks/large.py [--cases tie-3 tie-10 tie-30] [--increments 12] [--threads 2] [--folder run/large]

Quadratic polynomials over the section, the fewest unknowns that bend: what low degrees do not show of a patch is in the
ties and in the law of contact. Every case has a process of its own and a restart file in the folder: one that was
interrupted goes on where it was, and counts the time of its increments from both. Prints and keeps
``results/tables/large.csv``.
"""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path

import measure
import pandas as pd
from knits import cost

from knitstudy.errors import KnitstudyError
from knitstudy.files import write_table
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.restart import Run
from knitstudy.loading.solve import solve_load_path
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.simulate import build
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene

TABLE = Path("results/tables/large.csv")

SIZES = (3, 10, 30)

CASES = {
    f"{kind}-{size}": (scene, size)
    for kind, scene in (("tie", "dns-tie-course"), ("friction", "dns-isotropic-course"))
    for size in SIZES
}

CHANGES = {
    "fidelity": "spline_yarns",
    "load.stops": [],
    "outputs": [],
}


def main() -> None:
    """Measure the cases that the command line asks for, and print and keep the table."""
    options = _options()
    folder = Path(options.folder)
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.cases:
        label, size = CASES[name]
        knit = {"pattern.loops": size, "pattern.rows": size, "solver.increments": options.increments}
        scene = load_scene(label).vary(CHANGES | knit)
        restart = folder / f"{name}-{scene.hash[:16]}.npz"
        measured = measure.run("large:here", options.threads, scene=scene.to_dict(), restart=str(restart))
        per_newton = measured["krylov_iterations"] / max(measured["newton_iterations"], 1)
        rows.append({"case": name, "krylov_per_newton": per_newton} | measured)
        print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    write_table(table, TABLE)
    print(table.to_string(index=False, float_format="{:.4g}".format, na_rep=""))
    print(f"Kept in {TABLE}")


def here(scene: dict, restart: str) -> dict:
    """Lay a scene out and follow it, from its restart file if there is one."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    wanted = Scene.from_dict(scene)
    measure.ready()
    resumed = Path(restart).exists()
    geometry = STAGES["geometry"].function(wanted)
    mesh = STAGES["mesh"].function(wanted, geometry)
    problem = build(wanted, Fabric.from_dataset(geometry), mesh=SweptMesh.from_dataset(mesh))
    setup = problem.meter.read().seconds
    run = Run(restart=Path(restart))
    history = solve_load_path(problem, run)
    run.forget()
    found = cost(history) | {"setup_s": setup, "resumed": resumed}
    return found | {"increments_s": float(history["seconds"].sum())}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=["tie-3", "tie-10", "tie-30"])
    parser.add_argument("--increments", type=int, default=12, help="solver.increments (%(default)s)")
    parser.add_argument("--threads", type=int, default=2, help="threads of every process (%(default)s)")
    parser.add_argument("--folder", default="run/large", help="where restart files lie (%(default)s)")
    return parser.parse_args()


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
