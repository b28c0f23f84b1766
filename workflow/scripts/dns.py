"""Load a knit or a pair of solid yarns."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.specimen import read_specimen
from knitstudy.loading.restart import forget_others, restart_path
from knitstudy.loading.run import Run
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.dns import run
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

scene = Scene.from_dict(snakemake.params.scene)
restart = restart_path(snakemake.params.restart, scene, snakemake.input)
forget_others(restart)

with stage(snakemake, restart=restart) as progress:
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    history = run(scene, mesh, specimen, Run(restart, restart.with_suffix(".nc"), progress))
    write_dataset(history, snakemake.output[0], scene)
