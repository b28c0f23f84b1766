"""``knitstudy list``: which scenes there are."""

from __future__ import annotations

from pathlib import Path

import click

from knitstudy.cli.options import config_option
from knitstudy.cli.output import plain, print_table
from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice
from knitstudy.study.configuration import STUDIES, default_keys, load_families, load_scenes
from knitstudy.study.kinds import FIDELITIES
from knitstudy.study.scene import differences


@click.command("list", short_help="Which scenes there are.")
@click.option("--study", type=click.Choice(STUDIES), help="Only scenes of this study.")
@click.option("--family", help="Only scenes of this family, by the name of its file.")
@click.option("--fidelity", type=click.Choice(sorted(FIDELITIES)), help="Only scenes of this model.")
@config_option
def list_scenes(study: str | None, family: str | None, fidelity: str | None, config: Path) -> None:
    """List the scenes, each with its family, its studies and the keys that differ from the defaults (SI units).

    In a terminal it draws a table; in a pipe its columns are separated by tabs.

    \b
    knitstudy list --study reduced               what `make study` runs
    knitstudy list --fidelity hexahedra          solid yarns of hexahedra
    knitstudy list --family 2-medium             what config/scenes/2-medium.yaml defines
    knitstudy list | cut -f1                     names alone
    """
    scenes, defaults = load_scenes(config), default_keys(config)
    members = load_families(config)
    families = dict.fromkeys(member.family for member in members.values())
    if family is not None and family not in families:
        raise ConfigurationError(unknown_choice("unknown family", family, family, list(families)))
    rows = []
    for name, scene in scenes.items():
        member = members[name]
        inside = study is None or study in member.studies
        if inside and fidelity in (None, scene.fidelity) and family in (None, member.family):
            changed = ", ".join(
                f"{key}={plain(value)}" for key, value in differences(scene, defaults).items()
            )
            rows.append((name, member.family, ",".join(member.studies), changed))
    print_table(("scene", "family", "studies", "differs from defaults"), rows)
