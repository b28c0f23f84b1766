"""``knitstudy run``, ``measure``, ``show`` and ``export``: simulate a scene, look at a result, hand a scene on."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knitstudy.cli import console
from knitstudy.cli.console import changed_scene, config_option, plain, print_table, scene_argument, set_option
from knitstudy.errors import DataFileError
from knitstudy.files import read_dataset, read_table
from knitstudy.study.choice import ERROR, MEMORY, OWN, SECONDS
from knitstudy.study.configuration import asks, default_keys, plan_of, problem_of
from knitstudy.study.scene import flat, questions
from knitstudy.study.scene_type import unit_of

if TYPE_CHECKING:
    import xarray as xr

DIALECTS = ("abaqus", "calculix", "paraview")  # Programs that files are written for

STAGES = ("knitstudy.stages.simulate", "knitstudy.loading.solve.resumed")
"""Loggers whose messages a user sees: which stages ran, and from which increment a run goes on."""


@click.command()
@scene_argument()
@set_option
@console.output_option
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads of a direct simulation; default: all cores."
)
@click.option("--anew", is_flag=True, help="Simulate the scene even if its result is there.")
@click.option("-v", "--verbose", is_flag=True, help="Also print what the solver says.")
@config_option
def run(
    scene: str, changes: tuple, output: Path, threads: int | None, anew: bool, verbose: bool, config: Path
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
    knitstudy run my.yaml                        the scene of a file
    knitstudy run RESULT.nc --anew               what a result file holds, again, from that file alone

    A scene that leaves its model open (`fidelity: auto`) prints the chosen model and its price before it runs.

    A load path that ends early leaves its curve in SCENE.incomplete.nc beside the histories, and ends with status 3.

    Units are SI; sizes of elements are in yarn radii. `knitstudy show` tells more about a file.
    """
    if threads is not None:
        os.environ["OMP_NUM_THREADS"] = str(threads)
    # Models are imported here: the other commands and --help do not need them.
    from knitstudy.loading.run import Progress
    from knitstudy.measures.differences import differing_variables
    from knitstudy.measures.summary import summarise
    from knitstudy.stages.simulate import simulate, write_outputs

    before = read_dataset(scene) if console.is_result(scene) else None
    chosen = changed_scene(scene, changes, config)
    if before is None:
        _print_choice(scene, dict(changes), config)
    plan = console.plan_with(scene, config)
    try:
        with log_on_console(verbose):
            results = simulate(chosen, output, config=config, progress=Progress, anew=anew, plan=plan)
            write_outputs(results, output)
    except KeyboardInterrupt:
        kept = f"stages that were done and the last converged increment are kept in {output}"
        raise KeyboardInterrupt(f"stopped; {kept}: the same command goes on from there") from None
    click.echo(f"{results.path}:", err=True)
    print_table(("quantity", "value", "unit"), summarise(results.history))
    for question in questions(chosen):  # again: the first time was before all other messages
        click.echo(question, err=True)
    if before is not None and "load" in before and anew and not changes:
        others = ", ".join(differing_variables(before, results.history))
        made = plain(str(before.attrs.get("source", "")))
        same = f"the same as in {scene}, to the last bit, but for times"
        click.echo(f"not the same as in {scene}, made by {made}: {others}" if others else same, err=True)


def _print_choice(scene: str, changes: dict[str, Any], config: Path) -> None:
    """Print the chosen model of a scene that leaves its model open."""
    if asks(scene, changes, config):
        choice = plan_of(scene, changes, config)
        asked = f"{choice.ask.question} within {choice.ask.accuracy:.2g}"
        click.echo(f"{asked}: take {choice.setting}, {choice.basis}", err=True)


