"""Pull a reduced order model whose joints come from the contacts of a knit of solid yarns."""

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.pattern import Knit
from knitstudy.networks.rom.run import run
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    contacts = read_dataset(snakemake.input.contacts)
    springs = read_dataset(snakemake.input.springs) if scene.rom.springs_from else None
    write_dataset(run(scene, knit, contacts, springs), snakemake.output[0], scene)
