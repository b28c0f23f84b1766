"""From the centrelines of a specimen to hexahedra."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.specimen import mesh_specimen
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = mesh_specimen(specimen, scene.mesh.size, scene.mesh.growth)
    write_dataset(mesh.to_dataset(), snakemake.output[0], scene)
