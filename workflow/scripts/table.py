"""Build a table from results and from what the paper prints."""

from pathlib import Path

from knitstudy.configuration import read_yaml
from knitstudy.io import read_dataset, read_table, write_table
from knitstudy.scene import Scene
from knitstudy.stage import stage
from knitstudy.tables.catalogue import build

READERS = {".nc": read_dataset, ".csv": read_table, ".yaml": lambda path: read_yaml(Path(path))}

with stage(snakemake):
    paths = {need: path for need, path in snakemake.input.items() if need != "code"}
    sources = {need: READERS[Path(path).suffix](path) for need, path in paths.items()}
    scenes = {fidelity: Scene.from_dict(keys) for fidelity, keys in snakemake.params.scenes.items()}
    write_table(build(snakemake.wildcards.table, **sources, scenes=scenes), snakemake.output[0])
