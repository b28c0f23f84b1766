"""``knitstudy compare`` and ``fit``: a measured and a simulated curve, and the yarn that fits the measured one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import pandas as pd

from knitstudy.datasets import read_dataset, write_table
from knitstudy.errors import ConfigurationError, ConvergenceError, DataFileError
from knitstudy.files import replacing_together, safe_name
from knitstudy.knit.scene.alternatives import OF_BEAMS, SECTIONS
from knitstudy.knit.scene.kinds import unit_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.specimens import Looped
from knitstudy.run.commands import console
from knitstudy.run.commands.console import SIZE, THERE
from knitstudy.run.commands.run import log_on_console

if TYPE_CHECKING:
    from knitstudy.use.curve_fit import Fit, Interval

FRICTION = "contact.friction"
MODULI = ("yarn.youngs_modulus", "yarn.transverse_modulus", "yarn.axial_shear_modulus")
WAY = ("cycle", "branch")
READ_BY = ("strain", "force", "length", "width", "thickness", "zero")  # kept beside the measured file
USUAL = {"table": None, "cycle": 1, "branch": "loading"}  # what else chooses a curve; not in names of files
# With these given, forces are not proportional to the modulus
STIFFNESSES = (
    "rom.stiffness",
    *(f"{yarn}.{name}" for yarn in SECTIONS for name in OF_BEAMS),
    "yarn_b.youngs_modulus",
)


def _curve_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the argument and the options that name a measured curve."""
    pair: Any = {"type": (str, str), "metavar": "COLUMN UNIT"}
    for add in (
        click.option("--length", type=SIZE, help="Length between the clamps [m], of a strain in mm."),
        click.option("--width", type=SIZE, help="Width of the specimen [m], of a force in N."),
        click.option("--thickness", type=SIZE, help="Thickness of the fabric [m], of a stress in MPa."),
        click.option("--cycle", type=click.IntRange(1), default=1, help="Which of several loading cycles."),
        click.option("--branch", type=click.Choice(("loading", "unloading")), default="loading"),
        click.option("--skip-bad", is_flag=True, help="Leave out rows that cannot be read."),
        click.option("--table", type=click.IntRange(1), help="Which of several tables in the file."),
        click.option(
            "--zero",
            type=click.Choice(("first", "file", "toe")),
            help="Where the curve begins: at its first point, at the zero of the file, or behind a toe of slack.",
        ),
        console.decimal_option,
        click.option("--force", **pair, help="Column and unit of the force, such as Load N."),
        click.option("--strain", **pair, help="Column and unit of the strain, such as Elongation %."),
        click.option("--only", multiple=True, metavar="COLUMN=VALUE", help="One curve of several in a file."),
        click.argument("measured", type=THERE),
    ):
        command = add(command)
    return command


def _stiffnesses(scene: Scene) -> list[str]:
    """Return the keys that give stiffnesses of a scene without its modulus."""
    return [key for key in STIFFNESSES if scene.value(key) is not None]


def _pulled(scene: Scene) -> tuple[Looped, str]:
    """Return a scene that can be compared with a measured curve, and its direction."""
    direction = scene.value("load.direction") or scene.value("load.deformation")
    if not isinstance(scene, Looped) or direction not in ("course", "wale") or scene.load.strain < 0:
        wanted = "a knit or a cell that is pulled in course or wale direction"
        raise ConfigurationError(f"scene {scene.name!r}: must be {wanted} to be compared with a curve")
    return scene, direction


def _read(measured: Path, direction: str, named: dict[str, Any]) -> tuple[pd.Series[float], str]:
    """Return the measured curve of a direction, and its name."""
    from knitstudy.use.measured_curve import file_stem, read_curve

    only = _chosen(named["only"])
    how = {name: named[name] for name in (*WAY, "skip_bad", "table")}
    given = {name: named[name] for name in READ_BY if named[name] is not None}
    curve = read_curve(measured, given, only, direction, **how)
    which = only | {name: str(how[name]) for name, usual in USUAL.items() if how[name] != usual}
    choice = ",".join(f"{name}={value}" for name, value in which.items())
    return curve, "-".join(filter(None, (file_stem(measured), choice and safe_name(choice))))