@click.command()
@click.argument("scene")
@set_option
@console.output_option
@config_option
def measure(scene: str, changes: tuple, output: Path, config: Path) -> None:
    """Run all model settings of config/trade.yaml on the knit of a scene, whatever model the scene names.

    Errors and prices go to measured.csv in the working folder; `plan` and `fidelity: auto` use them for this knit.
    The reference value is the limit of solid yarns of degrees 2, 3 and 4. A stopped command goes on where it was.

    \b
    knitstudy measure rom3d-tie-course
    knitstudy measure yarns-isotropic-course --set yarn.poisson_ratio=0.49
    """
    from knitstudy.stages.trade import measure as measured

    problem, _, _ = problem_of(scene, dict(changes), config)
    with log_on_console(verbose=False):
        table = measured(problem, output)
    columns = ["model setting", "question", ERROR, SECONDS, MEMORY, "reason"]
    print_table(columns, table[columns].fillna("").itertuples(index=False))
    click.echo(f"kept in {OWN}", err=True)


@contextmanager
def log_on_console(verbose: bool) -> Iterator[None]:
    """Print messages of the stages on standard error, between the lines of progress."""
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
        what = f"its variables or attributes do not fit a result ({type(error).__name__}: {error})"
        raise DataFileError(f"{file}: {what}; make it again") from error


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("other", type=click.Path(path_type=Path), required=False)
@click.option(
    "--keys", is_flag=True, help="Print all keys of its scene, first the keys that differ from defaults."
)
@click.option(
    "--plot",
    type=console.FILE,
    help="Draw as well (.png, .pdf): forces over strain, of both files, or centrelines.",
)
@click.option("--picture", type=console.FILE, help="Draw the deformed knit at full load (.png, .pdf).")
@click.option("--animation", type=console.FILE, help="Draw the deformed knit at all increments (.webp).")
@click.option(
    "--interactive", type=console.FILE, help="Write a page that turns the knit in a browser (.html)."
)
@click.option(
    "--colour",
    default="u_z",
    show_default=True,
    help="Colour of these: u_z, slip or force; of solids with outputs [fields] stress or pressure.",
)
@config_option
def show(
    file: Path,
    other: Path | None,
    keys: bool,
    plot: Path | None,
    picture: Path | None,
    animation: Path | None,
    interactive: Path | None,
    colour: str,
    config: Path,
) -> None:
    """Show a result: its kind, its scene, the code that made it, and its main quantities with units.

    FILE is a netCDF file of any stage (geometry, mesh, rest, history, contacts), or a table (.csv). With the name of
    another file, print what differs: keys of the two scenes, then numbers side by side with their ratio.

    \b
    knitstudy show runs/simulation/dns-tie-course.nc
    knitstudy show runs/simulation/dns-tie-course.nc --keys
    knitstudy show runs/simulation/dns-tie-course.nc runs/simulation/rom3d-tie-course.nc
    knitstudy show runs/simulation/dns-tie-course.nc --plot force.png
    knitstudy show runs/simulation/dns-tie-course.nc runs/simulation/rom3d-tie-course.nc --plot both.png
    knitstudy show runs/simulation/cell-course.nc --picture knit.png --animation knit.webp --interactive knit.html
    knitstudy show results/tables/simulation_tie.csv
    """
    if file.suffix == ".csv":
        if plot is not None or keys or other is not None:
            raise click.UsageError("--plot draws netCDF files; tables have no keys, and are not compared")
        table = read_table(file)
        print_table([str(column) for column in table.columns], table.astype(object).values.tolist())
        return
    for path in filter(None, (file, other)):
        if path.suffix != ".nc":
            raise DataFileError(f"{path}: results are .nc and .csv files")
    from knitstudy.figures.plot import draw
    from knitstudy.figures.style import save
    from knitstudy.measures.summary import kind_of, summarise

    dataset = read_dataset(file)
    if other is not None:
        _print_differences(dataset, read_dataset(other), file, other)
    elif keys:
        _print_keys(dataset, file, config)
    else:
        with _naming(file):
            quantities = summarise(dataset)
        print_table(("quantity", "value", "unit"), quantities)
    if plot is not None:
        both = [dataset, *([read_dataset(other)] if other is not None else [])]
        with _naming(file):
            kind, drawing = kind_of(dataset), draw(*both)
        save(drawing, [plot], {kind: dataset}, f"{kind} of {dataset.attrs.get('scene', file.stem)}")
        click.echo(f"drawn: {plot}", err=True)
    if picture or animation or interactive:
        from knitstudy.cli.pictures import write_pictures

        write_pictures(file, dataset, colour, picture, animation, interactive)


