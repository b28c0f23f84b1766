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
from knitstudy.registry import find, load_plugins, wings
from knitstudy.run.cost import machine_memory, time_limit
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.configuration import (
    folder_of,
    load_scenes,
    load_study,
    own_scenes,
    workflow_configuration,
)
from knitstudy.knit.scene.documents import RESOURCES


def stop(error):
    """End before anything runs, with one message and status 1."""
    print(f"error: {error}", file=sys.stderr)
    sys.exit(1)


try:
    CONFIGURATION = workflow_configuration(config)
    load_plugins(CONFIGURATION.plugins)
    CONFIG = folder_of(CONFIGURATION)
    # The Snakemake of a job on a cluster reads the scenes that its job needs alone.
    PLAN = Plan(load_scenes(CONFIG)) if workflow.is_main_process else Plan.of(CONFIG)
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


def campaign():
    """Return the scenes of a folder of your own."""
    return [PLAN.scenes[name] for name in own_scenes(CONFIG)]


def wanted(scenes):
    """Return what a study consists of, beside its figures and tables."""
    return [f"{RESULTS}/{path}" for path in PLAN.wanted(scenes)]


# ---- Stages


def made(rule):
    """Return the function of the files that a job takes, by the parameters of the stage's function."""

    def files(wildcards):
        try:
            needs = PLAN.needs(STAGES[rule], scene_of(wildcards, rule))
        except KnitstudyError as error:
            stop(error)
        return {name: f"{RESULTS}/{stage.path(scene)}" for name, (stage, scene) in needs.items()}

    return files


def digest(rule):
    """Return the function of the digest of a result."""
    return lambda wildcards: PLAN.digest(STAGES[rule], scene_of(wildcards))


# ---- What a queue is asked for

OF_SNAKEMAKE = 400  # MB of the two processes of Snakemake in every job of a queue: 250 were measured


@cache
def array(rule):
    """Return the scenes whose jobs of a rule are submitted as an array (option --slurm-array-jobs), none of others."""
    asked = (getattr(workflow.executor_settings, "array_jobs", None) or "").replace(";", ",")
    if not {each.strip() for each in asked.split(",")} & {"all", rule}:
        return []
    folder = shlex.quote(os.getcwd())
    if folder != os.getcwd():
        stop(
            f"--slurm-array-jobs: the plugin submits no arrays from {folder}: take a path of plain characters"
        )
    asked = campaign() if "campaign" in workflow.dag_settings.targets else STUDY
    scenes = [scene for scene in asked if STAGES[rule].of(scene)]
    if len(scenes) > workflow.nodes:
        stop(
            f"--jobs is {workflow.nodes} but must be at least {len(scenes)}: an array is submitted as a whole"
        )
    return scenes


def largest(rule, need):
    """Return the function of what a job needs: in an array, which has one limit for all, what the largest job needs."""
    return lambda wildcards: max(map(need, array(rule) or [scene_of(wildcards)]))


def memory(rule):
    """Return the function of a job's memory [MB]: in a queue the need times the attempt, else at most what there is."""
    need = largest(rule, STAGES[rule].memory)

    def asked(wildcards, attempt):
        if workflow.local_exec:
            return min(need(wildcards), machine_memory())
        return attempt * (need(wildcards) + OF_SNAKEMAKE)

    return asked


def runtime(rule):
    """Return the function of a job's time limit [min]. What a simulation has done by then is kept for the next attempt."""
    seconds = largest(rule, STAGES[rule].seconds)
    return lambda wildcards, attempt: attempt * time_limit(seconds(wildcards))
