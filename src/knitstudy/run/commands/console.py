"""Options of several subcommands, and tables on the console."""

from __future__ import annotations

import logging
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any, TypeVar

import click
import yaml
from click.core import ParameterSource
from click.shell_completion import CompletionItem
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from knitstudy.datasets import read_dataset
from knitstudy.errors import ConfigurationError, DataFileError, KnitstudyError, printable, printable_lines
from knitstudy.knit.scene.alternatives import OTHER_WAYS
from knitstudy.knit.scene.documents import CONFIG, packaged_defaults, parsed, read_yaml
from knitstudy.knit.scene.kinds import all_keys
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import is_loaded, load_plugins
from knitstudy.run.advice import Requirements
from knitstudy.run.configuration import load_families, load_scene, scene_of_file, workflow_configuration

if TYPE_CHECKING:
    import xarray as xr

Command = TypeVar("Command", bound=Callable[..., Any])
Changes = tuple[tuple[str, Any], ...]  # keys that ``--set`` changes, with their values

FOLDER = click.Path(path_type=Path, file_okay=False)
FILE = click.Path(path_type=Path, dir_okay=False)
THERE = click.Path(path_type=Path, dir_okay=False, exists=True)
SIZE = click.FloatRange(min=0, min_open=True)

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


def say(text: str = "", err: bool = False) -> None:
    """Print lines, with `err` on standard error, whatever characters of a file are in them: all commands print so."""
    click.echo(printable_lines(text), err=err)


class PrintableFormatter(logging.Formatter):
    """Messages alone, whatever characters of a file are in them."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the message of a record."""
        return printable_lines(super().format(record))


def plain(value: Any) -> str:
    """Return a value as it would stand in the configuration; numbers with the digits that matter."""
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    text: str = yaml.safe_dump(value, default_flow_style=True, width=float("inf"))
    return text.removesuffix("\n...\n").strip()


