"""All benchmarks of the book, or those that are named: `python examples/knots [name ...]`.

Writes resources/benchmarks.csv and a picture of each; rows of benchmarks that do not run stay as they are.
"""

import sys
from importlib import import_module

import pandas as pd
from book import COLUMNS, TABLE

BENCHMARKS = [
    "elastica",
    "ring",
    "frame",
    "writhing",
    "hertz",
    "sliding",
    "capstan",
    "clasp",
    "plectoneme",
    "overhand",
]


def run(names):
    """Run benchmarks by their names and write the table."""
    for name in names:
        rows = import_module(name).main(picture=name)
        table = pd.read_csv(TABLE) if TABLE.exists() else rows[:0]
        table = pd.concat([table[table.benchmark != rows.benchmark[0]], rows])
        table[COLUMNS[3:]] = table[COLUMNS[3:]].astype(float)
        table.to_csv(TABLE, index=False, float_format="%.5g", lineterminator="\n")


if __name__ == "__main__":
    unknown = set(sys.argv[1:]) - set(BENCHMARKS)
    if unknown:
        sys.exit(f"no benchmarks {sorted(unknown)}; there are {BENCHMARKS}")
    run(sys.argv[1:] or BENCHMARKS)
