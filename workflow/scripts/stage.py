"""Make the result of a step, unless it is there and up to date."""

from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.registry import load_plugins
from knitstudy.run.configuration import folder_of, workflow_configuration
from knitstudy.run.job import frame
from knitstudy.run.plan import Plan
from knitstudy.run.store import Store

load_plugins(snakemake.config.get("plugins", ()))
with frame(snakemake) as progress:
    plan = Plan.of(folder_of(workflow_configuration(snakemake.config)))
    step = plan.step_of(snakemake.params.stage, *snakemake.wildcards)
    if step.digest != snakemake.params.digest:
        raise ConfigurationError(f"scene {step.scene.name} was edited meanwhile; type the same command again")
    folder = Path(snakemake.output[0]).parents[len(step.path.parts) - 1]
    Store(folder, progress=lambda label: progress).get(step)