class FileOf(click.Path):
    """A file with an ending, so that what is written is never another file of a result."""

    def __init__(self, suffix: str) -> None:
        super().__init__(path_type=Path, dir_okay=False)
        self.suffix = suffix

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the path."""
        if Path(value).suffix != self.suffix:
            self.fail(f"{value} must end with {self.suffix}", param, ctx)
        return super().convert(value, param, ctx)


CSV, NC = FileOf(".csv"), FileOf(".nc")


class Change(click.ParamType):  # type: ignore[type-arg]  # which click 8.2 does not have
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

    def shell_complete(
        self, context: click.Context, option: click.Parameter, begun: str
    ) -> list[CompletionItem]:
        """Return the keys that begin with the typed text."""
        if "=" in begun:
            return []
        keys = [*all_keys(), *OTHER_WAYS, *(f"ask.{name}" for name in Requirements.model_fields)]
        return [CompletionItem(f"{key}=") for key in keys if key.startswith(begun)]


def load_plugins_of(config: Path) -> None:
    """Import the plugins that ``config.yaml`` of the default configuration names, as the workflow does.

    Plugins of another folder run only if the command names them; otherwise a message mentions them.
    """
    path = config / "config.yaml"
    plugins = workflow_configuration(read_yaml(path)).plugins if path.is_file() else ()
    if config.resolve() == CONFIG:
        load_plugins(plugins)
        return
    for name in plugins:
        if not is_loaded(name):
            message = f"{path}: plugin {name!r} was not run; to run its code, add --plugin {name}"
            say(message, err=True)


def _plugins(context: click.Context, option: click.Parameter, names: tuple[str, ...]) -> None:
    if not context.resilient_parsing:
        load_plugins(names)


def _configuration(context: click.Context, option: click.Parameter, config: Path) -> Path:
    """Return the configuration, once its plugins are imported: the file where that takes the place of a scene."""
    if context.resilient_parsing:
        return config
    scene = context.params.get("scene") or context.params.get("what") or ""
    if scene.endswith((".yaml", ".yml")):
        if context.get_parameter_source("config") is not ParameterSource.DEFAULT:
            raise click.UsageError(f"--config is not read beside the file {scene}")
        config = Path(scene)
        if "scene" in context.params:
            context.params["scene"] = scene_of_file(config)
    load_plugins_of(config)
    return config


def config_option(command: Command) -> Command:
    """Add ``--config`` and ``--plugin`` to a command."""
    command = click.option(
        "--plugin",
        multiple=True,
        is_eager=True,
        expose_value=False,
        callback=_plugins,
        help="Run a plugin: an installed entry point of knitstudy.plugins, or a module; may be repeated.",
    )(command)
    return click.option(
        "--config",
        type=click.Path(path_type=Path),
        default=CONFIG,
        callback=_configuration,
        show_default="the one of knitstudy",
        help="A file or a folder of your own scenes; a folder with defaults.yaml is a complete configuration.",
    )(command)


def _scenes(context: click.Context, argument: click.Parameter, begun: str) -> list[str]:
    """Return the names of scenes that begin with the typed text."""
    try:
        families = load_families(context.params.get("config") or CONFIG)
    except KnitstudyError:
        return []
    return [name for name in families if name.startswith(begun)]


def scene_argument(name: str = "scene", **options: Any) -> Callable[[Command], Command]:
    """Return the argument of a command that names a scene, or a file that defines one."""
    return click.argument(name, is_eager=True, shell_complete=_scenes, **options)


def _once(context: click.Context, option: click.Parameter, changes: Changes) -> Changes:
    """Return changes of keys; one that is given twice is refused."""
    for key, times in Counter(key for key, _ in changes).items():
        if times > 1:
            values = " and ".join(plain(value) for other, value in changes if other == key)
            raise ConfigurationError(f"--set {key} is given {times} times, {values}; once is allowed")
    return changes


set_option = click.option(
    "--set",
    "changes",
    type=Change(),
    multiple=True,
    callback=_once,
    help="Change a key of the scene, in SI units; may be repeated. The result gets a name of its own.",
)


output_option = click.option(
    "-o",
    "--output",
    type=FOLDER,
    default="runs",
    show_default=True,
    help="Folder of results; results of a study in results/ are used as well.",
)


decimal_option = click.option(
    "--decimal",
    type=click.Choice((".", ",")),
    default=".",
    show_default=True,
    help="Decimal mark in tables (.csv); with commas, semicolons stand between fields.",
)


def changed_scene(name: str, changes: Changes, config: Path) -> Scene:
    """Return a scene of the configuration or of a result file with changed keys."""
    if is_result(name):
        return recorded(name, packaged_defaults() if changes else {})[0].vary(dict(changes))
    return load_scene(name, config, dict(changes))


def is_result(name: str) -> bool:
    """Whether the argument SCENE is a result file, which holds the keys of its scene."""
    return name.endswith(".nc")


def recorded(name: str, defaults: Mapping[str, Any]) -> tuple[Scene, dict[str, Scene]]:
    """Return the scene of a result file and the scenes that it names; `defaults` are for keys that the file lacks."""
    from knitstudy.run.store import recorded_scenes

    return recorded_scenes(read_dataset(name), name, defaults)


def undeformed(file: Path, history: xr.Dataset, solids: bool) -> tuple[Scene, xr.Dataset, xr.Dataset | None]:
    """Return the scene of the history in a result file, its geometry and, for `solids`, its mesh if there is one.

    Raises DataFileError if the file holds no history.
    """
    from knitstudy.measures.summary import kind_of
    from knitstudy.mechanics.core.batches import serial_blas
    from knitstudy.run.stages import STAGES

    try:
        kind = kind_of(history)
    except DataFileError as error:
        raise DataFileError(f"{file}: {error}") from error
    if kind != "history":
        raise DataFileError(f"{file}: is a {kind} and must be a history")
    scene = recorded(str(file), {})[0]
    with serial_blas():  # as in a run: whether a tight loop is found may depend on the last bits of its sums
        geometry = STAGES["geometry"].function(scene)
        mesh = (
            STAGES["mesh"].function(scene, geometry=geometry) if solids and STAGES["mesh"].of(scene) else None
        )
    return scene, geometry, mesh


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Name the file in whatever is wrong with its content."""
    try:
        yield
    except DataFileError as error:
        raise DataFileError(f"{file}: {error}") from error
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        what = f"its variables or attributes do not fit a result ({type(error).__name__}: {error})"
        raise DataFileError(f"{file}: {what}; make it again") from error


def plan_with(name: str, config: Path) -> Any:
    """Return the plan of a configuration, with the scenes that a result file names if one is asked for."""
    from knitstudy.run.plan import Plan

    return Plan.with_scenes(recorded(name, {})[1] if is_result(name) else {}, config)
