# Scenes and stages, and what rules ask about them. The digest of a result decides whether it is made again: it is a param
# of its rule, and stands in its file. Times of results decide nothing, so that copies of results are as good as they are.
# Outputs are marked update(): whatever was there stays until a job replaces it, and is restored when a job fails.
import os
import shlex
import signal
import sys
import threading
from contextlib import suppress
from functools import cache, wraps
from pathlib import Path

import psutil

# Snakemake puts the interpreter into a shell command as it is: a checkout whose path has a space needs the quotes.
sys.executable = shlex.quote(sys.executable.strip("'"))
# Jobs run the code of the checkout that plans them; a workflow that imports these rules has knitstudy installed.
SOURCE = Path(workflow.current_basedir) / "../../src"
if SOURCE.is_dir():
    sys.path.insert(0, str(SOURCE.resolve()))
    os.environ.update(PYTHONPATH=os.pathsep.join(filter(None, (sys.path[0], os.getenv("PYTHONPATH")))))
# Jobs import no modules of the working folder, nor of the folder in it where Snakemake puts their scripts.
os.environ.update(PYTHONSAFEPATH="1")

from knitstudy.errors import KnitstudyError, printable_lines
from knitstudy.files import lay_link_to_later
from knitstudy.registry import load_plugins, optional_packages
from knitstudy.run.cost import machine_memory, time_limit
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.store import Store, digest_or_warning
from knitstudy.run.configuration import (
    folder_of,
    load_scenes,
    load_study,
    own_scenes,
    workflow_configuration,
)
from knitstudy.knit.scene.documents import RESOURCES

RESULTS = "results"


def stop(error):
    """End before anything runs, with one message and status 1."""
    print(printable_lines(f"error: {error}"), file=sys.stderr)
    sys.exit(1)


def stopping(function):
    """Return a function that stops where it raises an error of a user."""

    @wraps(function)
    def stops(*arguments):
        try:
            return function(*arguments)
        except KnitstudyError as error:
            stop(error)

    return stops


try:
    CONFIGURATION = workflow_configuration(config)
    load_plugins(CONFIGURATION.plugins)
    CONFIG = folder_of(CONFIGURATION)
    # The Snakemake of a job on a cluster reads the scenes that its job needs alone.
    PLAN = Plan(load_scenes(CONFIG)) if workflow.is_main_process else Plan.of(CONFIG)
    STUDY = [PLAN.scenes[name] for name in load_study(CONFIGURATION.study, CONFIG)]
    # Load paths that are known to end early, and what is made from them: the report names them.
    ENDED = Store(Path(RESULTS)).ended_early(PLAN.step("simulation", scene) for scene in STUDY)
    STUDY = [scene for scene in STUDY if scene.name not in ENDED]
except KnitstudyError as error:
    stop(error)

if workflow.is_main_process:
    for name, why in ENDED.items():
        print(printable_lines(f"left out: {name}, since {why}"), file=sys.stderr)


# Lists of all names would be patterns that take a tenth of the time of planning.
wildcard_constraints:
    knit="[^/.]+",
    scene="[^/.]+",


@stopping
def step_of(stage, wildcards):
    """Return the step of a job: of a geometry, that of the first scene that has it; stop where there is none."""
    return PLAN.step_of(stage, *wildcards)


def campaign():
    """Return the scenes of a folder of your own."""
    return [PLAN.scenes[name] for name in own_scenes(CONFIG)]


def wanted(scenes):
    """Return what a study consists of, beside its figures and tables."""
    return [f"{RESULTS}/{step.path}" for step in PLAN.steps(scenes) if step.wanted]


# ---- The digest decides

CHANGED = os.path.abspath(".snakemake/digest-has-changed")
"""An input of every result, whose time counts where the result has another digest; Snakemake names it as the reason."""

if workflow.is_main_process:
    stopping(lay_link_to_later)(Path(CHANGED))


@cache
@stopping
def recorded(path):
    """Return the digest that a result was written with; an empty text where there is none, or it is damaged."""
    return digest_or_warning(Path(path)) if os.path.isfile(path) else ""


