"""Load a knit or a pair of solid yarns."""

from math import ceil

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.restart import forget_others, restart_path
from knitstudy.solids import dns
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

scene = Scene.from_dict(snakemake.params.scene)
checkpoint = restart_path(snakemake.params.restart, scene, snakemake.input)
forget_others(checkpoint)

with stage(snakemake, restart=checkpoint) as progress:

    def watch(increment):
        """Report an increment that has converged."""
        load, legs = increment.load, len(scene.load.path)
        where = f"leg {ceil(load * legs)} of {legs}" if legs else f"strain {load * scene.load.strain:.2%}"
        progress(load, where)

    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    partial = checkpoint.with_suffix(".nc")
    history = dns.run(scene, mesh, specimen, checkpoint=checkpoint, partial=partial, progress=watch)
    write_dataset(history, snakemake.output[0], scene)
