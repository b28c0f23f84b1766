"""Write the report: one HTML page with all figures and tables."""

from pathlib import Path

from knitstudy.datasets import read_table, seal
from knitstudy.files import write_text
from knitstudy.knit.scene.documents import read_yaml
from knitstudy.paper.report import origins, render, turning_knit
from knitstudy.registry import load_plugins
from knitstudy.run.committed_tables import with_runs
from knitstudy.run.job import frame

with frame(snakemake):
    load_plugins(snakemake.config.get("plugins", ()))
    captions = read_yaml(Path(snakemake.input.captions))
    page = render(
        template=Path(snakemake.input.template),
        captions=captions,
        pictures=[Path(path) for path in snakemake.input.figures],
        results={Path(path).stem: read_table(path) for path in snakemake.input.tables},
        provenance=origins(snakemake.input.data, snakemake.output[0]),
        study=snakemake.params.study,
        notes=snakemake.params.notes,
        kept=with_runs(Path(snakemake.input.kept)),
        full=Path(snakemake.input.full[0]).parent,
        turning=turning_knit(captions["opening"]["turns"], map(Path, snakemake.input.data)),
        page=Path(snakemake.output[0]),
    )
    write_text(page, snakemake.output[0])
    seal(snakemake.output[0], snakemake.params.digest)
