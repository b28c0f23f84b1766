"""Pull a knit of beams in contact with friction."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.pattern import Knit
from knitstudy.networks.beams.run import run
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake) as progress:
    scene = Scene.from_dict(snakemake.params.scene)

    def watch(increment):
        """Report an increment that has converged."""
        progress(increment.load, f"strain {increment.load * scene.load.strain:.2%}")

    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    write_dataset(run(scene, knit, watch), snakemake.output[0], scene)
