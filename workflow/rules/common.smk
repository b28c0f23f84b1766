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
from knitstudy.registry import load_plugins
from knitstudy.stages.memory import machine_memory
from knitstudy.stages.plan import OUTDATED, Plan
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_study, workflow_configuration


def stop(error):
    """End before anything runs, with one message and status 1."""
    print(f"error: {error}", file=sys.stderr)
    sys.exit(1)


try:
    CONFIGURATION = workflow_configuration(config)
    load_plugins(CONFIGURATION.plugins)
    CONFIG = Path(CONFIGURATION.folder)
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


wildcard_constraints:
    knit="|".join(PLAN.knits),
    scene="|".join(PLAN.scenes),


def scene_of(wildcards):
    """Return the scene of a job: of a geometry, the first that has it."""
    return PLAN.knits[wildcards.knit] if "knit" in wildcards.keys() else PLAN.scenes[wildcards.scene]


def scenes_with(stage):
    """Return a regular expression of the scenes that have a stage."""
    return "|".join(name for name, scene in PLAN.scenes.items() if STAGES[stage].of(scene)) or "(?!)"


def wanted(scenes):
    """Return what a study consists of, beside its figures and tables."""
    return [f"{RESULTS}/{path}" for path in PLAN.wanted(scenes)]


# ---- Stages


def made(rule, name):
    """Return the function of the file that a rule takes under a name; no file where its scene needs none."""

    def path(wildcards):
        try:
            needs = PLAN.needs(STAGES[rule], scene_of(wildcards))
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
        path = OUTDATED / STAGES[rule].path(scene_of(wildcards))
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


def memory(rule):
    """Return the function of a job's memory, at most what there is: the stage itself refuses what does not fit."""
    return lambda wildcards: min(STAGES[rule].memory(scene_of(wildcards)), machine_memory())


# ---- Trials of the campaign of extremes


@cache
def trials():
    """Return the trials of the campaign by their labels."""
    from knitstudy.stages.extremes import load_trials

    try:
        return {trial.label: trial for trial in load_trials(CONFIG)}
    except KnitstudyError as error:
        stop(error)
