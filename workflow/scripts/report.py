"""Write the report: one HTML page with all figures and tables."""

from pathlib import Path

from knitstudy.configuration import read_yaml
from knitstudy.io import read_table, replacing
from knitstudy.report.origin import origins
from knitstudy.report.page import render
from knitstudy.stage import stage

with stage(snakemake):
    page = render(
        template=Path(snakemake.input.template),
        captions=read_yaml(Path(snakemake.input.captions)),
        pictures=[Path(path) for path in snakemake.input.figures],
        results={Path(path).stem: read_table(path) for path in snakemake.input.tables},
        provenance=origins(snakemake.input.data, snakemake.output[0]),
        study=snakemake.params.study,
    )
    with replacing(snakemake.output[0]) as temporary:
        temporary.write_text(page, encoding="utf-8")
