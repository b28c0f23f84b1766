"""Write the tables of columns into files.md, from the library: ``python docs/reference/columns.py``.

``python docs/reference/columns.py contacts stresses geometry mesh rest`` prints tables that are not on the page,
and with ``history`` the points in contact, which the page leaves out.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from knitstudy.knit.geometry.columns import CONTACTS, GEOMETRY, HISTORY, MESH, REST, STRESSES, Columns

PAGE = Path(__file__).with_name("files.md")

TABLES = {"history": HISTORY}
"""On the page, by the name in the comments that a table stands between."""

PRINTED = {"contacts": CONTACTS, "stresses": STRESSES, "geometry": GEOMETRY, "mesh": MESH, "rest": REST}
"""Not on the page: variables of files say what they mean."""


def markdown(columns: Columns, points: bool = True) -> str:
    """Return the variables of a kind of file as a table, or all of them but those of points in contact."""
    rows = [
        f"| {row.Index} ({', '.join(row.dims.split())}){_unit(row.unit)} | {row.meaning}{_where(row.where)} |"
        for row in columns.table.itertuples()
        if points or row.dims.split()[:1] != ["point"]
    ]
    return "\n".join(["| variable (dims) [unit] | meaning |", "|---|---|", *rows]).replace(" ()", "")


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" [{unit}]"


def _where(models: str) -> str:
    return f" ({models})" if models else ""


def renewed(page: str) -> str:
    """Return the text of the page with its tables as the library has them.

    Raises
    ------
    ValueError
        If the page has no place for one of them.
    """
    for name, columns in TABLES.items():
        begin, end = (
            f"<!-- columns of {name}: python docs/reference/columns.py -->",
            f"<!-- end of columns of {name} -->",
        )
        place = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        if not place.search(page):
            raise ValueError(
                f"{PAGE.name} has no lines {begin!r} and {end!r}: put them where the table belongs"
            )
        table = f"{begin}\n\n{markdown(columns, points=False)}\n\n{end}"
        page = place.sub(lambda _, table=table: table, page)
    return page


if __name__ == "__main__":
    if sys.argv[1:]:
        print("\n\n".join(markdown((TABLES | PRINTED)[name]) for name in sys.argv[1:]))
    else:
        PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
