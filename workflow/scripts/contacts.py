"""Find what acts at every crossing of solid yarns."""

from knitstudy.crossings import contacts
from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.specimen import read_specimen
from knitstudy.stages.script import stage
from knitstudy.study.scene import Scene

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    specimen = read_specimen(read_dataset(snakemake.input.knit))
    history = read_dataset(snakemake.input.history)
    write_dataset(contacts.extract(specimen, history), snakemake.output[0], scene)
