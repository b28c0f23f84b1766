"""Time and memory of scenes, models, linear solvers and CalculiX; prints and keeps ``results/tables/bench.csv``.

    python benchmarks/run.py [--parts models solvers threads peer sizes] [--scene dns-tie-course] [--threads 2]

Every row is measured in a process of its own, one after the other; run nothing else meanwhile. The column
``over the first`` holds the time over that of the first row of the same part: compare ratios, not seconds, between two
versions of the code or two machines. ``--parts large`` runs knits of 3 x 3 to 30 x 30 cells, for hours.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import calculix
import cases
import measure
import pandas as pd

from knitstudy.errors import KnitstudyError
from knitstudy.files import write_table
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

Rows = Iterator[tuple[str, dict]]


def main() -> None:
    """Measure the parts that the command line asks for, print and keep the table."""
    options = _options()
    rows = []
    for part in options.parts:
        first = None
        with tempfile.TemporaryDirectory() as scratch:
            for case, measured in PARTS[part](options, Path(scratch)):
                seconds = measured.get("path_s", measured.get("wall_s"))
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
            changed = scene.replace("solver.linear", solver)
            yield f"{solver}, load {load}", _measured("solve", changed, folder, options, load=load)


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


PARTS = {part.__name__: part for part in (models, sizes, solvers, threads, peer, large)}


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
