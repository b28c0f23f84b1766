"""From the knit's centrelines to hexahedra."""

from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_dataset, write_dataset
from knitstudy.mesh.knit import mesh_knit
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    mesh = mesh_knit(knit, scene.mesh.size, scene.mesh.growth)
    write_dataset(mesh.to_dataset(), snakemake.output[0], scene)