def _chosen(pairs: Iterable[str]) -> dict[str, str]:
    """Return the values by columns of --only."""
    only: dict[str, str] = {}
    for pair in pairs:
        column, equals, value = pair.partition("=")
        if not equals or column in only:
            raise click.UsageError(f"--only {pair}: must be COLUMN=VALUE, once a column")
        only[column] = value
    return only


def _write(stem: Path, table: pd.DataFrame, curves: dict[str, pd.Series], title: str, decimal: str) -> None:
    """Write a table and a picture into one folder."""
    from knitstudy.use.measured_curve import DIGITS
    from knitstudy.use.plot import draw_curves
    from knitstudy.use.style import save

    again = " (in place of earlier ones)" if Path(f"{stem}.csv").exists() else ""
    with replacing_together(stem.parent) as beside:
        write_table(table, beside / f"{stem.name}.csv", decimal, digits=DIGITS)
        save(draw_curves(curves), [beside / f"{stem.name}.png"], {}, title)
    console.say(f"{stem}.csv, .png: {title}{again}", err=True)


def _require_finite(numbers: Iterable[float], where: Path) -> None:
    """Refuse numbers of a comparison that are none."""
    if not np.isfinite([*numbers]).all():
        raise DataFileError(f"{where}: has forces or strains that are too small or too large to be compared")


@click.command()
@click.argument("result", type=THERE)
@_curve_options
def compare(result: Path, measured: Path, **named: Any) -> None:
    """Compare RESULT, the history of a knit or a cell (.nc), with MEASURED, a curve of force over strain (.csv).

    MEASURED has the names of its columns in the first row, and a point of the curve in every other row:

    \b
        strain (%),force_per_width_N_mm
        1.0,0.012
        2.0,0.027

    Columns and units are read from such names. Other names are given once, by options, and stored in
    MEASURED.columns.yaml. Of several curves the command takes the curve of the result's direction; --only chooses among
    others. Of cycles the first loading is compared, of both; --cycle and --branch choose another.

    A curve begins at its first point: a preload, the position of the crosshead there and the offset of a
    load cell are taken off, and a line reports it. A file whose first row comes one step after its own
    zero keeps this zero. A first force of more than a tenth of the others is refused until --zero is
    given. --zero toe takes off a toe of slack.

    \b
    knitstudy compare runs/simulation/jersey.nc lab.csv
    knitstudy compare runs/simulation/jersey.nc lab.csv --only yarn=cotton
    knitstudy compare jersey.nc lab.csv --strain Weg mm --length 0.1 --force Kraft N --width 0.05

    The distance is the root mean square of the difference over that of the measured force. The nearest modulus, where
    forces are proportional to it, is the one with which the distance is least. Points (.csv) and picture (.png) are
    written beside the result.
    """
    from knitstudy.run.stages import STAGES
    from knitstudy.use.measured_curve import SAME, at, simulated_curve, within, without_noise

    history = read_dataset(result)
    scene, direction = _pulled(console.recorded(str(result), {})[0])
    whole, name = _read(measured, direction, named)
    if "axis" not in history.attrs:
        raise DataFileError(f"{result}: is not a history; name a file of runs/simulation")
    way = {name: named[name] for name in WAY}
    with console.naming(result):
        simulated = simulated_curve(history, STAGES["geometry"].function(scene), **way)
    curve = within(whole, simulated)
    reach = f"{100 * simulated.index[-1]:.3g} % strain"
    if curve.empty:
        raise DataFileError(f"{measured}: has no point up to {reach}, where {result} ends: simulate more")
    strains = curve.index.to_numpy(dtype=float)
    forces = at(simulated, strains)
    if not forces.any():
        where = f"{100 * strains[-1]:.3g} % strain, where {measured} ends"
        raise DataFileError(f"{result}: has no force up to {where}: measure more")
    if not curve.any():
        raise DataFileError(f"{measured}: has no force up to {reach}, where {result} ends: simulate more")
    norm = 100 / np.linalg.norm(curve)
    factor = curve @ forces / (forces @ forces)
    points = pd.DataFrame({"strain [1]": strains, "measured [N/m]": curve, "simulated [N/m]": forces})
    rows = [
        ("points compared", len(curve), f"of {len(whole)}"),
        ("largest strain of them", 100 * curve.index[-1], "%"),
        ("force there, measured", curve.iloc[-1], "N/m"),
        ("force there, simulated", forces[-1], "N/m"),
        ("distance", norm * np.linalg.norm(forces - curve), "%"),
    ]
    if not _stiffnesses(scene) and factor > 0:
        distance = norm * np.linalg.norm(factor * forces - curve)
        rows.append(("nearest Young's modulus", factor * scene.yarn.youngs_modulus, "Pa"))
        rows.append(("distance with it", distance, "%"))
    _require_finite((value for _, value, _ in rows), measured)
    console.print_table(("quantity", "value", "unit"), rows)
    if whole.index[-1] > simulated.index[-1] * (1 + SAME):
        more = f"--set load.strain={whole.index[-1]:.3g} simulates all of the measured curve"
        console.say(f"{result} ends at {reach}; {more}", err=True)
    curves = {"measured": whole, str(scene.name): simulated}
    title = f"{scene.name} and {measured.name}"
    stem = result.with_name(f"{result.stem}-{name}")
    _write(stem, without_noise(points), curves, title, named["decimal"])


