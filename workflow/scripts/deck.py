"""Write a scene as an input deck of another finite-element program."""

from knitstudy.contact.tie import tie_crossings
from knitstudy.contact.tied_crossings import tied_crossings
from knitstudy.geometry.specimen import read_specimen
from knitstudy.io import read_dataset
from knitstudy.mesh.deck import specimen_deck
from knitstudy.mesh.inp import write_inp
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    mesh = SweptMesh.from_dataset(read_dataset(snakemake.input.mesh))
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied_crossings(scene, specimen.crossings))
    deck = specimen_deck(scene, specimen, mesh, tie)
    write_inp(deck, snakemake.output[0], snakemake.wildcards.dialect)
