"""The subcommand `study`: Snakemake's own command line, with the workflow, a lock of the folder and the last line."""

from __future__ import annotations

import fcntl
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from knitstudy.errors import ConfigurationError

RESULTS, REPORT = Path("results"), Path("results/report.html")
LOCK = Path("run/study.lock")
DRY = {"-n", "--dry-run", "--dryrun"}  # Options of Snakemake that only plan


@click.command(
    context_settings={"ignore_unknown_options": True},
)
@click.argument("name", default="reduced", metavar="[STUDY]")
@click.argument("options", nargs=-1, type=click.UNPROCESSED, metavar="[-- TARGETS AND OPTIONS OF SNAKEMAKE]")
@click.option("--folder", help="Scenes, or a configuration, of your own.")
def study(name: str, options: tuple[str, ...], folder: str | None) -> None:
    """Run a study with Snakemake in the working folder: ci, reduced, full, reference or fabrics.

    Results that are there and up to date stay. A study that was stopped or killed goes on where it was.

    \b
    knitstudy study                                             the reduced study
    knitstudy study ci -- results/geometry/plain3x3.nc          one file of a study, and all it needs
    knitstudy study full -- --dry-run                           jobs that would run
    """
    from knitstudy.knit.scene.documents import WORKFLOW
    from knitstudy.run.cost import machine_memory

    arguments = [
        "--snakefile",
        str(WORKFLOW.parent / "Snakefile"),
        "--logger",
        "knitstudy",
        "--nolock",
        *options,
    ]
    # Jobs wait until the memory that they declare is free.
    arguments += ["--resources", f"mem_mb={machine_memory()}", "--config", f"study={name}"]
    arguments += [f"folder={folder}"] if folder else []
    started = time.monotonic()
    with alone():
        if status := snakemake(arguments):
            raise click.exceptions.Exit(status)
    if DRY & {*options}:
        click.echo(f"Study {name}: the jobs above would run, by rule; nothing has been run.")
        return
    minutes, seconds = divmod(round(time.monotonic() - started), 60)
    report = f"Report: {REPORT.absolute()}. " if REPORT.exists() else ""
    click.echo(
        f"Study {name}: complete in {minutes} min {seconds} s. {report}Pictures, tables and data: {RESULTS.absolute()}"
    )


@contextmanager
def alone() -> Iterator[None]:
    """Hold this folder's lock, which ends with this process in any case; refuse a second study at once.

    Snakemake's own lock outlives a process that is killed.
    """
    LOCK.parent.mkdir(parents=True, exist_ok=True)
    with LOCK.open("a+", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            other = LOCK.read_text(encoding="utf-8", errors="replace").strip() or "unknown"
            raise ConfigurationError(
                f"a study is running here already (process {other}); wait for it or end it"
            ) from error
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield


def snakemake(arguments: list[str]) -> int:
    """Run Snakemake's command line in this process; return its exit status.

    Snakemake ends its jobs at Ctrl-C and returns as after any failure: the KeyboardInterrupt comes then.
    """
    import signal

    from snakemake.cli import main

    interrupted = []

    def interrupt(*_: object) -> None:
        interrupted.append(True)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        main(arguments)
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else 1
    finally:
        signal.signal(signal.SIGINT, before)
        sys.stdout.flush()
    if interrupted:
        raise KeyboardInterrupt(
            f"stopped; finished files are in {RESULTS}, runs that were not done keep their last increment in "
            f"{LOCK.parent}: the same command goes on from there"
        )
    return status
