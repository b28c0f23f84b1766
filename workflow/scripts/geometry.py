"""From the keys of a scene to the optimised knit, or to a pair of crossing yarns."""

from knitstudy.geometry.build import build
from knitstudy.io import write_dataset
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    write_dataset(build(scene), snakemake.output[0], scene)
