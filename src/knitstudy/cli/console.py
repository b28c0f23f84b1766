"""What the subcommands share: options, and tables on the console."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import shorten
from typing import Any

import click
import yaml
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from knitstudy.errors import ConfigurationError
from knitstudy.files import read_dataset
from knitstudy.registry import load_plugins
from knitstudy.study.configuration import (
    CONFIG,
    drawn_defaults,
    load_changed,
    own_scenes,
    workflow_configuration,
)
from knitstudy.study.documents import parsed, read_yaml
from knitstudy.study.scene import Scene

ONE_LINE, LONGEST = 32, 120  # Characters of a value that a terminal does not break, and that it shows at all


def print_table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print rows under the names of their columns."""
    columns, *texts = ([plain(value) for value in row] for row in (columns, *rows))
    if sys.stdout is None or not sys.stdout.isatty():
        click.echo("\n".join("\t".join(line) for line in (columns, *texts)))
        return
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for place, name in enumerate(columns):
        longest = max((len(line[place]) for line in texts), default=0)
        table.add_column(name, no_wrap=longest <= ONE_LINE, overflow="fold")
    for line in texts:
        table.add_row(*(Text(shorten(text, LONGEST, placeholder=" ...")) for text in line))
    Console().print(table)


def plain(value: Any) -> str:
    """Return a value as it would stand in the configuration; numbers with the digits that matter.

    What a terminal would obey (escape sequences in the text of a file) is written out: ``\\x1b``.
    """
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    return yaml.safe_dump(value, default_flow_style=True, width=float("inf")).removesuffix("\n...\n").strip()


def visible(text: str) -> str:
    """Return a text with characters that do not print, but for the ends of lines, written out."""
    return "".join(each if each.isprintable() or each == "\n" else repr(each)[1:-1] for each in text)


class Change(click.ParamType):
    """One ``key=value``: a dotted key of a scene and a YAML value."""

    name = "key=value"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str, Any]:
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

set_option = click.option(
    "--set",
    "changes",
    type=Change(),
    multiple=True,
    help="Change a key of the scene, in SI units; may be repeated. The result gets a name of its own.",
)


def changed_scene(name: str, changes: tuple[tuple[str, Any], ...], config: Path) -> Scene:
    """Return a scene with changed keys; a key that is given twice is refused.

    The name is that of a scene of the configuration, a file of scenes (`configuration.own_members`), or a result file.
    """
    keys = [key for key, _ in changes]
    for twice in (key for key in keys if keys.count(key) > 1):
        values = " and ".join(plain(value) for key, value in changes if key == twice)
        raise ConfigurationError(
            f"--set {twice} is given {keys.count(twice)} times, {values}; once is allowed"
        )
    if is_result(name):
        return _recorded(name, drawn_defaults() if changes else {})[0].vary(dict(changes))
    return load_changed(name, dict(changes), config)


def is_result(name: str) -> bool:
    """Whether a scene is asked for by a file of results that holds its keys."""
    return name.endswith(".nc")


def scenes_beside(name: str, config: Path) -> dict[str, Scene]:
    """Return the scenes that a file brings with it, beside the one that is asked for by the name of the file."""
    return _recorded(name, {})[1] if is_result(name) else own_scenes(name, config)


def _recorded(name: str, defaults: dict) -> tuple[Scene, dict[str, Scene]]:
    from knitstudy.stages.record import scenes_of

    return scenes_of(read_dataset(name), name, defaults)
