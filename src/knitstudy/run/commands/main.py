"""The command itself: its subcommands, and how it ends when something is wrong."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import Any

import click

from knitstudy.errors import EndedEarly, KnitstudyError, message_of, printable_lines
from knitstudy.registry import optional_packages, plugin_behind, remedy_of_missing

_OWN = {
    "list": ("knitstudy.run.commands.scenes:list_scenes", "List the scenes."),
    "check": ("knitstudy.run.commands.scenes:check", "Check a configuration; show all keys of a scene."),
    "plan": ("knitstudy.run.commands.scenes:plan", "Choose a model for a question, and show its cost."),
    "measure": ("knitstudy.run.commands.run:measure", "Measure errors and costs of all models on a knit."),
    "run": ("knitstudy.run.commands.run:run", "Simulate a scene and all that it needs."),
    "study": ("knitstudy.run.commands.run:study", "Run a whole study, with its figures, tables and report."),
}

COMMANDS = _OWN | {
    name: command for package in optional_packages() for name, command in package.commands.items()
}
"""Module and function of every subcommand, imported when it is asked for, and its line of the help."""

STOPPED = 130  # Exit status after Ctrl-C, that of the shell's own commands
INCOMPLETE = 3  # Exit status of a load path that ended early


class Commands(click.Group):
    """Subcommands that end with one message where a user can correct the error."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of all subcommands, in the order in which a user needs them."""
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Return a subcommand, whose module is imported now: the help needs none of them."""
        if name not in COMMANDS:
            return None
        command: click.Command = resolve_name(COMMANDS[name][0])
        return command

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of subcommands."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, meaning) for name, (_, meaning) in COMMANDS.items()])

    def invoke(self, context: click.Context) -> Any:
        """Run a subcommand; with ``--traceback`` its errors pass as they are."""
        try:
            return super().invoke(context)
        except BrokenPipeError:
            raise  # whoever read the output has gone: click ends in silence
        except (Exception, KeyboardInterrupt, SystemExit) as error:
            ending = message_and_status(error)
            if context.params["traceback"] or ending is None:
                raise
        click.echo(printable_lines(f"error: {ending[0]}"), err=True)
        context.exit(ending[1])


def message_and_status(error: BaseException) -> tuple[str, int] | None:
    """Return the message and the exit status of an error that a user can correct; None of any other."""
    match error:
        case KeyboardInterrupt():
            return str(error) or "stopped; what was there before is as it was", STOPPED
        case MemoryError():
            return f"out of memory ({str(error) or 'no more details'}); use larger elements", 1
        case KnitstudyError() | OSError():
            return str(error), INCOMPLETE if isinstance(error, EndedEarly) else 1
        case UnicodeEncodeError():
            text = ascii(error.object[error.start : error.end])
            return f"the locale cannot write {text}: set LC_ALL=C.UTF-8 or PYTHONUTF8=1", 1
        case ModuleNotFoundError(name="fcntl" | "resource"):  # which Python has not on Windows
            return "knitstudy runs on Linux and macOS; on Windows, use WSL", 1
        case ModuleNotFoundError(name=module) if remedy := remedy_of_missing(module):
            return remedy, 1
    if plugin := plugin_behind(error):
        return f"plugin {plugin!r} ended the command: {message_of(error)}; --traceback shows where", 1
    return None


def print_version(context: click.Context, option: click.Parameter, wanted: bool) -> None:
    """Print the version and end; asked for only then, since it takes a call of git."""
    if wanted and not context.resilient_parsing:
        from knitstudy.datasets import code_version

        click.echo(f"knitstudy {code_version()}")
        context.exit()


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--traceback", is_flag=True, help="Show where in the code an error comes from.")
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=print_version,
    help="Show the version of the code and exit.",
)
def main(traceback: bool) -> None:
    """Simulate how knitted textiles carry load, one scene at a time.

    A scene is one simulation: a knit or two crossing yarns, the interaction of the yarns, the load, and the model.
    Files list scenes, as in config/scenes. All inputs and results are in SI units. In this order:

    \b
    knitstudy list                               all scenes
    knitstudy check yarns-tie-course             all keys of a scene, with units and sources
    knitstudy measure yarns-tie-course           errors and costs of all models on this knit
    knitstudy plan yarns-tie-course --question force --accuracy 0.05   the cheapest model that is accurate enough
    knitstudy run yarns-tie-course               simulate a scene and all that it needs

    `knitstudy COMMAND --help` shows more examples. `knitstudy study` runs a study with its figures and its report;
    docs/tutorial/examples.md does the same from Python.

    Exit status: 0 success, 1 error (described in one message), 2 wrong usage, 3 load path ended early (the
    curve so far is kept), 130 interrupted.
    """
