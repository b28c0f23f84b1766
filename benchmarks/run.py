"""Time and memory of scenes, models, linear solvers and CalculiX; prints and keeps ``results/tables/bench.csv``.

    python benchmarks/run.py [--parts models solvers threads peer sizes] [--scene dns-tie-course] [--threads 2]

Every row is measured in a process of its own, one after the other; run nothing else meanwhile. The column
``over the first`` holds the time over that of the first row of the same part: compare ratios, not seconds, between two
versions of the code or two machines. ``--parts large`` runs knits of 3 x 3 to 30 x 30 cells, for hours. The part
``curve`` measures the processor time of a cell's curve with the start of the interpreter, over that of the start.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import calculix
import cases
import measure
import pandas as pd

from knitstudy import CellOfBeams, CellOfSplineYarns, CellStrain, Pattern, SetYarn, SolidYarn
from knitstudy.datasets import write_table
from knitstudy.errors import KnitstudyError
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.configuration import load_scene, load_scenes

TABLE = Path("results/tables/bench.csv")

SOLVERS = ("three_scale", "amg", "lu")

SIZES = (3, 6, 10, 20, 30)
"""Loops and rows of tied networks."""

LARGE = (3, 10, 30)
"""Loops and rows of knits of spline yarns."""

FRICTION = "dns-isotropic-course"

DISCRETISATIONS = {
    "one-point hexahedra": {},
    "quadratic hexahedra": {"mesh.element": "quadratic", "mesh.size": 2 / 3, "mesh.refinement": 2},
    "spline yarns, degree 2": {"fidelity": "spline_yarns"},
    "spline yarns, degree 3": {"fidelity": "spline_yarns", "mesh.degree": 3, "mesh.crossing_degree": 3},
}
"""Changes of a scene of one-point hexahedra."""

LOOP = {
    "pattern": Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1),
    "load": CellStrain(strain=0.3, lateral="free"),
}
YARN = {"diameter": 0.25e-3, "youngs_modulus": 200e6}

SLIPS = {"contact.friction": 0.3}

CURVES = {
    "beams": (CellOfBeams(**LOOP, yarn=SetYarn(**YARN)).vary(SLIPS), 3.0),
    "spline yarns": (CellOfSplineYarns(**LOOP, yarn=SolidYarn(**YARN)).vary(SLIPS), 8.0),
}
"""Cells of the jersey of docs/tutorial/jersey.md, and the processor time that a curve may take [s]."""

STARTED = "import knitstudy.knit.simulate, knitstudy.run.simulations"
"""What every simulation imports."""

SIMULATED = """
import json, sys
from knitstudy import Scene, simulate, simulate_many

scenes = [Scene.from_dict(keys) for keys in json.loads(sys.argv[1])]
if len(scenes) == 1:
    simulate(scenes[0], sys.argv[2])
else:
    simulate_many(scenes, sys.argv[2], jobs=2)
"""

MANY = 6  # frictions of a study, each with two moduli

Rows = Iterator[tuple[str, dict]]


def main() -> None:
    """Measure the parts that the command line asks for, print and keep the table."""
    options = _options()
    rows = []
    for part in options.parts:
        first = None
        with tempfile.TemporaryDirectory() as scratch:
            for case, measured in PARTS[part](options, Path(scratch)):
                seconds = next(
                    (measured[key] for key in ("path_s", "wall_s", "processor_s") if key in measured), 0
                )
                first = first or seconds
                ratio = {"over the first": seconds / first} if seconds else {}
                rows.append({"part": part, "case": case} | ratio | measured)
                print(rows[-1], file=sys.stderr, flush=True)
    table = pd.DataFrame(rows)
    write_table(table, TABLE)
    print(table.to_string(index=False, float_format="{:.4g}".format, na_rep=""))
    print(f"Kept in {TABLE}")


def models(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure a simulation, and the reduced models that take their joints from it."""
    scene = load_scene(options.scene)
    cases.prepare(scene, folder)
    yield options.scene, _measured("run_solid", scene, folder, options)
    for name, reduced in load_scenes().items():
        if reduced.value("rom.contacts_from") == options.scene:
            yield name, _measured("run_reduced", reduced, folder, options)


