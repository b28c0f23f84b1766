"""``knitstudy show`` and ``export``: look at a result, hand a scene on to another program."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knitstudy.datasets import STRAINS, read_dataset, read_table, write_table
from knitstudy.errors import ConfigurationError, DataFileError, KnitstudyError
from knitstudy.knit.scene.kinds import unit_of, word_of
from knitstudy.knit.scene.scene import flat
from knitstudy.registry import listed
from knitstudy.run.commands import console
from knitstudy.run.configuration import default_keys

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from knitstudy.measures.summary import Quantity

# Stages that write files for other programs, by what `--dialect` calls them
DIALECTS = {
    "abaqus": "deck_abaqus",
    "calculix": "deck_calculix",
    "paraview": "series",
    "shell": "shell_section",
}


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
@click.option(
    "--curve",
    type=console.CSV,
    help="Write strains, forces per width and energy of a history as well (.csv); of two, with their names.",
)
@console.decimal_option
@click.option(
    "--picture",
    "pictures",
    type=console.FILE,
    multiple=True,
    help="Draw the deformed knit: at full load (.png, .pdf, surfaces in mm for CAD: .stl), moving through all "
    "increments (.webp), or as a page that turns it in a browser (.html); may be repeated.",
)
@click.option(
    "--colour",
    default="u_z",
    show_default=True,
    help="Colour of the picture: u_z, slip or force; of solids with outputs [fields] stress or pressure.",
)
@console.config_option
def show(
    file: Path,
    other: Path | None,
    keys: bool,
    plot: Path | None,
    curve: Path | None,
    decimal: str,
    pictures: tuple[Path, ...],
    colour: str,
    config: Path,
) -> None:
    """Show a result: its kind, its scene, the code that made it, and its main quantities with units.

    FILE is a netCDF file of any stage (geometry, mesh, rest, history, contacts), or a table (.csv). With the name of
    another file, print what differs: keys of the two scenes, then numbers side by side with their ratio.

    \b
    knitstudy show runs/simulation/yarns-tie-course.nc
    knitstudy show runs/simulation/yarns-tie-course.nc --keys
    knitstudy show runs/simulation/yarns-tie-course.nc runs/simulation/yarns-tie-course-p3.nc
    knitstudy show runs/simulation/yarns-tie-course.nc --plot force.png
    knitstudy show runs/simulation/cell-course.nc --curve curve.csv
    knitstudy show runs/simulation/cell-course.nc --curve curve.csv --decimal ,
    knitstudy show runs/simulation/yarns-tie-course.nc runs/simulation/yarns-tie-course-p3.nc --plot both.png
    knitstudy show runs/simulation/cell-course.nc --picture knit.webp --picture knit.html
    knitstudy show results/tables/simulation_tie.csv
    """
    if file.suffix == ".csv":
        if any((plot, keys, other, curve, pictures)):
            raise click.UsageError(
                "--plot draws netCDF files; a table (.csv) is printed, without other options"
            )
        table = read_table(file)
        console.print_table([str(column) for column in table.columns], table.astype(object).values.tolist())
        return
    for path in filter(None, (file, other)):
        if path.suffix != ".nc":
            raise DataFileError(f"{path}: results are .nc and .csv files")
    if other is not None:
        _refuse_for_two({"--keys": keys, "--picture": pictures}, other)
    results = {path: read_dataset(path) for path in filter(None, (file, other))}
    dataset = results[file]
    if other is not None:
        _print_differences(dataset, results[other], file, other)
    elif keys:
        _print_keys(dataset, file, config)
    else:
        console.print_table(("quantity", "value", "unit"), _quantities(dataset, file))
    if plot is not None:
        from knitstudy.measures.summary import kind_of
        from knitstudy.use.plot import draw
        from knitstudy.use.style import save

        console.say(f"drawing {plot} ...", err=True)
        with console.naming(file):
            kind = kind_of(dataset)
            drawing = draw(*results.values())
        save(drawing, [plot], {kind: dataset}, f"{kind} of {dataset.attrs.get('scene', file.stem)}")
        console.say(f"drawn: {plot}", err=True)
    if curve is not None:
        write_table(_curves(results), curve, decimal)
        console.say(f"written: {curve}", err=True)
    if pictures:
        _write_pictures(file, dataset, colour, pictures)


def _refuse_for_two(options: Mapping[str, Any], other: Path) -> None:
    """Refuse an option that takes one result, where another one is given."""
    for option, given in options.items():
        if given:
            raise click.UsageError(f"{option} takes one result; leave out {other}, or name it alone")


def _curves(results: Mapping[Path, xr.Dataset]) -> pd.DataFrame:
    """Return the curves of histories by their files, one below the other; of several, a column has their names."""
    import pandas as pd

    from knitstudy.use.measured_curve import curve_table

    stems = {path.stem for path in results}
    tables = {}
    for path, history in results.items():
        cell = "force_per_width" in history
        geometry = None if cell else console.undeformed(path, history, solids=False)[1]
        with console.naming(path):
            tables[path.stem if len(stems) == len(results) else str(path)] = curve_table(history, geometry)
    if len(tables) == 1:
        return next(iter(tables.values()))
    return pd.concat(tables, names=["result"]).reset_index(level="result").reset_index(drop=True)


def _quantities(dataset: xr.Dataset, file: Path) -> list[Quantity]:
    """Return the summary of a result with the construction that is known of it."""
    from knitstudy.measures.summary import summarise

    with console.naming(file):
        return _with_construction(summarise(dataset), dataset, file)


def _with_construction(known: list[Quantity], dataset: xr.Dataset, file: Path) -> list[Quantity]:
    """Return what is known with the construction of a geometry as drawn, or of a cell where its load begins."""
    from knitstudy.measures.construction import at_rest, drawn, of_yarn
    from knitstudy.measures.summary import Quantity
    from knitstudy.use.measured_curve import curve_table, force_over_strain, loss_of_cycle

    if "cell_width" not in dataset.attrs or "force" not in dataset:
        known = known + drawn(dataset)
        try:
            return of_yarn(known, console.recorded(str(file), {})[0])
        except KnitstudyError:  # an old file has no keys, or other ones
            return known
    scene = console.recorded(str(file), {})[0]
    pattern = scene.value("pattern")
    numbers = at_rest(dataset, pattern.loops, pattern.rows, scene.radius)
    if scene.value("load.start") != "drawn":
        numbers.append(Quantity("band of the shape at rest", f"not known: knitstudy sheet {file}"))
    way = scene.value("load.deformation")
    if way in STRAINS and (loss := loss_of_cycle(force_over_strain(curve_table(dataset), way))):
        numbers.append(Quantity(f"{way} loss of the first cycle", 100 * loss.share, "%"))
        numbers.append(Quantity(f"{way} work of its loading", loss.work, "J/m2"))
    return known + numbers


def _write_pictures(file: Path, history: xr.Dataset, colour: str, pictures: tuple[Path, ...]) -> None:
    """Write the pictures that are asked for of the deformed knit in a result file.

    Raises DataFileError when a name has another ending than the format of a picture, or the file holds no history;
    ConfigurationError when the history does not hold the values of the colour.
    """
    from knitstudy.knit.loading.run import Progress
    from knitstudy.use import deformed
    from knitstudy.use.vtu import solids

    for path in pictures:
        if path.suffix not in deformed.WRITERS:
            raise DataFileError(f"{path}: must end with {listed([*deformed.WRITERS])}")
    console.say("laying out the undeformed knit ...", err=True)
    scene, geometry, mesh = console.undeformed(file, history, solids=colour in deformed.FIELDS)
    at_full_load = partial(solids, scene, geometry, mesh, history)
    knit = deformed.deformed(geometry, history, scene.radius, colour, at_full_load)
    for path in pictures:
        console.say(f"drawing {path} ...", err=True)
        if path.suffix == ".webp":
            deformed.animate(knit, path, "", Progress(f"drawing {path}"))
        else:
            deformed.WRITERS[path.suffix](knit, path, f"{scene.name}, {scene.kind.fidelity.meaning}")
        console.say(f"drawn: {path}", err=True)


def _keys(dataset: xr.Dataset, file: Path) -> dict[str, Any]:
    """Return the keys of a result's scene by dotted name; keys of scenes that it names as ``SCENE: key``."""
    from knitstudy.run.store import keys_of

    keys, sources = keys_of(dataset, file)
    own = {f"{name}: {key}": value for name, part in sources.items() for key, value in flat(part).items()}
    return {key: word_of(value) for key, value in (flat(keys) | own).items()}


