"""All benchmarks of the book, or those that are named: `python examples/knots [name ...]`.

Writes resources/benchmarks.csv, a picture of each, and the table of docs/notes/knots.md. Rows of benchmarks that do
not run stay as they are.
"""

import re
import sys
import time
from importlib import import_module

import pandas as pd
from book import COLUMNS, ROOT, TABLE

from knitstudy.run.behaviour import ENDLESS_BEAMS, OF_BEAMS
from knitstudy.run.committed_tables import keep_table

BENCHMARKS = [
    "elastica", "ring", "frame", "writhing", "hertz", "sliding", "capstan", "clasp", "plectoneme", "overhand", "turns",
]  # fmt: skip
PAGE = ROOT / "docs" / "notes" / "knots.md"


def as_markdown(table):
    """Return lines of Markdown: of every quantity of a benchmark, the row with the largest error."""
    lines = [
        "| benchmark | quantity | points | largest error | at | known | here | mesh |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (benchmark, quantity), points in table.groupby(["benchmark", "quantity"], sort=False):
        row = points.loc[points.error.abs().idxmax()]
        mesh = "" if pd.isna(row.uncertainty) else f"{100 * row.uncertainty:.1f} %"
        error = f"{100 * row.error:+.1f} %"
        words = (
            benchmark,
            quantity,
            len(points),
            error,
            row.parameter,
            f"{row.known:.4g}",
            f"{row.here:.4g}",
        )
        lines.append("| " + " | ".join((*map(str, words), mesh)) + " |")
    return "\n".join(lines)


def run(names):
    """Run benchmarks by their names; write the table and the page."""
    begun = time.perf_counter()
    for number, name in enumerate(names, 1):
        print(f"{name}, {number} of {len(names)}, after {time.perf_counter() - begun:.0f} s", flush=True)
        rows = import_module(name).main(picture=name)
        table = pd.read_csv(TABLE) if TABLE.exists() else rows[:0]
        table = pd.concat([table[table.benchmark != rows.benchmark[0]], rows])
        table[COLUMNS[3:]] = table[COLUMNS[3:]].astype(float)
        keep_table(table, TABLE, "make knots", [OF_BEAMS, ENDLESS_BEAMS], digits=5)
        page = PAGE.read_text(encoding="utf-8")
        place = re.compile(r"(<!-- table by `make knots` -->\n).*?(\n<!-- end -->)", re.DOTALL)
        text = place.sub(lambda found: found[1] + as_markdown(table) + found[2], page)  # noqa: B023
        PAGE.write_text(text, encoding="utf-8")
    used = f"{time.process_time():.0f} s of a processor"
    print(
        f"{len(names)} benchmarks in {time.perf_counter() - begun:.0f} s, {used}: {TABLE.relative_to(ROOT)}"
    )


if __name__ == "__main__":
    unknown = set(sys.argv[1:]) - set(BENCHMARKS)
    if unknown:
        sys.exit(f"no benchmarks {sorted(unknown)}; there are {BENCHMARKS}")
    run(sys.argv[1:] or BENCHMARKS)