def sizes(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure tied spatial networks of larger and larger knits."""
    for size in SIZES:
        knit = {"pattern.loops": size, "pattern.rows": size, "rom.contacts_from": None}
        scene = load_scene("rom3d-tie-course").vary(knit)
        own = folder / str(size)
        own.mkdir()
        cases.prepare(scene, own)
        yield f"{size} x {size}", _measured("run_reduced", scene, own, options)


def solvers(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure every linear solver on the tangents at both ends of the loading."""
    scene = load_scene(options.scene)
    cases.prepare(scene, folder)
    _measured("write_tangents", scene, folder, options)
    for load in (0, 1):
        for solver in SOLVERS:
            yield (
                f"{solver}, load {load}",
                _measured("solve", scene, folder, options, load=load, solver=solver),
            )


def threads(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure all discretisations, with ties and with friction, on one and on more threads."""
    for name in (options.scene, FRICTION):
        for label, changes in DISCRETISATIONS.items():
            own = folder / f"{name} {label}"
            own.mkdir()
            scene = load_scene(name).vary({"load.stops": []} | changes)
            cases.prepare(scene, own)
            for count in (1, options.threads):
                measured = measure.run("cases:run_solid", count, scene=scene.to_dict(), folder=str(own))
                yield f"{name}, {label}, {count} threads", measured


def peer(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure CalculiX and this code on the same mesh, with the same ties, contact and number of increments."""
    for name in (options.scene, FRICTION):
        own = folder / name
        own.mkdir()
        scene = load_scene(name).vary({"load.stops": []})
        cases.prepare(scene, own)
        yield f"{name}, this code", _measured("run_solid", scene, own, options)
        if calculix.available():
            yield f"{name}, CalculiX", cases.run_calculix(scene, own, options.threads)
        else:
            yield f"{name}, CalculiX is not installed", {}


def large(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure knits of spline yarns of rising size; their restart files stay in run/large."""
    kept = Path("run/large")
    kept.mkdir(parents=True, exist_ok=True)
    for name in (options.scene, FRICTION):
        for size in LARGE:
            knit = {"pattern.loops": size, "pattern.rows": size, "fidelity": "spline_yarns"}
            scene = load_scene(name).vary(knit | {"load.stops": [], "outputs": []})
            restart = kept / f"{scene.hash[:16]}.npz"
            measured = measure.run(
                "cases:run_whole", options.threads, scene=scene.to_dict(), restart=str(restart)
            )
            yield f"{name}, {size} x {size}", measured


def curve(options: argparse.Namespace, folder: Path) -> Rows:
    """Measure the start, a cell's curve by each model, and a curve of a study of frictions and moduli with beams."""
    yield "start", _processor(STARTED)
    for name, (cell, bar) in CURVES.items():
        yield f"a curve, {name}", _processor(SIMULATED, [cell], folder / name) | {"bar_s": bar}
    cell, bar = CURVES["beams"]
    keys = [
        {"contact.friction": 0.1 * (1 + step), "yarn.youngs_modulus": modulus}
        for step in range(MANY)
        for modulus in (200e6, 400e6)
    ]
    spent = _processor(SIMULATED, [cell.vary(changes) for changes in keys], folder / "many")
    yield f"one of {len(keys)} curves, beams", {"processor_s": spent["processor_s"] / len(keys), "bar_s": bar}


def _processor(program: str, scenes: list[Scene] = (), folder: Path = Path()) -> dict:
    """Return the processor time of a fresh interpreter, on one thread, and of its children [s]: the least of two runs.

    The first run leaves the bytecode of all modules, which an installed package has: it takes 0.3 s.
    """
    spent = []
    with tempfile.TemporaryDirectory() as bytecode:
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPYCACHEPREFIX": bytecode}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for run in ("first", "second"):
            given = json.dumps([scene.to_dict() for scene in scenes]), str(folder / run)
            before = getrusage(RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", program, *given], env=environment, check=True)
            after = getrusage(RUSAGE_CHILDREN)
            spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return {"processor_s": min(spent)}


PARTS = {part.__name__: part for part in (models, sizes, solvers, threads, peer, curve, large)}


def _measured(function: str, scene: Scene, folder: Path, options: argparse.Namespace, **more) -> dict:
    keys = {"scene": scene.to_dict(), "folder": str(folder)}
    return measure.run(f"cases:{function}", options.threads, **keys, **more)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--parts", nargs="+", choices=PARTS, default=[part for part in PARTS if part != "large"]
    )
    parser.add_argument("--scene", default="dns-tie-course", help="tied scene of hexahedra (%(default)s)")
    parser.add_argument("--threads", type=int, default=2, help="threads of every process (%(default)s)")
    return parser.parse_args()


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