def _print_keys(dataset: xr.Dataset, file: Path, config: Path) -> None:
    """Print the keys of a result, first the keys that differ from defaults."""
    defaults = default_keys(config)
    rows = []
    for key, value in _keys(dataset, file).items():
        bare = key.rpartition(": ")[2]
        default = defaults.get(bare, "-")
        rows.append((key, value, "" if value == default else default, unit_of(bare)))
    console.print_table(("key", "value", "default", "unit"), sorted(rows, key=lambda row: row[2] == ""))


def _print_differences(first: xr.Dataset, second: xr.Dataset, file: Path, other: Path) -> None:
    """Print the keys that differ between two results, then their numbers."""
    from knitstudy.measures.summary import pairs, side_by_side

    try:
        keys = _keys(first, file), _keys(second, other)
        shared = [row for row in pairs(*keys) if ": " not in row[0] or all(row[0] in key for key in keys)]
        console.print_table(("key", str(file), str(other)), [row for row in shared if row[1] != row[2]])
        console.say()
    except DataFileError as error:  # the numbers of an old file can be compared all the same
        console.say(str(error), err=True)
    quantities = _quantities(first, file), _quantities(second, other)
    with console.naming(other):
        rows = list(side_by_side(*quantities))
    console.print_table(("quantity", str(file), str(other), "ratio", "unit"), rows)


