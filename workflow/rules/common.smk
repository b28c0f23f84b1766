# Scenes and stages, and what rules ask about them. Every value that a result depends on reaches its rule as an input or a
# param. Outputs are marked update(): whatever was there stays until a job replaces it, and is restored when a job fails.
import os
import shlex
import sys
from functools import cache
from pathlib import Path

# Snakemake puts the interpreter into a shell command as it is: a checkout whose path has a space needs the quotes.
sys.executable = shlex.quote(sys.executable)
sys.path.insert(0, str(Path(workflow.basedir) / "src"))

from knitstudy.errors import KnitstudyError
from knitstudy.registry import find, load_plugins
from knitstudy.stages.cost import machine_memory, time_limit
from knitstudy.stages.plan import OUTDATED, Plan
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import folder_of, load_study, own_scenes, workflow_configuration
from knitstudy.study.documents import RESOURCES


def stop(error):
    """End before anything runs, with one message and status 1."""
    print(f"error: {error}", file=sys.stderr)
    sys.exit(1)


try:
    CONFIGURATION = workflow_configuration(config)
    load_plugins(CONFIGURATION.plugins)
    CONFIG = folder_of(CONFIGURATION)
    PLAN = Plan.of(CONFIG)
    STUDY = [PLAN.scenes[name] for name in load_study(CONFIGURATION.study, CONFIG)]
    # Load paths that are known to end early, and what is made from them: the report names them.
    ENDED = PLAN.ended_early(STUDY, Path("results"))
    STUDY = [scene for scene in STUDY if scene.name not in ENDED]
except KnitstudyError as error:
    stop(error)

RESULTS = "results"

if workflow.is_main_process:
    for name, why in ENDED.items():
        print(f"left out: {name}, since {why}", file=sys.stderr)
    PLAN.mark_outdated(Path(RESULTS))


# Lists of all names would be patterns that take a tenth of the time of planning.
wildcard_constraints:
    knit="[^/.]+",
    scene="[^/.]+",


def scene_of(wildcards, rule=None):
    """Return the scene of a job: of a geometry, the first that has it; stop where there is none, or none of this stage."""
    try:
        if "knit" in wildcards.keys():
            return find("knit", PLAN.knits, wildcards.knit)
        scene = find("scene", PLAN.scenes, wildcards.scene)
        if rule and not STAGES[rule].of(scene):
            raise KnitstudyError(f"the scene {scene.name!r} has no {rule}")
        return scene
    except KnitstudyError as error:
        stop(error)


def wanted(scenes):
    """Return what a study consists of, beside its figures and tables."""
    return [f"{RESULTS}/{path}" for path in PLAN.wanted(scenes)]


# ---- Stages


def made(rule, name):
    """Return the function of the file that a rule takes under a name; no file where its scene needs none."""

    def path(wildcards):
        try:
            needs = PLAN.needs(STAGES[rule], scene_of(wildcards, rule))
        except KnitstudyError as error:
            stop(error)
        if name not in needs:
            return []
        stage, scene = needs[name]
        return f"{RESULTS}/{stage.path(scene)}"

    return path


def outdated(rule):
    """Return the function of the mark of a job's result, where there is one."""

    def mark(wildcards):
        path = OUTDATED / STAGES[rule].path(scene_of(wildcards, rule))
        return [str(path)] if path.is_file() else []

    return mark


def labels(wildcards):
    """Return the name and the kind of a scene."""
    scene = scene_of(wildcards)
    names = ("name", "knit", "specimen", "fidelity", "interaction")
    return {name: getattr(scene, name) for name in names} | {"outputs": []}


def reads(rule):
    """Return the function that says what a job reads of its scene."""
    return lambda wildcards: STAGES[rule].document(scene_of(wildcards))


def digest(rule):
    """Return the function of the digest of a result that does not carry one itself."""
    return lambda wildcards: PLAN.digest(STAGES[rule], scene_of(wildcards))


# ---- What a queue is asked for

OF_SNAKEMAKE = 400  # MB of the two processes of Snakemake in every job of a queue: 250 were measured
IN_ARRAYS = {}  # Wildcards of all jobs of the rules whose jobs are submitted as arrays


def gather_arrays():
    """Note the jobs of arrays (option --slurm-array-jobs); stop where the plugin could not submit them."""
    asked = (getattr(workflow.executor_settings, "array_jobs", None) or "").replace(";", ",")
    named = {each.strip() for each in asked.split(",")}
    for job in workflow.dag.needrun_jobs():
        if not job.is_local and named & {"all", job.rule.name}:
            IN_ARRAYS.setdefault(job.rule.name, []).append(job.wildcards)
    many = max(map(len, IN_ARRAYS.values()), default=0)
    if many and shlex.quote(os.getcwd()) != os.getcwd():
        stop(
            f"--slurm-array-jobs: the plugin submits no arrays from {os.getcwd()!r}: take a path of plain characters"
        )
    if many and many > workflow.nodes:  # there is no such number outside of a cluster
        stop(f"--jobs is {workflow.nodes} but must be at least {many}: an array is submitted as a whole")


def largest(rule, need):
    """Return the function of what a job needs: in an array, which has one limit for all, what the largest job needs."""
    of_array = cache(lambda: max(map(need, IN_ARRAYS[rule])))
    return lambda wildcards: of_array() if rule in IN_ARRAYS else need(wildcards)


def memory(rule, need=None):
    """Return the function of a job's memory [MB]: in a queue the need times the attempt, else at most what there is."""
    need = largest(rule, need or (lambda wildcards: STAGES[rule].memory(scene_of(wildcards))))

    def asked(wildcards, attempt):
        if workflow.local_exec:
            return min(need(wildcards), machine_memory())
        return attempt * (need(wildcards) + OF_SNAKEMAKE)

    return asked


def runtime(rule, seconds=None):
    """Return the function of a job's time limit [min]. What a simulation has done by then is kept for the next attempt."""
    seconds = largest(rule, seconds or (lambda wildcards: STAGES[rule].seconds(scene_of(wildcards))))
    return lambda wildcards, attempt: attempt * time_limit(seconds(wildcards))
