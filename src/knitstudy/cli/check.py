"""``knitstudy check``: is a configuration valid, and what are the keys of a scene."""

from __future__ import annotations

from pathlib import Path

import click

from knitstudy.cli.options import changed_scene, config_option, load_plugins_of, set_option
from knitstudy.cli.output import print_table
from knitstudy.study.configuration import STUDIES, knits_of, load_scenes, load_study
from knitstudy.study.keys import describe
from knitstudy.study.kinds import Labels
from knitstudy.study.scene import Scene, flattened


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
        _print_keys(changed_scene(what, changes, config), sources)


def _check_folder(folder: Path) -> None:
    load_plugins_of(folder)
    scenes = load_scenes(folder)
    knits = knits_of(scenes)
    studies = ", ".join(f"{len(load_study(name, folder))} of study {name}" for name in STUDIES)
    click.echo(f"{folder}: valid; {len(scenes)} scenes ({studies}), {len(knits)} geometries")


def _print_keys(scene: Scene, sources: bool) -> None:
    """Print every key with what its description says of it."""
    columns = ("unit", "standing", *(("source", "checked") if sources else ()))
    rows = []
    for key, value in flattened(scene).items():
        name, _, field = key.rpartition(".")
        described = describe(type(scene.sections[name]) if name else Labels, field)
        rows.append((key, value, *(getattr(described, column) for column in columns)))
    print_table(("key", "value", *columns), rows)