@click.command()
@console.scene_argument()
@click.option("--dialect", type=click.Choice(DIALECTS), required=True, help="The other program.")
@console.set_option
@click.option(
    "-o",
    "--output",
    type=console.FILE,
    help="By default SCENE.DIALECT.inp; of a history, its name with .pvd.",
)
@console.config_option
def export(scene: str, dialect: str, changes: console.Changes, output: Path | None, config: Path) -> None:
    """Write a scene as an input deck (.inp) in m, N and Pa: hexahedra, or a cell of solid yarns in contact; or the
    history in a result file: of any model for ParaView (.pvd), of a tied cell as a shell for Abaqus (.inp).

    \b
    knitstudy export dns-tie-course --dialect calculix
    knitstudy export pair-slid-90 --dialect abaqus --set mesh.size=0.3 -o pair.inp
    knitstudy export cell-course-isotropic --dialect calculix
    knitstudy export runs/simulation/yarns-tie-course.nc --dialect paraview
    knitstudy export runs/simulation/cell-course.nc --dialect shell
    """
    from knitstudy.run.plan import Plan
    from knitstudy.run.stages import STAGES

    stage = STAGES[DIALECTS[dialect]]
    given = Path(scene)
    if "history" in stage.needs:
        if changes or not console.is_result(scene):
            raise click.UsageError(f"--dialect {dialect} takes the file of a history (.nc), and no --set")
        history = read_dataset(given)
        path = output or given.with_suffix(Path(stage.path_pattern).suffix)
        chosen, geometry, mesh = console.undeformed(given, history, solids="node_displacement" in history)
        if not stage.of(chosen):
            raise ConfigurationError(f"{scene}: must be of a tied cell for --dialect {dialect}")
        known = {"geometry": geometry, "history": history, "mesh": mesh}
        stage.function(chosen, path, **{name: known[name] for name in stage.needs})
        console.say(f"{path}: written from {scene}; m, N, Pa")
        return
    chosen = console.changed_scene(scene, changes, config)
    if not stage.of(chosen):
        raise ConfigurationError(
            f"scene {chosen.name!r}: a deck is of hexahedra (specimens knit, cut_knit and pair), or of a cell with "
            f"fidelity spline_yarns and interaction friction or rough, but this is a {chosen.specimen} with "
            f"{chosen.fidelity} and {word_of(chosen.interaction)}; a tied cell's result (.nc) has --dialect shell"
        )
    chosen, path = Plan.of(config).labelled(chosen), output or Path(f"{chosen.name}.{dialect}.inp")
    geometry = STAGES["geometry"].function(chosen)
    meshed = STAGES["mesh"].of(chosen)
    inputs = {"mesh": STAGES["mesh"].function(chosen, geometry=geometry)} if meshed else {}
    count = stage.function(chosen, path, geometry=geometry, **inputs)
    console.say(f"{path}: {count} hexahedra; m, N, Pa")
