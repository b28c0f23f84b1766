"""Draw a figure from the results that it needs."""

from knitstudy.figures.catalogue import draw
from knitstudy.figures.style import save
from knitstudy.registry import load_plugins
from knitstudy.report.files import read_sources
from knitstudy.stages.script import frame
from knitstudy.study.scene import Scene

with frame(snakemake):
    load_plugins(snakemake.config.get("plugins", ()))
    sources = read_sources(snakemake.input.items())
    scenes = {role: Scene.from_dict(keys) for role, keys in snakemake.params.scenes.items()}
    figure = draw(snakemake.wildcards.figure, **sources, scenes=scenes)
    save(figure, snakemake.output, sources, snakemake.params.title)
