"""``knitstudy loop`` and ``stitches``: a loop from spacings and yarn, stitches from a machine file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.alternatives import KNITOUT_PART
from knitstudy.knit.scene.knitout import read_repeat
from knitstudy.knit.scene.scene import unit_warnings
from knitstudy.knit.scene.specimens import Looped
from knitstudy.run.commands import console
from knitstudy.run.configuration import lazy_scenes

KEYS = {
    "course": ("pattern.course_spacing", "Course spacing [m]."),
    "wale": ("pattern.wale_spacing", "Wale spacing [m]."),
    "courses": ("pattern.courses_per_metre", "Courses per metre, instead of the course spacing."),
    "wales": ("pattern.wales_per_metre", "Wales (stitches) per metre, instead of the wale spacing."),
    "diameter": ("yarn.diameter", "Diameter of the yarn [m]."),
    "tex": ("yarn.tex", "Linear density of the yarn [g/km], with --density instead of the diameter."),
    "density": ("yarn.density", "Density of the yarn with the air in it [kg/m3]; cotton 909."),
    "length": ("pattern.loop_length", "Length of yarn in a loop [m]; about 2 c + w + 5.94 d if left out."),
    "clearance": ("pattern.clearance", "Gap between yarns at crossings [yarn radii]."),
}
"""Options that stand for a key of a scene."""


def _key_options(command: Callable[..., None]) -> Callable[..., None]:
    for name, (_, meaning) in reversed(KEYS.items()):
        command = click.option(f"--{name}", type=float, help=meaning)(command)
    return command


@click.command()
@console.scene_argument(required=False)
@_key_options
@click.option("--points", type=console.FILE, help="CSV file of control points.")
@click.option(
    "-o", "--output", type=console.FILE, default="loop.png", show_default=True, help="Picture of the loop."
)
@console.set_option
@console.config_option
def loop(
    scene: str | None,
    points: Path | None,
    output: Path,
    changes: console.Changes,
    config: Path,
    **known: float | None,
) -> None:
    """Draw a loop, optimise it, and print its gaps, curvature, length and angles. Nothing is simulated.

    The loop is that of a scene, by default the first one of a knit, with the keys that the options set. Where
    no loop fits, one message names the limit that it violates, and spacings or a length that fit. Units are
    SI. Loops fit from wale spacings of about four diameters and course spacings of two on (resources/loops.csv).

    \b
    knitstudy loop --course 0.9e-3 --wale 1.1e-3 --diameter 0.25e-3
    knitstudy loop --courses 1100 --wales 900 --tex 30 --density 909
    knitstudy loop --points my-loop.csv --course 13e-3 --diameter 1.8e-3
    knitstudy loop yarns-tie-course              the loop of a scene

    A file of points has x, y, z of one loop from a sinker's centre to the next one's, its last row: in m, or in mm with
    the columns "x (mm), y (mm), z (mm)". Its position and the side from which it is seen do not matter. It is made
    symmetric, and the largest distance that a point moves is printed.

    The last line printed has the options for `knitstudy run` and `knitstudy check`; families of scenes
    may have these keys too.
    """
    # The geometry is imported here: the other commands and --help do not need it.
    from knitstudy.knit.geometry.lay_out import lay_out
    from knitstudy.measures.construction import drawn, of_yarn
    from knitstudy.measures.summary import summarise
    from knitstudy.use.plot import draw_loop
    from knitstudy.use.style import save

    keys: dict[str, Any] = {KEYS[name][0]: value for name, value in known.items() if value is not None}
    if points is not None:
        keys["pattern.points_file"] = str(points)
    if scene is None:  # the first one with loops
        scenes, _ = lazy_scenes(config)
        scene = next(name for name, candidate in scenes.items() if isinstance(candidate, Looped))
    chosen = console.changed_scene(scene, (*keys.items(), *changes), config)
    if not isinstance(chosen, Looped):
        raise ConfigurationError(
            f"scene {chosen.name!r}: specimen is {chosen.specimen} but must be made of loops"
        )
    for warning in unit_warnings(chosen):
        console.say(warning, err=True)
    geometry = lay_out(chosen)
    if "state" not in geometry.dims:
        raise ConfigurationError(
            f"scene {chosen.name!r}: pattern.stitches is {list(chosen.pattern.stitches)}: tucks, floats, moved "
            "loops and rows with an inlay are not optimised; `knitstudy run` finds their shape at rest"
        )
    hidden = ("kind", "loops", "rows", "crossings")
    quantities = [row for row in summarise(geometry) if row.name not in hidden]
    console.print_table(
        ("quantity", "value", "unit"), of_yarn(quantities + drawn(geometry, chosen.tex), chosen)
    )
    save(draw_loop(geometry), [output], {}, f"Loop of {chosen.name}")
    console.say(f"{output}: the loop from the front and from the side")
    if keys:
        console.say(" ".join(f"--set {key}={console.plain(value)}" for key, value in keys.items()))


def _ends(context: click.Context, option: click.Parameter, text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    if not (found := re.fullmatch(r"(-?\d+)[:,](-?\d+)", text)):
        raise click.BadParameter("is the first and the last one, such as 3:14")
    return int(found[1]), int(found[2])


@click.command()
@click.argument("file", type=console.THERE)
@click.option("--rows", callback=_ends, help="First and last pass of the carriage, such as 3:14.")
@click.option("--needles", callback=_ends, help="First and last position of the needles, such as 5:64.")
def stitches(file: Path, rows: tuple[int, int] | None, needles: tuple[int, int] | None) -> None:
    """Read the repeat of a file for a knitting machine (knitout), and print its keys for a scene.

    The largest part of the file that repeats itself is read. The output says which rows and needles these
    are, and what is left out. If a loop is not drawn through the loops that the letters require, an error
    names the line.

    \b
    knitstudy stitches my-knit.k
    knitstudy stitches my-knit.k --rows 15:74 --needles 13:72
    """
    repeat = read_repeat(file, rows, needles)
    table: list[tuple[str, str | float, str]] = [
        ("rows of letters, the bottom row first", " ".join(repeat.stitches), "")
    ]
    table.append(("passes of the carriage", "{} to {}".format(*repeat.rows), ""))
    table.append(("needles", "{} to {}".format(*repeat.needles), ""))
    if repeat.wale_spacing:
        table.append(("spacing of the needles in use", repeat.wale_spacing, "m"))
    console.print_table(("quantity", "value", "unit"), table)
    console.say("")
    console.say(f"pattern.knitout: {file}")
    for key, part in zip(KNITOUT_PART, (rows, needles), strict=True):
        if part:
            console.say(f"{key}: {list(part)}")
