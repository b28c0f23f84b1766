"""Pull a knit of solid yarns."""

from knitstudy import dns
from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_dataset, write_dataset
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.restart import forget_others, restart_path
from knitstudy.scene import Scene
from knitstudy.stage import stage

scene = Scene.from_dict(snakemake.params.scene)
checkpoint = restart_path(snakemake.params.restart, scene, snakemake.input)
forget_others(checkpoint)

with stage(snakemake, restart=checkpoint) as progress:

    def watch(increment):
        """Report an increment that has converged."""
        progress(increment.load, f"strain {increment.load * scene.load.strain:.2%}")

    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    history = dns.run(scene, mesh, knit, checkpoint=checkpoint, progress=watch)
    write_dataset(history, snakemake.output[0], scene)
