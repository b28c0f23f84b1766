"""How long the 3 x 3 knit takes with one and two threads, beside CalculiX: ties, friction, and all discretisations.

    python benchmarks/speed.py [--cases tie friction-course] [--increments 12] [--no-calculix] [--log FILE]

Every run has a process of its own, one after the other, to 5 % without stops: leave the machine alone meanwhile.
CalculiX, where it is installed, gets the same mesh and the same ties, C3D8R for the one-point element and C3D20R for
the quadratic one; with friction it takes ten minutes a case. Solid yarns cannot be written as a deck: their times stand
beside those of hexahedra in the same case.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import calculix_contact
import knits
import measure
import pandas as pd

from knitstudy.errors import KnitstudyError
from knitstudy.exchange import calculix
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene

SCENES = {
    "tie": "dns-tie-course",
    "friction-course": "dns-isotropic-course",
    "friction-wale": "dns-isotropic-wale",
}

DISCRETISATIONS = {
    "": {},
    ", quadratic": {"mesh.element": "quadratic", "mesh.size": 0.6e-3, "mesh.refinement": 2},
    ", solid yarns": {"fidelity": "spline_yarns"},
    ", solid yarns p3": {"fidelity": "spline_yarns", "mesh.degree": 3, "mesh.crossing_degree": 3},
}
"""What changes a scene from one-point hexahedra of 0.3 mm."""

CASES = {
    f"{case}{suffix}": (scene, changes)
    for case, scene in SCENES.items()
    for suffix, changes in DISCRETISATIONS.items()
}

THREADS = 2


def main() -> None:
    """Measure the cases that the command line asks for, and print and keep the table."""
    options = _options()
    rows, one_point = [], {}
    for name in options.cases:
        label, changes = CASES[name]
        path = {"load.stops": [], "solver.increments": options.increments}
        scene = load_scene(label).vary(path | changes)
        with tempfile.TemporaryDirectory() as folder:
            knits.prepare(scene, Path(folder))
            found = {f"{count} threads": _here(scene, folder, count) for count in (1, THREADS)}
            peer = name.endswith("quadratic") or not changes
            if options.calculix and peer and calculix.available():
                ties_alone = not scene.kind.interaction.touches
                found["CalculiX"] = calculix_contact.there(scene, Path(folder), THREADS, rests=not ties_alone)
        alone = found["1 threads"]["wall_s"]
        peer_s = found.get("CalculiX", {}).get("wall_s")  # there is none where it ended with an error
        for who, measured in found.items():
            over = {}
            if "wall_s" in measured:
                over["over one thread"] = alone / measured["wall_s"]
                if peer_s:
                    over["over CalculiX"] = measured["wall_s"] / peer_s
            hexahedra = one_point.setdefault((label, who), measured if not changes else {})
            for cost in ("wall_s", "memory_growth_MB"):
                if cost in hexahedra and cost in measured:
                    over[f"{cost} over one-point hexahedra"] = measured[cost] / hexahedra[cost]
            rows.append({"case": name, "who": who} | measured | over)
            print(rows[-1], file=sys.stderr, flush=True)
    text = pd.DataFrame(rows).to_string(index=False, float_format="{:.4g}".format, na_rep="") + "\n"
    print(text, end="")
    if options.log:
        Path(options.log).write_text(text, encoding="utf-8")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--increments", type=int, default=12, help="solver.increments (%(default)s)")
    parser.add_argument("--no-calculix", dest="calculix", action="store_false", help="this code alone")
    parser.add_argument("--log", help="file that keeps the table")
    return parser.parse_args()


def _here(scene: Scene, folder: str, threads: int) -> dict:
    return measure.run("speed:here", threads, scene=scene.to_dict(), folder=folder)


def here(scene: dict, folder: str) -> dict:
    """Run a scene on the knit and the mesh in a folder."""
    return knits.run_direct(Scene.from_dict(scene), folder)


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
