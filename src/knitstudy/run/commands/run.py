"""``knitstudy run``, ``measure`` and ``study``: simulate a scene, run all models on its knit, run a whole study.

A study is Snakemake's own command line, with the workflow, a lock of the folder and the last lines.
"""

from __future__ import annotations

import fcntl
import logging
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from knitstudy.datasets import read_dataset
from knitstudy.errors import ConfigurationError
from knitstudy.files import naming_remedy, open_regular
from knitstudy.knit.scene.documents import WORKFLOW
from knitstudy.knit.scene.scene import unit_warnings
from knitstudy.run.advice import ERROR, MEMORY, OWN, SECONDS
from knitstudy.run.commands import console
from knitstudy.run.configuration import asked_of
from knitstudy.run.cost import machine_memory

SAYING = (
    "knitstudy.run.configuration",
    "knitstudy.run.simulations",
    "knitstudy.run.store",
    "knitstudy.knit.loading.solve.resumed",
)
"""Loggers whose messages a user sees: which model was chosen, which stages ran, from which increment a run goes on."""


@click.command()
@console.scene_argument()
@console.set_option
@console.output_option
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads of a direct simulation; default: all cores."
)
@click.option(
    "--force", "--anew", "force", is_flag=True, help="Simulate the scene even if its result is there."
)
@click.option("-v", "--verbose", is_flag=True, help="Also print messages of the solver.")
@console.config_option
def run(
    scene: str,
    changes: console.Changes,
    output: Path,
    threads: int | None,
    force: bool,
    verbose: bool,
    config: Path,
) -> None:
    """Simulate a scene. Simulations that its joints and springs come from run first.

    Each stage (geometry, mesh, simulation, contacts) writes a file below the output folder, and the file
    is used again while its inputs and the code are the same. To resume an
    interrupted run from its last increment, repeat the command. A scene with changed keys gets its own
    name and does not replace the original. Changed keys of the geometry also apply to the simulations that
    a reduced model needs; other keys do not.

    \b
    knitstudy run cell-course
    knitstudy run yarns-tie-course --set mesh.degree=3
    knitstudy run yarns-tie-course --set pattern.loops=2 --set pattern.rows=2 --output small
    knitstudy run pair-slid-90 --set name=pair-smooth --set contact.friction=0.1
    knitstudy run my.yaml                        the scene of a file
    knitstudy run RESULT.nc --force              simulate the scene of a result file again

    A scene that leaves its model open (`fidelity: auto`) prints the chosen model and its cost before it runs.

    If a load path ends early, the curve so far is kept in SCENE.incomplete.nc, and the exit status is 3.

    Units are SI; sizes of elements are in yarn radii. `knitstudy show FILE` describes a result.
    """
    if threads is not None:
        os.environ["OMP_NUM_THREADS"] = str(threads)
    # Models are imported here: the other commands and --help do not need them.
    from knitstudy.knit.loading.run import Progress
    from knitstudy.measures.summary import differing_variables, summarise
    from knitstudy.run.simulations import simulate

    before = read_dataset(scene) if console.is_result(scene) else None
    try:
        with log_on_console(verbose):
            chosen = console.changed_scene(scene, changes, config)
            plan = console.plan_with(scene, config)
            results = simulate(chosen, output, config=config, progress=Progress, force=force, plan=plan)
    except KeyboardInterrupt:
        kept = f"stages that were done and the last converged increment are kept in {output}"
        raise KeyboardInterrupt(f"stopped; {kept}: repeat the command to resume") from None
    console.say(f"{results.path}:", err=True)
    console.print_table(("quantity", "value", "unit"), summarise(results.history))
    for warning in unit_warnings(chosen):  # again: the first time was before all other messages
        console.say(warning, err=True)
    if before is not None and "load" in before and force and not changes:
        others = ", ".join(differing_variables(before, results.history))
        made = console.plain(str(before.attrs.get("source", "")))
        same = f"the same as in {scene}, to the last bit, but for times"
        console.say(f"not the same as in {scene}, made by {made}: {others}" if others else same, err=True)


