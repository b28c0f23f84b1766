"""Write the mesh of a simulation, its tied nodes in place, and their displacement at full load for ParaView."""

from dataclasses import replace

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.exchange.vtu import write_vtu
from knitstudy.files.netcdf import read_dataset
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.tie import tie_crossings
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    history = read_dataset(snakemake.input.history, ["node_displacement"])
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied_crossings(scene, specimen.crossings))
    tied = replace(mesh, nodes=tie.nodes)
    write_vtu(tied, snakemake.output[0], {"displacement": history["node_displacement"].to_numpy()})
