"""Collect the rows of the campaign of extremes in one table."""

from knitstudy.files import write_table
from knitstudy.stages.extremes import collect
from knitstudy.stages.script import frame

with frame(snakemake):
    write_table(collect(snakemake.input), snakemake.output[0])
