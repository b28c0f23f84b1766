"""Options and arguments that several subcommands share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knitstudy.cli.output import plain
from knitstudy.errors import ConfigurationError
from knitstudy.registry import load_plugins
from knitstudy.study.configuration import CONFIG, load_changed, workflow_configuration
from knitstudy.study.documents import parsed, read_yaml
from knitstudy.study.scene import Scene


class Change(click.ParamType):
    """One ``key=value``: a dotted key of a scene and a YAML value."""

    name = "key=value"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, Any]:
        """Return the key and the value."""
        if isinstance(value, tuple):
            return value
        key, equals, text = value.partition("=")
        if not equals or not key.strip():
            self.fail(f"{value!r} is not key=value, for example load.strain=0.01", param, ctx)
        try:
            return key.strip(), parsed(text, key)
        except ConfigurationError as error:
            self.fail(str(error), param, ctx)


def load_plugins_of(folder: Path) -> None:
    """Import the modules that ``config.yaml`` of a configuration folder names, as the workflow does."""
    path = folder / "config.yaml"
    if path.is_file():
        load_plugins(workflow_configuration(read_yaml(path)).plugins)


def _with_plugins(context: click.Context, option: click.Parameter, folder: Path) -> Path:
    """Return the configuration folder once its plugins are imported: values of other options may need them."""
    if not context.resilient_parsing:
        load_plugins_of(folder)
    return folder


config_option = click.option(
    "--config",
    type=click.Path(path_type=Path),
    default=CONFIG,
    is_eager=True,
    callback=_with_plugins,
    show_default="the checkout's own",
    help="Configuration folder: defaults.yaml, the families in scenes, and what they name.",
)

output_option = click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("results"),
    show_default=True,
    help="Folder of results. What is there and belongs to the same inputs is used again.",
)

set_option = click.option(
    "--set",
    "changes",
    type=Change(),
    multiple=True,
    help="Change a key of the scene, in SI units; may be repeated. The result gets a name of its own.",
)


def changed_scene(name: str, changes: tuple[tuple[str, Any], ...], config: Path) -> Scene:
    """Return a scene of the configuration with changed keys.

    Raises
    ------
    ConfigurationError
        If there is no such scene, a key is changed twice, or one is not known or not allowed.
    """
    keys = [key for key, _ in changes]
    if twice := [key for key in keys if keys.count(key) > 1]:
        values = " and ".join(plain(value) for key, value in changes if key == twice[0])
        raise ConfigurationError(
            f"--set {twice[0]} is given {keys.count(twice[0])} times, {values}; once is allowed"
        )
    return load_changed(name, dict(changes), config)