def changed(digest, *patterns):
    """Return the function of `CHANGED`: its time counts where a file of the patterns was written with another digest."""

    def file(wildcards):
        paths = [pattern.format_map(dict(wildcards.items())) for pattern in patterns]
        there = filter(os.path.isfile, paths if workflow.is_main_process else ())
        return CHANGED if any(recorded(path) != digest(wildcards) for path in there) else ancient(CHANGED)

    return file


def settled(result):
    """Return whether a result, and all that it is made from, are there and up to date."""
    here = recorded(f"{RESULTS}/{result.path}") == result.digest
    return here and all(map(settled, result.needs.values()))


def source(what):
    """Return the path of a result or a file that something is made from; its time never counts where it is settled.

    What is made from a result that is to be made follows it: Snakemake asks for no other reason to make that.
    """
    if isinstance(what, Path):
        return ancient(str(what))
    path = f"{RESULTS}/{what.path}"
    return ancient(path) if workflow.is_main_process and settled(what) else path


def needs_of(stage):
    """Return the function of the files that a job takes, by the parameters of the stage's function."""
    return lambda wildcards: {name: source(need) for name, need in step_of(stage, wildcards).needs.items()}


def digest_of_step(stage):
    """Return the function of the digest of a result."""
    return lambda wildcards: step_of(stage, wildcards).digest


# ---- What a queue is asked for

OF_SNAKEMAKE = 400  # MB of the two processes of Snakemake in every job of a queue: 250 were measured


@cache
def array(rule):
    """Return the steps whose jobs of a rule are submitted as an array (option --slurm-array-jobs), none of others."""
    asked = (getattr(workflow.executor_settings, "array_jobs", None) or "").replace(";", ",")
    if not {each.strip() for each in asked.split(",")} & {"all", rule}:
        return []
    folder = shlex.quote(os.getcwd())
    if folder != os.getcwd():
        stop(
            f"--slurm-array-jobs: the plugin submits no arrays from {folder}: take a path of plain characters"
        )
    asked = campaign() if "campaign" in workflow.dag_settings.targets else STUDY
    steps = [PLAN.step(rule, scene) for scene in asked if STAGES[rule].of(scene)]
    if len(steps) > workflow.nodes:
        stop(
            f"--jobs is {workflow.nodes} but must be at least {len(steps)}: an array is submitted as a whole"
        )
    return steps


def largest(rule, need):
    """Return the function of what a job needs: in an array, which has one limit for all, what the largest job needs."""
    return lambda wildcards: max(
        getattr(step.cost, need) for step in array(rule) or [step_of(rule, wildcards)]
    )


def memory(rule):
    """Return the function of a job's memory [MB]: in a queue the need times the attempt, else at most what there is."""
    need = largest(rule, "memory")

    def asked(wildcards, attempt):
        if workflow.local_exec:
            return min(need(wildcards), machine_memory())
        return attempt * (need(wildcards) + OF_SNAKEMAKE)

    return asked


def runtime(rule):
    """Return the function of a job's time limit [min]. What a simulation has done by then is kept for the next attempt."""
    seconds = largest(rule, "seconds")
    return lambda wildcards, attempt: attempt * time_limit(seconds(wildcards))


def expect_jobs():
    """Tell the progress of a study which jobs are to run, and how long each may take."""
    from snakemake_logger_plugin_knitstudy import EXPECTED, SHORT

    for job in workflow.dag.needrun_jobs():
        stage = STAGES.get(job.params.get("stage"))
        seconds = step_of(stage.name, job.wildcards).cost.seconds if stage else SHORT
        EXPECTED[workflow.dag.jobid(job)] = job.rule.name, seconds


def end_jobs_at_term():
    """Have a TERM end the study as Ctrl-C does: Snakemake would wait in silence for jobs that may take hours."""

    def end(*_):
        print("ending the jobs that run; what they have done is kept", file=sys.stderr, flush=True)
        for process in psutil.Process().children(recursive=True):
            with suppress(psutil.Error):
                process.send_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    signal.signal(signal.SIGTERM, end)


def cancel_timers():
    """Cancel all timers. Snakemake's scheduler leaves some of `max-jobs-per-timespan`, and its process waits for them."""
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.cancel()
