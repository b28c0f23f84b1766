"""Draw knits, measure a model on one of them, or collect errors and prices: which, says the name of the rule."""

import json
from pathlib import Path

from knitstudy.files import read_table, write_table, write_text
from knitstudy.stages import trade
from knitstudy.stages.script import frame
from knitstudy.study.configuration import drawn_defaults
from knitstudy.study.sample import load_trade


def measured(knit, label, rung):
    """Return the record of a knit of the sample by a rung."""
    declared = load_trade()
    (case,) = (case for case in declared.cases() if str(case) == label)
    inputs = trade.knits_of(read_table(snakemake.input[0]))[knit]
    problem = declared.scene(case, inputs, drawn_defaults(), f"{knit}-{label}")
    keys = declared.rungs_of(case)[rung]
    about = {"knit": knit, "case": label}
    return about | trade.run(problem, rung, keys, declared.limit, trade.FOLDER)


with frame(snakemake):
    if snakemake.rule == "knits":
        write_table(trade.sampled(load_trade()), snakemake.output[0])
    elif snakemake.rule == "rung":
        write_text(json.dumps(measured(*snakemake.wildcards)), Path(snakemake.output[0]))
    else:
        knits = trade.knits_of(read_table(snakemake.input.knits))
        write_table(trade.collect(snakemake.input.records, knits), snakemake.output[0])
