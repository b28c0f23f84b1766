"""``knitstudy check``: is a configuration valid, and what are the keys of a scene."""

from __future__ import annotations

import csv
from pathlib import Path

import click

from knitstudy.cli.options import changed_scene, config_option, set_option
from knitstudy.cli.output import print_table
from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import STUDIES, load_knits, load_scenes, load_study
from knitstudy.study.scene import Scene
from knitstudy.study.variation import flattened


@click.command(short_help="Is a configuration valid; all keys of a scene.")
@click.argument("what", metavar="[FOLDER | SCENE]", required=False)
@set_option
@click.option("--sources", is_flag=True, help="Also print where every key of the scene comes from.")
@config_option
def check(what: str | None, changes: tuple, sources: bool, config: Path) -> None:
    """Check a configuration folder, or print every key of a scene with its unit and its standing.

    What is wrong is said in one message: the file, the scene, the key, its value and what is allowed. The standing of
    a key tells whether the paper states it, or whether it was inferred, calibrated, assumed or chosen here.

    \b
    knitstudy check                              the checkout's configuration
    knitstudy check my-config                    another folder
    knitstudy check dns-tie-course               all keys of a scene
    knitstudy check dns-tie-course --sources     and where they come from
    knitstudy check dns-tie-course --set mesh.size=0.45e-3
    """
    if what is None or Path(what).is_dir():
        if changes or sources:
            raise click.UsageError("--set and --sources are about a scene: name one")
        _check_folder(config if what is None else Path(what))
    else:
        _print_keys(changed_scene(what, changes, config), config, sources)


def _check_folder(folder: Path) -> None:
    scenes, knits = load_scenes(folder), load_knits(folder)
    studies = ", ".join(f"{len(load_study(name, folder))} of study {name}" for name in STUDIES)
    click.echo(f"{folder}: valid; {len(scenes)} scenes ({studies}), {len(knits)} geometries")


def _print_keys(scene: Scene, config: Path, sources: bool) -> None:
    """Print every key with what `inputs.tsv` says of it; labels are no inputs."""
    columns = ("unit", "standing", *(("source",) if sources else ()))
    inputs = _inputs(config / "inputs.tsv")
    rows = [
        (key, value, *(inputs.get(key, {}).get(column, "") for column in columns))
        for key, value in flattened(scene).items()
    ]
    print_table(("key", "value", *columns), rows)


def _inputs(path: Path) -> dict[str, dict[str, str]]:
    """Return what is known of every input, by its key."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{path}: cannot be read: {error}") from error
    return {row["key"]: row for row in csv.DictReader(lines, delimiter="\t")}
