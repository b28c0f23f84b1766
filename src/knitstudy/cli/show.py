"""``knitstudy show``: what a result file holds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from knitstudy.cli.output import print_table
from knitstudy.errors import DataFileError
from knitstudy.files import read_dataset, read_table


@contextmanager
def _naming(file: Path) -> Iterator[None]:
    """Name the file in whatever is wrong with its content."""
    try:
        yield
    except DataFileError as error:
        raise DataFileError(f"{file}: {error}") from error
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise DataFileError(
            f"{file}: its variables or attributes are not those of a result of this study "
            f"({type(error).__name__}: {error}); make it again"
        ) from error


@click.command(short_help="What a result file holds.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw it too, as .png or .pdf: force over strain, forces at the crossings, or centrelines.",
)
def show(file: Path, plot: Path | None) -> None:
    """Show a result: what it is, which scene and which code it comes from, and its main quantities with units.

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
    # Imported here: --help need not wait for it.
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
