"""Find what acts at every crossing of a knit of solid yarns."""

from knitstudy import contacts
from knitstudy.geometry.pattern import Knit
from knitstudy.io import read_dataset, write_dataset
from knitstudy.scene import Scene
from knitstudy.stage import stage

with stage(snakemake):
    scene = Scene.from_dict(snakemake.params.scene)
    knit = Knit.from_dataset(read_dataset(snakemake.input.knit))
    history = read_dataset(snakemake.input.history)
    write_dataset(contacts.extract(knit, history), snakemake.output[0], scene)
