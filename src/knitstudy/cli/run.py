"""``knitstudy run``: simulate a scene."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from knitstudy.cli.options import changed_scene, config_option, output_option, set_option
from knitstudy.cli.output import print_table
from knitstudy.loading.progress import Progress

STAGES = ("knitstudy.stages.simulate", "knitstudy.loading.follow.resumed")
"""Loggers that say which stages ran, and whether a run goes on where another one ended."""


@click.command(short_help="Simulate a scene, and whatever it needs.")
@click.argument("scene")
@set_option
@output_option
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads of a direct simulation; all cores by default."
)
@click.option("--anew", is_flag=True, help="Simulate the scene even if its result is there.")
@click.option("-v", "--verbose", is_flag=True, help="Also print what the solver says.")
@config_option
def run(
    scene: str,
    changes: tuple,
    output: Path,
    threads: int | None,
    anew: bool,
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

    Times and forces are printed in SI units; `knitstudy show` tells more about a file.
    """
    if threads is not None:
        os.environ["OMP_NUM_THREADS"] = str(threads)
    # Imported here: it takes seconds, which the other commands and --help need not wait for.
    from knitstudy.measures.summary import summarise
    from knitstudy.stages.simulate import simulate

    chosen = changed_scene(scene, changes, config)
    try:
        with _log_on_console(verbose):
            results = simulate(chosen, output, config=config, progress=Progress, anew=anew)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"stopped; stages that were done and the last converged increment are kept in {output}: the same command "
            "goes on from there"
        ) from None
    click.echo(f"{results.path}:", err=True)
    print_table(("quantity", "value", "unit"), summarise(results.history))


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
