"""Write the mesh of a simulation, its tied nodes in place, and their displacement at full load for ParaView."""

from dataclasses import replace

from knitstudy.contact.tie import tie_crossings
from knitstudy.contact.tied_crossings import tied_crossings
from knitstudy.geometry.specimen import read_specimen
from knitstudy.io import read_dataset
from knitstudy.mesh.export import write_vtu
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    history = read_dataset(snakemake.input.history, ["node_displacement"])
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied_crossings(scene, specimen.crossings))
    tied = replace(mesh, nodes=tie.nodes)
    write_vtu(tied, snakemake.output[0], {"displacement": history["node_displacement"].to_numpy()})
