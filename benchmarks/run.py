"""What every scene, every linear solver and the peer cost; prints and keeps ``results/tables/bench.csv``.

    python benchmarks/run.py [--scene dns-tie-course] [--threads 2]

Every row is measured in a process of its own, one after the other: leave the machine alone meanwhile.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import knits
import measure
import pandas as pd

from knitstudy.errors import KnitstudyError
from knitstudy.exchange import calculix
from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.files import write_table
from knitstudy.loading.load_path import DIRECTIONS
from knitstudy.study.configuration import load_scene, load_scenes

TABLE = Path("results/tables/bench.csv")
SOLVERS = ("three_scale", "amg", "lu")
SIZES = (3, 6, 10, 20, 30)
"""Loops and rows of the reduced models that show how their cost grows."""
INCREMENTS = (3, 6)
"""Numbers of increments of the smallest of them, beside the scene's own: its force should not depend on them."""


def main() -> None:
    """Measure everything, print and keep the table."""
    options = _options()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        knits.prepare(load_scene(options.scene), folder)
        for part in (_scenes, _tiled, _solvers, _peer):
            for measured in part(options, folder):
                rows.append(measured)
                print({name: _short(value) for name, value in measured.items()}, file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    write_table(table, TABLE)
    print(table.to_string(index=False, float_format="{:.4g}".format, na_rep=""))
    print(f"Kept in {TABLE}")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="dns-tie-course", help="DNS scene to measure (%(default)s)")
    parser.add_argument("--threads", type=int, default=2, help="threads of every process (%(default)s)")
    return parser.parse_args()


def _short(value):
    return round(value, 4) if isinstance(value, float) else value


def _scenes(options: argparse.Namespace, folder: Path):
    """The DNS, the reduced models that take their joints from it, and how many times as fast these are."""
    where = {"folder": str(folder)}
    direct = measure.run("knits:run_dns", options.threads, scene=options.scene, **where)
    yield {"benchmark": "scene", "case": options.scene, **direct}
    for name, scene in load_scenes().items():
        if scene.value("rom.contacts_from") == options.scene:
            reduced = measure.run("knits:run_reduced", options.threads, scene=name, **where)
            faster = direct["path_s"] / reduced["path_s"]
            yield {"benchmark": "scene", "case": name, "times_as_fast": faster, **reduced}


def _tiled(options: argparse.Namespace, folder: Path):
    """Reduced models of larger knits of the same loop, and the smallest in fewer increments."""
    name, scene = next(
        (name, scene)
        for name, scene in load_scenes().items()
        if (scene.interaction, scene.value("rom.joint")) == ("tie", "rigid")
        and scene.value("rom.contacts_from") == options.scene
    )
    usual = scene.solver.increments
    for loops, increments in [(SIZES[0], few) for few in INCREMENTS] + [(size, usual) for size in SIZES]:
        measured = measure.run(
            "knits:run_tiled",
            options.threads,
            scene=name,
            folder=str(folder),
            loops=loops,
            increments=increments,
        )
        yield {"benchmark": "3D reduced model", "case": f"{loops} x {loops}", **measured}


def _solvers(options: argparse.Namespace, folder: Path):
    """Every linear solver on the tangents at both ends of the loading."""
    where = {"scene": options.scene, "folder": str(folder)}
    measure.run("linear_solvers:write_tangents", options.threads, **where)
    for state, strain in (("start", "0%"), ("end", "5%")):
        for solver in SOLVERS:
            measured = measure.run(
                "linear_solvers:solve", options.threads, state=state, solver=solver, **where
            )
            yield {"benchmark": "linear solve to 1e-8", "case": f"{solver} at {strain}", **measured}


def _peer(options: argparse.Namespace, folder: Path):
    """CalculiX and this code on the same mesh, with the same ties and the same number of increments."""
    kind = "peer"
    scene = load_scene(options.scene)
    if not calculix.available():
        yield {"benchmark": kind, "case": f"CalculiX, {scene.name}: not installed"}
        return
    knit, mesh = knits.load(str(folder))
    deck = replace(specimen_deck(scene, knit, mesh), fields=False)
    write_inp(deck, folder / "peer.inp", "calculix")
    run = calculix.run(folder / "peer.inp", options.threads)
    yield {
        "benchmark": kind,
        "case": f"CalculiX, {scene.name}",
        "dof": mesh.nodes.size,
        "increments": len(run.time),
        "newton_iterations": int(run.iterations.sum()),
        "force_N": float(run.force[-1, DIRECTIONS.index(scene.load.direction)]),
        "wall_s": run.seconds,
        "memory_growth_MB": run.memory_growth / 1e6,
        "memory_peak_MB": run.memory_peak / 1e6,
    }
    here = measure.run("knits:run_dns", options.threads, scene=scene.name, folder=str(folder))
    yield {"benchmark": kind, "case": f"this code, {scene.name}", **here}


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
