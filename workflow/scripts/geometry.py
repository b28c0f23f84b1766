"""From the keys of a scene to the optimised knit, or to a pair of crossing yarns."""

from knitstudy.files.netcdf import write_dataset
from knitstudy.geometry.build import build
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    write_dataset(build(scene), snakemake.output[0], scene)