@click.command()
@console.scene_argument()
@_curve_options
@click.option(
    "--between", type=(SIZE, SIZE), default=(0.05, 1.0), show_default=True, help="Range of the friction."
)
@click.option("--check", type=console.Change(), multiple=True, help="Key of a more accurate model, as --set.")
@console.set_option
@console.output_option
@console.config_option
def fit(
    scene: str,
    measured: Path,
    between: tuple[float, float],
    check: console.Changes,
    changes: console.Changes,
    output: Path,
    config: Path,
    **named: Any,
) -> None:
    """Find the Young's modulus and the friction with which SCENE comes nearest to MEASURED, a curve (.csv).

    Forces are proportional to the modulus; some frictions are simulated, and the best one is searched between them.
    Intervals (95 %) come from the noise. With --check, a more accurate model simulates the best friction and the
    ends of its interval; it corrects all curves, and intervals include the error of the model. Printed lines name
    the properties that the curve does not determine. `knitstudy compare --help` explains the format of files.

    \b
    knitstudy fit jersey.yaml lab.csv
    knitstudy fit jersey.yaml lab.csv --set load.strain=0.1 --between 0.1 0.6
    knitstudy fit jersey.yaml lab.csv --check fidelity=spline_yarns
    knitstudy fit yarns-tie-course lab.csv       tied yarns: the modulus alone, from one simulation

    A scene that leaves its model open (fidelity: auto) takes the cheapest one that is accurate enough. Points are
    used up to the strain that all simulations reach. Table and picture are written to the folder fit of the results;
    the last line printed has the options for `knitstudy run`.
    """
    from knitstudy.knit.loading.run import Progress
    from knitstudy.run.simulations import simulate
    from knitstudy.use import curve_fit
    from knitstudy.use.measured_curve import at, simulated_curve, within

    chosen, direction = _pulled(console.changed_scene(scene, changes, config))
    way = {name: named[name] for name in WAY}
    _require_fittable(chosen, way["branch"])
    both = chosen, _pulled(chosen.vary(dict(check)))[0]  # refused before anything is simulated
    whole, name = _read(measured, direction, named)
    reach = (max((each.load.strain, *(each.value("load.turns") or ()))) for each in both)
    curve = within(whole, *(pd.Series(0.0, [0.0, most]) for most in reach))
    if len(curve) < curve_fit.LEAST:
        raise DataFileError(f"{measured}: {curve_fit.LEAST} points are needed; set a larger load.strain")
    plan = console.plan_with(scene, config)
    slides = chosen.value(FRICTION) is not None

    def simulations(frictions: Iterable[float], more: Mapping[str, Any]) -> dict[float, pd.Series]:
        """Return the curves of all frictions that can be simulated."""
        curves = {}
        for friction in map(float, frictions):
            varied = chosen.vary({FRICTION: friction, **more} if slides else more)
            try:
                results = simulate(varied, output, config=config, progress=Progress, plan=plan)
            except ConvergenceError as error:
                if not slides:
                    raise
                console.say(f"friction {friction:.3g} is left out: {error}", err=True)
                continue
            curves[friction] = simulated_curve(results.history, results.geometry, **way)
        return curves

    def forces(curves: Mapping[float, pd.Series]) -> dict[float, np.ndarray]:
        """Return the forces of curves by friction at the strains of the measured points."""
        return {friction: at(each, curve.index.to_numpy(dtype=float)) for friction, each in curves.items()}

    with log_on_console(verbose=False):
        simulated = simulations(
            np.linspace(min(between), max(between), curve_fit.SIMULATED) if slides else [0.0], {}
        )
        if slides and len(simulated) < 3:
            count = f"{len(simulated)} of {curve_fit.SIMULATED} frictions could be simulated"
            raise ConvergenceError(f"scene {chosen.name!r}: {count}, and 3 are needed; change --between")
        curve = within(curve, *simulated.values())
        console.say(f"{measured}: {len(curve)} of {len(whole)} points, which all simulations reach", err=True)
        more_accurate = (lambda frictions: forces(simulations(frictions, dict(check)))) if check else None
        fitted = curve_fit.fit(curve.to_numpy(), forces(simulated), more_accurate)
    values = _fitted_values(chosen, fitted, slides)
    _require_finite((number for interval in values.values() for number in interval), measured)
    if fitted.factor[0] <= 0:
        raise DataFileError(f"{measured}: no modulus fits: its forces fall where those of the scene rise")
    table = _printed(fitted, values)
    curves = {"measured": whole, "fit": pd.Series(fitted.forces, curve.index)}
    title = f"fit of {chosen.name} to {measured.name}"
    _write(output / "fit" / f"{chosen.name}-{name}", table, curves, title, named["decimal"])
    console.say(" ".join(f"--set {key}={console.plain(value)}" for key, (value, *_) in values.items()))


