"""Write a scene as an input deck of another finite-element program."""

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.exchange.deck import specimen_deck
from knitstudy.exchange.inp import write_inp
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
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied_crossings(scene, specimen.crossings))
    deck = specimen_deck(scene, specimen, mesh, tie)
    write_inp(deck, snakemake.output[0], snakemake.wildcards.dialect)
