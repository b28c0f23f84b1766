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

from knitstudy import calculix, dns
from knitstudy.configuration import load_scene, load_scenes
from knitstudy.errors import KnitstudyError
from knitstudy.io import write_table
from knitstudy.mesh.deck import specimen_deck
from knitstudy.mesh.inp import write_inp

TABLE = Path("results/tables/bench.csv")
SOLVERS = ("three_scale", "amg", "lu")


def main() -> None:
    """Measure everything, print and keep the table."""
    options = _options()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        knits.prepare(load_scene(options.scene), folder)
        for measured in (*_scenes(options, folder), *_solvers(options, folder), *_peer(options, folder)):
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
    """The DNS and the reduced models that take their joints from it."""
    where = {"folder": str(folder)}
    yield {
        "benchmark": "scene",
        "case": options.scene,
        **measure.run("knits:run_dns", options.threads, scene=options.scene, **where),
    }
    for name, scene in load_scenes().items():
        if scene.rom.contacts_from == options.scene:
            yield {
                "benchmark": "scene",
                "case": name,
                **measure.run("knits:run_reduced", options.threads, scene=name, **where),
            }


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
    simulation = dns.assemble(scene, mesh, knit)
    deck = replace(specimen_deck(scene, knit, mesh, simulation.tie, "equations"), fields=False)
    write_inp(deck, folder / "peer.inp", "calculix")
    run = calculix.run(folder / "peer.inp", options.threads)
    yield {
        "benchmark": kind,
        "case": f"CalculiX, {scene.name}",
        "dof": mesh.nodes.size,
        "increments": len(run.time),
        "newton_iterations": int(run.iterations.sum()),
        "force_N": float(run.force[-1, 0]),
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
