"""``knitstudy run``: simulate a scene."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knitstudy.cli.options import changed_scene, config_option, output_option, set_option
from knitstudy.cli.output import print_table
from knitstudy.loading.restart import Progress
from knitstudy.study.configuration import asks, load_scenes, plan_of
from knitstudy.study.planning import Planned, compared

if TYPE_CHECKING:
    from knitstudy.stages.simulate import Results

STAGES = ("knitstudy.stages.simulate", "knitstudy.loading.solve.resumed")
"""Loggers that say which stages ran, and whether a run goes on where another one ended."""


@click.command(short_help="Simulate a scene, and whatever it needs.")
@click.argument("scene")
@set_option
@output_option
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads of a direct simulation; all cores by default."
)
@click.option("--anew", is_flag=True, help="Simulate the scene even if its result is there.")
@click.option(
    "--compare/--no-compare",
    default=True,
    help="Run a scene that asks by a second model too, and say how far off it is.",
)
@click.option("-v", "--verbose", is_flag=True, help="Also print what the solver says.")
@config_option
def run(
    scene: str,
    changes: tuple,
    output: Path,
    threads: int | None,
    anew: bool,
    compare: bool,
    verbose: bool,
    config: Path,
) -> None:
    """Simulate a scene: solid yarns (geometry, mesh, dns, contacts), beams in contact, or a reduced model
    after the direct simulations that its joints and springs come from.

    Each stage is written to a file below the output folder as soon as it is done, and used again when its inputs are
    the same. A run that was ended goes on from its last increment: type the same command again. A scene with changed
    keys gets a name of its own, so that it never takes the place of the one that it was made from. Changed keys of the
    geometry reach the simulations that a reduced model needs, others do not.

    \b
    knitstudy run dns-tie-course-coarse
    knitstudy run rom3d-tie-course --set mesh.beam_size=0.25e-3
    knitstudy run dns-tie-course --set pattern.loops=2 --set pattern.rows=2 --output small
    knitstudy run pair-slid-90 --set name=pair-smooth --set contact.friction=0.1

    A scene that leaves its model open (`fidelity: auto`) says what is taken and at what price before it runs.
    Afterwards another model of at most twice the price says how far off the result is; --no-compare leaves that out.

    Times and forces are printed in SI units; `knitstudy show` tells more about a file.
    """
    if threads is not None:
        os.environ["OMP_NUM_THREADS"] = str(threads)
    # Imported here: it takes seconds, which the other commands and --help need not wait for.
    from knitstudy.measures.summary import summarise
    from knitstudy.stages.simulate import simulate

    chosen = changed_scene(scene, changes, config)
    planned = _planned(scene, dict(changes), config)
    try:
        with _log_on_console(verbose):
            results = simulate(chosen, output, config=config, progress=Progress, anew=anew)
            said = _compared(planned, results, output, config) if compare and planned is not None else ""
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"stopped; stages that were done and the last converged increment are kept in {output}: the same command "
            "goes on from there"
        ) from None
    click.echo(f"{results.path}:", err=True)
    print_table(("quantity", "value", "unit"), summarise(results.history))
    if said:
        click.echo(said, err=True)


def _planned(scene: str, changes: dict[str, Any], config: Path) -> Planned | None:
    """Return what was chosen for a scene that leaves its model open, and print it."""
    if not asks(scene, changes, config):
        return None
    found = plan_of(scene, changes, config)
    click.echo(
        f"{found.choice.ask.question} within {found.choice.ask.accuracy:.2g}: take {found.choice}", err=True
    )
    return found


def _compared(planned: Planned, results: Results, output: Path, config: Path) -> str:
    """Return how far off a result is, by a second model of the same scene."""
    from knitstudy.measures.promises import compare
    from knitstudy.stages.simulate import simulate

    ask, other = planned.choice.ask, compared(planned, load_scenes(config))
    if other is None:
        return "how far off that is was not tried: no other model is about as sure and costs at most twice as much"
    click.echo(f"compared with {other.choice}", err=True)
    there = simulate(other.scene, output, config=config, progress=Progress)
    sides = ((each.scene, each.history, each.contacts) for each in (results, there))
    found = compare(ask.question, *sides, other.choice.rung.error)
    if found is None:
        return f"how far off that is cannot be told by {other.choice.rung}, which answers it otherwise"
    return found.judged(ask.accuracy, str(other.choice.rung))


@contextmanager
def _log_on_console(verbose: bool) -> Iterator[None]:
    """Print what the stages say on standard error, beside their progress."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger = logging.getLogger("knitstudy")
    logger.setLevel(logging.INFO if verbose else logging.WARNING)
    for name in STAGES:
        logging.getLogger(name).setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
