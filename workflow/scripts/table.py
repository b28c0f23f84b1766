"""Build a table from results and from what the paper prints."""

from knitstudy.datasets import seal, write_table
from knitstudy.knit.scene.scene import Scene
from knitstudy.paper.report import read_sources
from knitstudy.registry import load_plugins
from knitstudy.run.catalogue import TABLES
from knitstudy.run.job import frame

with frame(snakemake):
    load_plugins(snakemake.config.get("plugins", ()))
    sources = read_sources(snakemake.input.items())
    scenes = {role: Scene.from_dict(keys) for role, keys in snakemake.params.scenes.items()}
    write_table(TABLES.make(snakemake.wildcards.table, **sources, scenes=scenes), snakemake.output[0])
    seal(snakemake.output[0], snakemake.params.digest)
