"""Load a reduced order model whose joints come from the contacts of a knit of solid yarns."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.restart import forget_others, restart_path
from knitstudy.loading.run import Run
from knitstudy.networks.rom.run import run
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

scene = Scene.from_dict(snakemake.params.scene)
restart = restart_path(snakemake.params.restart, scene, snakemake.input)
forget_others(restart)

with stage(snakemake, restart=restart) as progress:
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    contacts = read_dataset(snakemake.input.contacts)
    springs = read_dataset(snakemake.input.springs) if scene.rom.springs_from else None
    history = run(scene, knit, contacts, springs, Run(restart, restart.with_suffix(".nc"), progress))
    write_dataset(history, snakemake.output[0], scene)
