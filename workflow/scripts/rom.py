"""Pull a reduced order model whose joints come from the contacts of a knit of solid yarns."""

from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_dataset, write_dataset
from knitstudy.rom.run import run
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    contacts = read_dataset(snakemake.input.contacts)
    springs = read_dataset(snakemake.input.springs) if scene.rom.springs_from else None
    write_dataset(run(scene, knit, contacts, springs), snakemake.output[0], scene)
