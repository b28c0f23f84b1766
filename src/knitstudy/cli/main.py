"""The command itself: its subcommands, and how it ends when something is wrong."""

from __future__ import annotations

import sys
from typing import Any

import click

from knitstudy.cli.check import check
from knitstudy.cli.export import export
from knitstudy.cli.list import list_scenes
from knitstudy.cli.output import forget_output, open_standard_streams
from knitstudy.cli.plan import plan
from knitstudy.cli.run import run
from knitstudy.cli.show import show
from knitstudy.errors import KnitstudyError
from knitstudy.files import code_version


class OneMessage(click.ClickException):
    """An error that ends the command with its message alone and status 1."""

    def show(self, file: Any = None) -> None:
        """Print the message as the workflow does."""
        click.echo(f"error: {self.format_message()}", file=file or sys.stderr)


class Stopped(OneMessage):
    """The end of a command that was interrupted: status 130, as the shell's own commands have."""

    exit_code = 130


class Commands(click.Group):
    """Subcommands that end with one message where a user can mend what is wrong."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Run the command, whichever of its standard streams are open."""
        open_standard_streams()
        return super().main(*arguments, **options)

    def invoke(self, context: click.Context) -> Any:
        """Run a subcommand; with ``--traceback`` its errors pass as they are."""
        try:
            result = super().invoke(context)
            sys.stdout.flush()
            return result
        except BrokenPipeError:
            forget_output()
        except (KnitstudyError, OSError, MemoryError, KeyboardInterrupt) as error:
            if context.params["traceback"]:
                raise
            if isinstance(error, KeyboardInterrupt):
                raise Stopped(str(error) or "stopped; what was there before is as it was") from error
            if isinstance(error, MemoryError):
                raise OneMessage(
                    f"out of memory ({error or 'no more details'}); use larger elements"
                ) from error
            raise OneMessage(str(error)) from error


def print_version(context: click.Context, option: click.Parameter, wanted: bool) -> None:
    """Print the version and end; asked for only then, since it takes a call of git."""
    if wanted and not context.resilient_parsing:
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
    help="Show the version of the code and end.",
)
def main(traceback: bool) -> None:
    """How do knitted textiles carry load? One scene at a time.

    A scene is one simulation: a knit or two crossing yarns, how they interact, how they are loaded, and by which model.
    The files in config/scenes list the scenes; all inputs and results are in SI units.

    \b
    knitstudy list                               which scenes there are
    knitstudy check dns-tie-course               all keys of one, and what they are worth
    knitstudy plan rom3d-tie-course --question force --accuracy 0.05   which model is good enough
    knitstudy run rom3d-tie-course               simulate it, and whatever it needs
    knitstudy show results/simulation/rom3d-tie-course.nc
    knitstudy export dns-tie-course --dialect calculix

    The whole study, with its figures and its report, is `make study`. The same functions from Python: docs/tutorial.md.
    Status: 0 done, 1 something must be mended (one message says what), 2 the command was not understood, 130 stopped.
    """


for command in (list_scenes, check, plan, run, show, export):
    main.add_command(command)
