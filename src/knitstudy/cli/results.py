"""``knitstudy run``, ``measure``, ``show`` and ``export``: simulate a scene, look at a result, hand a scene on."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from knitstudy.cli.console import changed_scene, config_option, print_table, set_option
from knitstudy.errors import DataFileError
from knitstudy.files import read_dataset, read_table
from knitstudy.loading.restart import Progress
from knitstudy.study.choice import ERROR, MEMORY, OWN, SECONDS
from knitstudy.study.configuration import asks, plan_of, problem_of

FOLDER = click.Path(path_type=Path, file_okay=False)
FILE = click.Path(path_type=Path, dir_okay=False)

STAGES = ("knitstudy.stages.simulate", "knitstudy.loading.solve.resumed")
"""Loggers whose messages a user sees: which stages ran, and from which increment a run goes on."""


@click.command(short_help="Simulate a scene and all that it needs.")
@click.argument("scene")
@set_option
@click.option("-o", "--output", type=FOLDER, default="results", show_default=True, help="Folder of results.")
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads of a direct simulation; default: all cores."
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
    """Simulate a scene, and before it the direct simulations that its joints and springs come from.

    Each stage (geometry, mesh, simulation, contacts) writes a file below the output folder, and the file is used again
    while its inputs and the code are the same. A run that was ended goes on from its last increment: type the same
    command again. A scene with changed keys gets a name of its own, and never replaces the scene that it was made
    from. Changed keys of the geometry reach the simulations that a reduced model needs; other keys do not.

    \b
    knitstudy run dns-tie-course-coarse
    knitstudy run rom3d-tie-course --set mesh.beam_size=0.25
    knitstudy run dns-tie-course --set pattern.loops=2 --set pattern.rows=2 --output small
    knitstudy run pair-slid-90 --set name=pair-smooth --set contact.friction=0.1

    A scene that leaves its model open (`fidelity: auto`) prints the chosen model and its price before it runs.

    A load path that ends early leaves its curve in SCENE.incomplete.nc beside the histories, and ends with status 3.

    Units are SI; sizes of elements are in yarn radii. `knitstudy show` tells more about a file.
    """
    if threads is not None:
        os.environ["OMP_NUM_THREADS"] = str(threads)
    # Models are imported here: the other commands and --help do not need them.
    from knitstudy.measures.summary import summarise
    from knitstudy.stages.simulate import simulate

    chosen = changed_scene(scene, changes, config)
    _print_choice(scene, dict(changes), config)
    try:
        with _log_on_console(verbose):
            results = simulate(chosen, output, config=config, progress=Progress, anew=anew)
    except KeyboardInterrupt:
        kept = f"stages that were done and the last converged increment are kept in {output}"
        raise KeyboardInterrupt(f"stopped; {kept}: the same command goes on from there") from None
    click.echo(f"{results.path}:", err=True)
    print_table(("quantity", "value", "unit"), summarise(results.history))


def _print_choice(scene: str, changes: dict[str, Any], config: Path) -> None:
    """Print what is chosen for a scene if it leaves its model open."""
    if asks(scene, changes, config):
        choice = plan_of(scene, changes, config)
        asked = f"{choice.ask.question} within {choice.ask.accuracy:.2g}"
        click.echo(f"{asked}: take {choice.rung}, {choice.basis}", err=True)


@click.command(short_help="Measure what all models cost and miss on this knit, or on a sample.")
@click.argument("scene", required=False)
@set_option
@click.option("-o", "--output", type=FOLDER, default="results", show_default=True, help="Folder of results.")
@click.option("--first", type=click.IntRange(min=1), help="Measure so many knits of the sample instead.")
@click.option("--anew", is_flag=True, help="Measure knits of the sample even if their records are there.")
@config_option
def measure(
    scene: str | None, changes: tuple, output: Path, first: int | None, anew: bool, config: Path
) -> None:
    """Run all rungs of config/trade.yaml on the knit of a scene, whatever model it names, and add their errors and
    prices to measured.csv in the working folder, which `plan` and `fidelity: auto` then use for this knit.

    The truth is the limit of solid yarns of degrees 2, 3 and 4. A command that was stopped goes on where it was.

    With --first, knits of the sample are measured one after the other, each whole before the next. Any number of them
    is a sample; records in OUTPUT/trade are used again (`make trade` keeps the table for `plan`).

    \b
    knitstudy measure rom3d-tie-course
    knitstudy measure yarns-isotropic-course --set yarn.poisson_ratio=0.49
    knitstudy measure --first 12
    """
    if (scene is None) == (first is None) or (first and changes):
        raise click.UsageError("name a scene, or say how many knits of the sample: --first 12")
    from knitstudy.stages.trade import bounds, load_trade, measure_sample
    from knitstudy.stages.trade import measure as measured

    if first:
        found = bounds(measure_sample(first, output / "trade", anew, click.echo), load_trade())
        print_table(list(found), found.itertuples(index=False))
        return
    problem, _, _ = problem_of(scene, dict(changes), config)
    with _log_on_console(verbose=False):
        table = measured(problem, output)
    columns = ["rung", "question", ERROR, SECONDS, MEMORY, "reason"]
    print_table(columns, table[columns].fillna("").itertuples(index=False))
    click.echo(f"kept in {OWN}", err=True)


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


@contextmanager
def _naming(file: Path) -> Iterator[None]:
    """Name the file in whatever is wrong with its content."""
    try:
        yield
    except DataFileError as error:
        raise DataFileError(f"{file}: {error}") from error
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        what = f"its variables or attributes are not those of a result ({type(error).__name__}: {error})"
        raise DataFileError(f"{file}: {what}; make it again") from error


@click.command(short_help="Show or draw a result file.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=FILE, help="Draw it too, as .png or .pdf: forces over strain, or centrelines.")
def show(file: Path, plot: Path | None) -> None:
    """Show a result: its kind, its scene, the code that made it, and its main quantities with units.

    FILE is a netCDF file of any stage (geometry, mesh, history, contacts), or a table (.csv).

    \b
    knitstudy show results/simulation/dns-tie-course.nc
    knitstudy show results/simulation/dns-tie-course.nc --plot force.png
    knitstudy show results/tables/simulation_tie.csv
    """
    if file.suffix == ".csv":
        if plot is not None:
            raise click.UsageError("--plot draws netCDF files")
        table = read_table(file)
        print_table([str(column) for column in table.columns], table.astype(object).values.tolist())
        return
    if file.suffix != ".nc":
        raise DataFileError(f"{file}: results are .nc and .csv files")
    from knitstudy.cli.plot import draw
    from knitstudy.figures.style import save
    from knitstudy.measures.summary import kind_of, summarise

    dataset = read_dataset(file)
    with _naming(file):
        quantities = summarise(dataset)
    print_table(("quantity", "value", "unit"), quantities)
    if plot is not None:
        with _naming(file):
            kind, drawing = kind_of(dataset), draw(dataset)
        save(drawing, [plot], {kind: dataset}, f"{kind} of {dataset.attrs.get('scene', file.stem)}")
        click.echo(f"drawn: {plot}", err=True)


@click.command(short_help="Write a scene as an input deck of Abaqus or CalculiX.")
@click.argument("scene")
@click.option(
    "--dialect", type=click.Choice(["abaqus", "calculix"]), required=True, help="The other program."
)
@set_option
@click.option("-o", "--output", type=FILE, help="The deck's file; by default SCENE.DIALECT.inp.")
@config_option
def export(scene: str, dialect: str, changes: tuple, output: Path | None, config: Path) -> None:
    """Write a scene of hexahedra as an input deck (.inp): mesh, ties, contact, grips and load, in m, N and Pa.

    \b
    knitstudy export dns-tie-course --dialect calculix
    knitstudy export pair-slid-90 --dialect abaqus --set mesh.size=0.3 -o pair.inp
    """
    from knitstudy.exchange.deck import require_deck, specimen_deck
    from knitstudy.exchange.inp import write_inp
    from knitstudy.geometry.fabric import Fabric
    from knitstudy.mesh.sweep import SweptMesh
    from knitstudy.stages.plan import Plan
    from knitstudy.stages.table import STAGES

    wanted = changed_scene(scene, changes, config)
    require_deck(wanted)
    chosen = Plan.of(config).labelled(wanted)
    geometry = STAGES["geometry"].function(chosen)
    mesh = SweptMesh.from_dataset(STAGES["mesh"].function(chosen, geometry=geometry))
    path = output or Path(f"{chosen.name}.{dialect}.inp")
    deck = specimen_deck(chosen, Fabric.from_dataset(geometry), mesh)
    write_inp(deck, path, dialect)
    click.echo(f"{path}: {len(deck.nodes)} nodes, {len(mesh.hexahedra)} hexahedra; m, N, Pa")
