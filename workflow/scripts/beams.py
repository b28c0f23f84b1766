"""Load a knit of beams in contact with friction."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.restart import forget_others, restart_path
from knitstudy.loading.run import Run
from knitstudy.networks.beams.run import run
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

scene = Scene.from_dict(snakemake.params.scene)
restart = restart_path(snakemake.params.restart, scene, snakemake.input)
forget_others(restart)

with stage(snakemake, restart=restart) as progress:
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    history = run(scene, knit, Run(restart, restart.with_suffix(".nc"), progress))
    write_dataset(history, snakemake.output[0], scene)
