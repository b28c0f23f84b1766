"""``knitstudy list``: which scenes there are."""

from __future__ import annotations

from pathlib import Path

import click

from knitstudy.cli.options import config_option
from knitstudy.cli.output import plain, print_table
from knitstudy.study.configuration import STUDIES, default_keys, load_scenes, load_study
from knitstudy.study.differences import differences
from knitstudy.study.kinds import FIDELITIES


@click.command("list", short_help="Which scenes there are.")
@click.option("--study", type=click.Choice(STUDIES), help="Only scenes of this study.")
@click.option("--fidelity", type=click.Choice(FIDELITIES.names()), help="Only scenes of this model.")
@config_option
def list_scenes(study: str | None, fidelity: str | None, config: Path) -> None:
    """List the scenes of the table, each with the keys that differ from the defaults (SI units).

    In a terminal it draws a table; in a pipe its columns are separated by tabs.

    \b
    knitstudy list --study reduced               what `make study` runs
    knitstudy list --fidelity dns                direct simulations with solid yarns
    knitstudy list | cut -f1                     names alone
    """
    scenes, defaults = load_scenes(config), default_keys(config)
    studies = {name: load_study(name, config) for name in STUDIES}
    rows = []
    for name, scene in scenes.items():
        inside = [each for each, names in studies.items() if name in names]
        if fidelity in (None, scene.fidelity) and (study is None or study in inside):
            changed = ", ".join(
                f"{key}={plain(value)}" for key, value in differences(scene, defaults).items()
            )
            rows.append((name, ",".join(inside), changed))
    print_table(("scene", "studies", "differs from defaults"), rows)