def _keys(dataset: xr.Dataset, file: Path) -> dict[str, Any]:
    """Return the keys of a result's scene by dotted name; keys of scenes that it names as ``SCENE: key``."""
    from knitstudy.stages.record import keys_of

    keys, sources = keys_of(dataset, file)
    own = {f"{name}: {key}": value for name, part in sources.items() for key, value in flat(part).items()}
    return flat(keys) | own


def _print_keys(dataset: xr.Dataset, file: Path, config: Path) -> None:
    """Print the keys of a result, first the keys that differ from defaults."""
    defaults, rows = default_keys(config), []
    for key, value in _keys(dataset, file).items():
        bare = key.rpartition(": ")[2]
        default = defaults.get(bare, "-")
        rows.append((key, value, "" if value == default else default, unit_of(bare)))
    print_table(("key", "value", "default", "unit"), sorted(rows, key=lambda row: row[2] == ""))


def _print_differences(first: xr.Dataset, second: xr.Dataset, file: Path, other: Path) -> None:
    """Print the keys that differ between two results, then their numbers."""
    from knitstudy.measures.differences import pairs, side_by_side

    try:
        keys = _keys(first, file), _keys(second, other)
        shared = [row for row in pairs(*keys) if ": " not in row[0] or all(row[0] in key for key in keys)]
        print_table(("key", str(file), str(other)), [row for row in shared if row[1] != row[2]])
        click.echo()
    except DataFileError as error:  # the numbers of an old file can be compared all the same
        click.echo(plain(str(error)), err=True)
    with _naming(other):
        rows = list(side_by_side(first, second))
    print_table(("quantity", str(file), str(other), "ratio", "unit"), rows)


@click.command()
@scene_argument()
@click.option("--dialect", type=click.Choice(DIALECTS), required=True, help="The other program.")
@set_option
@click.option(
    "-o",
    "--output",
    type=console.FILE,
    help="By default SCENE.DIALECT.inp; of a history, its name with .pvd.",
)
@config_option
def export(scene: str, dialect: str, changes: tuple, output: Path | None, config: Path) -> None:
    """Write a scene of hexahedra as an input deck (.inp): mesh, ties, contact, grips and load, in m, N and Pa; or the
    history in a result file of any model as a time series for ParaView (.pvd), all increments, in m, N and Pa.

    \b
    knitstudy export dns-tie-course --dialect calculix
    knitstudy export pair-slid-90 --dialect abaqus --set mesh.size=0.3 -o pair.inp
    knitstudy export runs/simulation/rom3d-tie-course.nc --dialect paraview
    """
    if dialect == "paraview":
        if changes or not console.is_result(scene):
            raise click.UsageError("--dialect paraview takes the file of a history (.nc), and no --set")
        click.echo(f"{_write_series(Path(scene), output)}: all increments of {scene}; m, N, Pa")
        return
    from knitstudy.exchange.deck import require_deck, specimen_deck
    from knitstudy.exchange.inp import write_inp
    from knitstudy.geometry.fabric_file import fabric_of
    from knitstudy.mesh.sweep import SweptMesh
    from knitstudy.stages.plan import Plan
    from knitstudy.stages.table import STAGES

    wanted = changed_scene(scene, changes, config)
    require_deck(wanted)
    chosen = Plan.of(config).labelled(wanted)
    geometry = STAGES["geometry"].function(chosen)
    mesh = SweptMesh.from_dataset(STAGES["mesh"].function(chosen, geometry=geometry))
    path = output or Path(f"{chosen.name}.{dialect}.inp")
    deck = specimen_deck(chosen, fabric_of(geometry), mesh)
    write_inp(deck, path, dialect)
    click.echo(f"{path}: {len(deck.nodes)} nodes, {len(mesh.hexahedra)} hexahedra; m, N, Pa")


def _write_series(file: Path, output: Path | None) -> Path:
    """Write the history in a result file as a time series, and return its path."""
    from knitstudy.exchange.series import write_series

    history, path = read_dataset(file), output or file.with_suffix(".pvd")
    scene, geometry, mesh = console.undeformed(file, history, solids="node_displacement" in history)
    write_series(scene, path, geometry, history, mesh)
    return path
