"""Pull a knit of beams in contact with friction."""

from knitstudy.beams.run import run
from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_dataset, write_dataset
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake) as progress:
    scene = Scene.from_dict(snakemake.params.scene)

    def watch(increment):
        """Report an increment that has converged."""
        progress(increment.load, f"strain {increment.load * scene.load.strain:.2%}")

    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    write_dataset(run(scene, knit, watch), snakemake.output[0], scene)
