# Scenes, and what rules ask about them. Every value that a result depends on reaches its rule as an input or a param.
# Outputs are marked update(): whatever was there is restored when a job fails. Stages write their files whole or not at
# all, so nothing is ever really updated.
import os
import shlex
import sys
from pathlib import Path

import yaml

# Snakemake puts the interpreter into a shell command as it is: a checkout whose path has a space needs the quotes.
sys.executable = shlex.quote(sys.executable)
sys.path.insert(0, str(Path(workflow.basedir) / "src"))

from knitstudy.study.configuration import load_knits, load_scenes, load_study
from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.stages.imports import modules_behind
from knitstudy.study.schema import validate


def stop(error):
    """End before anything runs, with one message and status 1."""
    print(f"error: {error}", file=sys.stderr)
    sys.exit(1)


try:
    with open(workflow.source_path("../schemas/config.schema.yaml")) as schema:
        validate(dict(config), yaml.safe_load(schema), "the workflow's configuration")
    CONFIG = Path(config["folder"])
    SCENES = load_scenes(CONFIG)
    KNITS = load_knits(CONFIG)
    STUDY = [SCENES[name] for name in load_study(config["study"], CONFIG)]
except KnitstudyError as error:
    stop(error)


wildcard_constraints:
    knit="|".join(KNITS),
    scene="|".join(SCENES),


def names(fidelities):
    """Return a regular expression of the scenes of some fidelities."""
    return "|".join(scene.name for scene in SCENES.values() if scene.fidelity in fidelities)


def code(*modules):
    """Return the library files that a rule's result depends on, relative to the working directory."""
    return [os.path.relpath(path) for path in modules_behind(*modules)]


def parameters(wildcards):
    """Return all keys of a scene: a change of one of them runs the rule again."""
    return SCENES[wildcards.scene].to_dict()


def knit_of(wildcards):
    """Return the geometry of a scene's knit."""
    return f"results/geometry/{SCENES[wildcards.scene].knit}.nc"


def contacts_of(wildcards):
    """Return the contacts that a reduced model takes its joints from, and those of other springs if it asks for them."""
    rom = SCENES[wildcards.scene].rom
    named = {"contacts": rom.contacts_from, "springs": rom.springs_from}
    return {name: f"results/contacts/{scene}.nc" for name, scene in named.items() if scene}


def history_with_fields(wildcards):
    """Return the history of a direct simulation that keeps its fields; stop where the scene does not ask for them."""
    scene = SCENES[wildcards.scene]
    if "fields" not in scene.outputs:
        listed = ", ".join(scene.outputs)
        stop(
            ConfigurationError(
                f"scene {scene.name!r}: outputs is [{listed}] but must hold 'fields': "
                f"results/dns/{scene.name}.vtu shows node_displacement, which is kept with it"
            )
        )
    return f"results/dns/{scene.name}.nc"


# Stage that simulates a scene, by its fidelity.
STAGES = {"dns": "dns", "rom3d": "rom", "rom2d": "rom", "beam": "beams"}


def histories(scenes):
    """Return the result of every scene, under the folder of its stage."""
    return [f"results/{STAGES[scene.fidelity]}/{scene.name}.nc" for scene in scenes]


def meshes(scenes):
    """Return the meshes that scenes ask for in other formats."""
    direct = [scene for scene in scenes if scene.fidelity == "dns"]
    return [f"results/mesh/{s.name}.vtu" for s in direct if "vtu" in s.outputs] + [
        f"results/mesh/{s.name}.{dialect}.inp" for s in direct if "deck" in s.outputs for dialect in DIALECTS
    ]


def deformed(scenes):
    """Return the deformed yarns that scenes ask for: what ParaView shows, of fields that were kept."""
    direct = [scene for scene in scenes if scene.fidelity == "dns"]
    return [f"results/dns/{s.name}.vtu" for s in direct if {"fields", "vtu"} <= set(s.outputs)]
