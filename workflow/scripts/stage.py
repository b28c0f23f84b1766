"""Run one stage of one scene: which, says the name of the rule."""

from knitstudy.stages.job import run_stage

run_stage(snakemake)
