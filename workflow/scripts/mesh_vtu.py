"""Write a mesh for ParaView."""

from knitstudy.exchange.vtu import write_vtu
from knitstudy.files.netcdf import read_dataset
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.stages.script import stage

with stage(snakemake):
    write_vtu(SweptMesh.from_dataset(read_dataset(snakemake.input.mesh)), snakemake.output[0])