@click.command()
@console.scene_argument()
@console.set_option
@console.output_option
@console.config_option
def measure(scene: str, changes: console.Changes, output: Path, config: Path) -> None:
    """Run all model settings of config/trade.yaml on the knit of a scene, whatever model the scene names.

    Errors and costs go to measured.csv in the working folder; `plan` and `fidelity: auto` use them for this knit.
    The reference value is the limit of solid yarns of degrees 2, 3 and 4. Repeat an interrupted command to resume it.

    \b
    knitstudy measure yarns-tie-course
    knitstudy measure yarns-isotropic-course --set yarn.poisson_ratio=0.49
    """
    from knitstudy.run.trade import measure as measured

    problem, _, _ = asked_of(scene, dict(changes), config)
    with log_on_console(verbose=False):
        table = measured(problem, output)
    columns = ["model setting", "question", ERROR, SECONDS, MEMORY, "reason"]
    console.print_table(columns, table[columns].fillna("").itertuples(index=False))
    console.say(f"kept in {OWN}", err=True)


@contextmanager
def log_on_console(verbose: bool) -> Iterator[None]:
    """Print messages of the stages on standard error, between the lines of progress."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(console.PrintableFormatter())
    logger = logging.getLogger("knitstudy")
    logger.setLevel(logging.INFO if verbose else logging.WARNING)
    for name in SAYING:
        logging.getLogger(name).setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


# Studies

RESULTS, REPORT = Path("results"), Path("results/report.html")
LOCK = Path("run/study.lock")
READ_ONLY = "a study writes into its working folder: change to one that can be written"
DRY = {"-n", "--dry-run", "--dryrun"}  # Options of Snakemake that only plan


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("name", default="reduced", metavar="[STUDY]")
@click.argument("options", nargs=-1, type=click.UNPROCESSED, metavar="[-- TARGETS AND OPTIONS OF SNAKEMAKE]")
@click.option("--folder", help="Scenes, or a configuration, of your own.")
def study(name: str, options: tuple[str, ...], folder: str | None) -> None:
    """Run a study with Snakemake in the working folder: ci, reduced, full, reference or fabrics.

    Up-to-date results are kept. An interrupted study resumes.

    \b
    knitstudy study                                             the reduced study
    knitstudy study ci -- results/geometry/plain3x3.nc          one file of a study and its dependencies
    knitstudy study full -- --dry-run                           list the jobs without running them
    """
    if variable := os.environ.get("SNAKEMAKE_PROFILE"):
        console.say(
            f"SNAKEMAKE_PROFILE={variable} is not read: name a profile by -- --profile {variable}", err=True
        )
    # Without these Snakemake looks for profiles in the working folder, which may name any code; given ones win.
    arguments = ["--workflow-profile", str(WORKFLOW.parent / "profiles" / "default")]
    if not any(option.startswith("--profile") for option in options):
        arguments += ["--profile", "none"]
    arguments += [
        "--snakefile",
        str(WORKFLOW / "Snakefile"),
        "--logger",
        "knitstudy",
        "--nolock",
        *options,
    ]
    # Jobs wait until the memory that they declare is free.
    arguments += ["--resources", f"mem_mb={machine_memory()}", "--config", f"study={name}"]
    arguments += [f"folder={os.path.join('.', folder)}"] if folder else []  # 2024 would be a number
    started = time.monotonic()
    with alone():
        if status := snakemake(arguments):
            raise click.exceptions.Exit(status)
    if DRY & {*options}:
        console.say(f"Study {name}: the jobs above would run, by rule; nothing has been run.")
        return
    minutes, seconds = divmod(round(time.monotonic() - started), 60)
    report = f"Report: {REPORT.absolute()}. " if REPORT.exists() else ""
    console.say(
        f"Study {name}: complete in {minutes} min {seconds} s. {report}Pictures, tables and data: {RESULTS.absolute()}"
    )


@contextmanager
def alone() -> Iterator[None]:
    """Hold this folder's lock, which ends with this process in any case; refuse a second study at once.

    Snakemake's own lock outlives a process that is killed.
    """
    with naming_remedy(LOCK.parent.absolute(), READ_ONLY):
        LOCK.parent.mkdir(parents=True, exist_ok=True)
        lock = open_regular(LOCK)
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            other = lock.read(20).strip() or "unknown"
            raise ConfigurationError(
                f"a study is running here already (process {other}); wait for it or end it"
            ) from error
        except OSError as error:
            console.say(
                f"{LOCK}: {error.strerror}: start no second study in this folder while this one runs",
                err=True,
            )
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
            f"{RESULTS / 'restart'}: repeat the command to resume"
        )
    return status
