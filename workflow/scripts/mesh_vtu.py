"""Write a mesh for ParaView."""

from knitstudy.io import read_dataset
from knitstudy.mesh.export import write_vtu
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.stage import stage

with stage(snakemake):
    write_vtu(SweptMesh.from_dataset(read_dataset(snakemake.input.mesh)), snakemake.output[0])
