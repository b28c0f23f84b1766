"""Draw a figure from the results that it needs."""

from knitstudy.figures.catalogue import draw
from knitstudy.figures.saving import save
from knitstudy.io import read_dataset
from knitstudy.stage import stage

with stage(snakemake):
    paths = {need: path for need, path in snakemake.input.items() if need != "code"}
    sources = {need: read_dataset(path) for need, path in paths.items()}
    figure = draw(snakemake.wildcards.figure, **sources)
    save(figure, snakemake.output, sources, snakemake.params.title)
