"""``knitstudy membrane`` and ``strip``: the law of a fabric from its cells, and a specimen between clamps with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd

from knitstudy.datasets import STRAINS, read_dataset, write_dataset, write_table
from knitstudy.errors import DataFileError, UnwritableError
from knitstudy.files import replacing_together
from knitstudy.run.commands import console
from knitstudy.run.commands.console import CSV, NC, SIZE, THERE

SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)  # of the largest force, at which strains are printed


@click.command()
@click.argument("results", type=THERE, nargs=-1, required=True)
@click.option("-o", "--output", type=NC, default="membrane.nc", show_default=True, help="File of the law.")
@click.option("--error", type=SIZE, default=0.01, show_default=True, help="Target error of the law.")
def membrane(results: tuple[Path, ...], output: Path, error: float) -> None:
    """Fit the energy of a membrane to RESULTS, histories of cells of one fabric (.nc) on several load paths.

    The law is a sum of exponentials of Green's strains, convex by its form; a linear law for Abaqus and
    CalculiX is fitted as well. Paths in course, wale and shear are required, a biaxial one is
    recommended. The command prints the forces of both laws beside those of the cells. If the linear law
    misses a path by more than a factor of 2, a secant takes its place, which holds only at its strains;
    if the secant misses as well, no deck is written.

    \b
    knitstudy run cell-course; knitstudy run cell-wale; knitstudy run cell-biaxial; knitstudy run cell-shear
    knitstudy membrane runs/simulation/cell-{course,wale,biaxial,shear}.nc -o jersey.nc
    knitstudy strip jersey.nc --length 0.0691 --width 0.0666 --strain 0.04

    The command writes the law (.nc), its coefficients with 95 % intervals (.csv) and both decks (.inp).
    """
    from knitstudy.use import fabric_law
    from knitstudy.use.decks.fabric import LAWS, write_membrane

    stems = [path.stem for path in results]
    names = stems if len({*stems}) == len(stems) else map(str, results)
    histories = {name: read_dataset(path) for name, path in zip(names, results, strict=True)}
    _require_one_fabric(results)
    fitted = fabric_law.membrane(histories, error=error)
    table = fitted["value"].to_dataframe().reset_index()
    half = fitted["half_interval"].to_numpy()
    table = table.assign(**{"95 % from": table["value"] - half, "to": table["value"] + half})
    console.print_table(list(table.columns), table.to_numpy())
    rows = [(path, *row) for path, row in zip(histories, fitted["path_error"].to_numpy(), strict=True)]
    rows += [("all", fitted.attrs["error"], "")]
    console.print_table(("error of the law over the force of the path", "root mean square", "largest"), rows)
    for name in ("law", "deck"):
        rows = [
            (f"{path}, {direction}", *(f"{value:.4g}" for value in values))
            for path, direction, *values in fabric_law.forces_beside(fitted, name)
        ]
        console.print_table(("path", "strain", f"{name} (N/m)", "cell (N/m)"), rows)
    decks = {dialect: f"{output.stem}.{dialect}.inp" for dialect in LAWS}
    written = f"{output}, .csv"
    with replacing_together(output.parent, stale=decks.values()) as beside:
        write_dataset(fitted, beside / output.name)
        write_table(table, beside / f"{output.stem}.csv")
        try:
            for dialect, deck in decks.items():
                write_membrane(fitted, beside / deck, dialect, output.stem)
                written += f", .{dialect}.inp"
            if fitted.attrs["secant"]:
                console.say("the decks have a secant: it holds at the strains of its table alone", err=True)
        except UnwritableError:
            raise
        except DataFileError as error:
            console.say(f"no deck is written: {error}", err=True)
    console.say(written, err=True)


def _require_one_fabric(results: tuple[Path, ...]) -> None:
    """Refuse results of scenes that differ in anything but their loads and numerics."""
    known: dict[str, Any] = {}
    for path in results:
        scene = console.recorded(str(path), {})[0]
        keys = {"interaction": scene.interaction} | scene.values_of("physics")
        for key, value in keys.items():
            if not key.startswith("load.") and known.setdefault(key, value) != value:
                of = "in the others: not one fabric"
                raise DataFileError(f"{path}: {key} is {value} but {known[key]} {of}")


@click.command()
@click.argument("law", type=THERE)
@click.option("--length", type=SIZE, required=True, help="Length between the clamps [m].")
@click.option("--width", type=SIZE, required=True, help="Width of the clamped edge at rest [m].")
@click.option("--strain", type=SIZE, required=True, help="Displacement of the clamps over the length.")
@click.option("--direction", type=click.Choice(STRAINS[:2]), default="course", show_default=True)
@click.option("-o", "--output", type=CSV, help="File of the curve (.csv); default: beside the law.")
@console.decimal_option
def strip(
    law: Path,
    length: float,
    width: float,
    strain: float,
    direction: str,
    output: Path | None,
    decimal: str,
) -> None:
    """Pull a strip of a fabric with a LAW (.nc, of `knitstudy membrane`) between clamps that hold its edges.

    For some forces per width the command prints strains between the clamps and strains of the endless fabric, whose
    width is free. It also prints forces of the law and of the cells to which the law was fitted. `knitstudy compare`
    takes the curve (.csv) as a measured one, and draws it.

    \b
    knitstudy strip jersey.nc --length 0.0691 --width 0.0666 --strain 0.5
    knitstudy strip jersey.nc --length 0.0455 --width 0.0959 --strain 0.3 --direction wale
    """
    from knitstudy.use.fabric_law import WRINKLES, forces_beside, law_of, strain_at, stretch_strip
    from knitstudy.use.measured_curve import without_noise

    fitted = read_dataset(law)
    if not {"form", "weight", "slope", "largest_strain", "law_force"} <= set(fitted.variables):
        raise DataFileError(f"{law}: is not a law of a fabric; `knitstudy membrane` makes one")
    axis = STRAINS.index(direction)
    path = output or law.with_name(f"{law.stem}-{direction}.csv")
    pulled, free = (
        stretch_strip(law_of(fitted), length, width, strain, axis, clamped) for clamped in (True, False)
    )
    table = pd.DataFrame({"strain [1]": pulled["strain"], "force per width [N/m]": pulled["force_per_width"]})
    table["width half way over width at rest [1]"] = pulled["waist"].to_numpy()
    table["free across [N/m]"] = free["force_per_width"].to_numpy()
    write_table(without_noise(table), path, decimal)
    forces = np.array(SHARES) * float(min(pull["force_per_width"][-1] for pull in (pulled, free)))
    strains = [strain_at(pull, forces) for pull in (pulled, free)]
    rows = np.column_stack([forces, *strains, 100 * (strains[0] / strains[1] - 1)])
    columns = (
        "force per width (N/m)",
        "strain between clamps",
        "strain free across",
        "clamps change it by (%)",
    )
    console.print_table(columns, [tuple(f"{value:.4g}" for value in row) for row in rows])
    for name, way, reached, force, cell in forces_beside(fitted, "law"):
        error = f"{name}, {way} {100 * reached:.3g} %: law {force:.3g} N/m, cell {cell:.3g} N/m"
        console.say(error, err=True)
    known = float(fitted["largest_strain"][axis])
    if strain > known * (1 + 1e-9):
        console.say(f"the law was fitted up to a strain of {known:.3g}: beyond it is extrapolated", err=True)
    if (share := float(-pulled["least_force"][-1] / pulled["largest_force"][-1])) > WRINKLES:
        remark = f"compressed by {100 * share:.2g} % of the largest force: a fabric wrinkles there"
        console.say(remark, err=True)
    console.say(f"{path}: {law.stem} between clamps, {length:g} x {width:g} m", err=True)
