"""Draw a figure from the results that it needs."""

from knitstudy.datasets import seal
from knitstudy.knit.scene.scene import Scene
from knitstudy.paper.figures import draw
from knitstudy.paper.report import read_sources
from knitstudy.registry import load_plugins
from knitstudy.run.job import frame
from knitstudy.use.style import save

with frame(snakemake):
    load_plugins(snakemake.config.get("plugins", ()))
    sources = read_sources(snakemake.input.items())
    scenes = {role: Scene.from_dict(keys) for role, keys in snakemake.params.scenes.items()}
    figure = draw(snakemake.wildcards.figure, **sources, scenes=scenes)
    save(figure, snakemake.output, sources, snakemake.params.title)
    for path in snakemake.output:
        seal(path, snakemake.params.digest)
