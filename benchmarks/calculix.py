"""The tied knit of a scene, pulled by CalculiX and by this code on the same mesh: forces, and what they cost.

    python benchmarks/calculix.py dns-tie-course --loops 2 --rows 2 --log benchmarks/calculix-2x2.log

Both codes use St Venant-Kirchhoff's law and tie facets. This code runs twice, with CalculiX's own hourglass control,
where the forces should be the same, and with its own; CalculiX runs with its own search for ties, and with the
constraints of this code as equations.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from knitstudy.errors import KnitstudyError
from knitstudy.exchange import calculix
from knitstudy.exchange.deck import CONSTRAINTS, specimen_deck
from knitstudy.exchange.inp import write_inp
from knitstudy.geometry.lay_out import lay_out
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mesh.knit import mesh_scene
from knitstudy.models import solid_yarns as dns
from knitstudy.models.solid_yarns import SolidYarns
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene


@dataclasses.dataclass(frozen=True)
class Pull:
    """Forces (i,) in N, iterations, wall time in s and, of CalculiX, memory growth in MB of one run."""

    label: str
    force: np.ndarray
    iterations: int
    seconds: float
    memory: float = np.nan
    notes: tuple[str, ...] = ()


def main() -> None:
    """Run the comparison that the command line asks for, and print and keep its table."""
    options = _options()
    asked = {
        "pattern.loops": options.loops,
        "pattern.rows": options.rows,
        "solver.increments": options.increments,
    }
    changes = {key: value for key, value in asked.items() if value is not None}
    scene = load_scene(options.scene).vary(
        {"yarn.material": "st_venant_kirchhoff", "tie.rule": "facets"} | changes
    )
    knit = Knit.from_dataset(lay_out(scene))
    yarns = dns.assemble_yarns(scene, mesh_scene(scene, knit), knit)
    problem = dns.problem_of(yarns, scene, knit)
    pulls = [
        _here(problem, f"this code, hourglass coefficient {scene.solver.hourglass}", yarns.model),
        *(_there(yarns, scene, knit, kind, options.threads) for kind in CONSTRAINTS),
    ]
    text = _table(problem, knit, pulls, options.threads)
    print(text, end="")
    if options.log:
        Path(options.log).write_text(text, encoding="utf-8")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", help="a dns scene of config/scenes")
    parser.add_argument("--loops", type=int, help="instead of the scene's")
    parser.add_argument("--rows", type=int, help="instead of the scene's")
    parser.add_argument("--increments", type=int, help="instead of the scene's")
    parser.add_argument(
        "--threads", type=int, default=1, help="of CalculiX; this code follows OMP_NUM_THREADS"
    )
    parser.add_argument("--log", help="file that keeps the table")
    return parser.parse_args()


def _here(problem: Problem, label: str, model: SolidModel) -> Pull:
    started = time.perf_counter()
    path = list(_forces(problem, model))
    return Pull(
        label=label,
        force=np.array([force for force, _ in path]),
        iterations=sum(count for _, count in path),
        seconds=time.perf_counter() - started,
    )


def _forces(problem: Problem, model: SolidModel):
    """Reaction and iterations of every increment; increments are dropped as soon as they are read."""
    prescribed = problem.prescribed
    pulled = prescribed.fixed[prescribed.value[-1] != 0]
    for increment in trace(model, prescribed, problem.settings, problem.solver):
        if increment.index:
            yield float(increment.response.force[pulled].sum()), increment.newton_iterations


def _there(yarns: SolidYarns, scene: Scene, knit: Knit, constraints: str, threads: int) -> Pull:
    deck = specimen_deck(scene, knit, yarns.parts.mesh, yarns.tie, constraints)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.inp"
        write_inp(dataclasses.replace(deck, fields=False), path, "calculix")
        run = calculix.run(path, threads)
    return Pull(
        label=f"CalculiX, ties as {constraints}",
        force=run.force[:, 0],
        iterations=int(run.iterations.sum()),
        seconds=run.seconds,
        memory=run.memory_growth / 1e6,
        notes=tuple(run.warnings),
    )


def _table(problem: Problem, knit: Knit, pulls: list[Pull], threads: int) -> str:
    scene, settings = problem.scene, problem.settings
    cost = pd.DataFrame(
        {
            "force [N]": [pull.force[-1] for pull in pulls],
            "difference": [pull.force[-1] / pulls[-1].force[-1] - 1 for pull in pulls],
            "iterations": [pull.iterations for pull in pulls],
            "time [s]": [round(pull.seconds, 1) for pull in pulls],
            "memory growth [MB]": [round(pull.memory) if pull.memory > 0 else "" for pull in pulls],
        },
        index=[pull.label for pull in pulls],
    )
    forces = pd.DataFrame(
        {pull.label: pull.force for pull in pulls}, index=1 + np.arange(len(pulls[0].force))
    )
    return "\n".join(
        [
            f"{scene.name}, {knit.loops} x {knit.rows}, strain {scene.load.strain:g}, {settings.increments} increments",
            f"{problem.attributes['dof']} degrees of freedom, h = {1e3 * scene.mesh.size:g} mm",
            f"{threads} threads in CalculiX; differences from the last row",
            "",
            cost.to_string(float_format="{:.7g}".format),
            "",
            "Force [N] of every increment",
            forces.T.to_string(float_format="{:.7g}".format),
            *(f"{pull.label}: {note}" for pull in pulls for note in pull.notes),
            "",
        ]
    )


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