def _require_fittable(scene: Scene, branch: str) -> None:
    """Refuse a scene whose forces are not proportional to a modulus, or that has no such branch."""
    for key in _stiffnesses(scene):
        why = f"{key} is given in {unit_of(key)}, so that forces are not proportional to the modulus"
        raise ConfigurationError(f"scene {scene.name!r}: {why}; leave it out, or compare results of several")
    if branch == "unloading" and not scene.value("load.turns"):
        raise ConfigurationError(f"scene {scene.name!r}: has no unloading to fit; set load.turns")


def _fitted_values(scene: Scene, fitted: Fit, slides: bool) -> dict[str, Interval]:
    """Return the moduli of a scene times the fitted factor, and the friction of yarns that slide."""
    moduli = {key: value for key in MODULI if (value := scene.value(key)) is not None}
    values: dict[str, Interval] = {
        key: tuple(value * factor for factor in fitted.factor) for key, value in moduli.items()
    }
    return values | {FRICTION: fitted.friction} if slides else values


def _printed(fitted: Fit, values: Mapping[str, Interval]) -> pd.DataFrame:
    """Print a fit that gives keys their values, and return its table."""
    rows: list[tuple[Any, ...]] = [(key, *interval, unit_of(key)) for key, interval in values.items()]
    of = "force" if fitted.proportional else "largest force"
    rows.append((f"deviation that remains, of the {of}", 100 * fitted.noise, "", "", "%"))
    table = pd.DataFrame(rows, columns=["quantity", "value", "95 % from", "to", "unit"])
    console.print_table(list(table.columns), table.to_numpy())
    numbers = list(table.columns[1:4])
    table[numbers] = table[numbers].replace("", nan).astype(float)
    table["note"] = ["; ".join(fitted.remarks()), *[""] * (len(rows) - 1)]
    for line in fitted.remarks():
        console.say(line, err=True)
    return table
