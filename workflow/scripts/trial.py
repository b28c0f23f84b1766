"""Run one scene of the campaign of extremes in a process of its own, and write its row."""

import json
from pathlib import Path

from knitstudy.files import write_text
from knitstudy.registry import load_plugins
from knitstudy.stages.extremes import RESULTS, load_trials, run
from knitstudy.stages.plan import Plan
from knitstudy.stages.script import frame

with frame(snakemake):
    load_plugins(snakemake.config.get("plugins", ()))
    config = Path(snakemake.params.config)
    (trial,) = (trial for trial in load_trials(config) if trial.label == snakemake.wildcards.trial)
    row = run(trial, Plan.of(config), RESULTS)
    write_text(json.dumps(row), snakemake.output[0])
