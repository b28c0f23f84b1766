"""Run the stage that has the name of the rule, unless its result is there and up to date."""

import sys
from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.files import read_result
from knitstudy.knit.loading.run import Run, restart_of
from knitstudy.registry import load_plugins
from knitstudy.run.configuration import folder_of, workflow_configuration
from knitstudy.run.job import frame
from knitstudy.run.plan import Plan, make, result_of
from knitstudy.run.stages import STAGES

RESTARTS = Path("run")  # Folder of restart files, by stage

load_plugins(snakemake.config.get("plugins", ()))
with frame(snakemake) as progress:
    plan = Plan.of(folder_of(workflow_configuration(snakemake.config)))
    stage, labels = STAGES[snakemake.rule], snakemake.wildcards
    scene = plan.knits[labels.knit] if "knit" in labels.keys() else plan.scenes[labels.scene]
    target, wanted = Path(snakemake.output[0]), snakemake.params.digest
    if plan.digest(stage, scene) != wanted:
        raise ConfigurationError(f"scene {scene.name} was edited meanwhile; type the same command again")
    if stage.is_dataset and target.is_file() and result_of(target, wanted) is not None:
        print(f"{target} is up to date", file=sys.stderr)
    else:
        if stage.restarts:
            stage.require_machine(scene)
        needed = {name: read_result(path) for name, path in snakemake.input.items()}
        restart = restart_of(RESTARTS / stage.name, scene.name, wanted) if stage.restarts else None
        seen = scene.only(stage.document(scene), stage.keys(scene))
        make(stage, seen, needed, target, wanted, Run(restart, progress), plan.record(stage, scene))
