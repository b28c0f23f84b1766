"""Pages of kept results in Markdown: verdicts on the claims of the paper, and accuracy against cost."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.measures.promises import BAR, DEAREST
from knitstudy.measures.trade import rungs
from knitstudy.study.choice import digits
from knitstudy.tables.trade import AT_MOST, CALLED, CASE, MEMORY, SECONDS, knobs, sentences

# Around the part of docs/accuracy.md that is written from the kept table of accuracy and cost.
BEGIN, END = "<!-- what the kept trade says: make trade -->", "<!-- end of what the kept trade says -->"


def summarise(
    template: Path, verdicts: pd.DataFrame, readings: pd.DataFrame, drawn: Collection[str], folder: str
) -> tuple[str, list[str]]:
    """Return the page of verdicts, and the figures that it shows.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page. ``claims(letters)`` gives it the claims whose ids begin with one of some letters,
        ``picture(name)`` a figure, or nothing where that is not drawn.
    verdicts : DataFrame
        The kept verdicts, with the day ``made`` and the number of ``simulations`` behind them.
    readings : DataFrame
        Readings of the paper and values of inputs, ``resources/reference/readings.csv``.
    drawn : collection of str
        Names of figures.
    folder : str
        Folder of the pictures, from the page.
    """
    shown: list[str] = []
    rows = verdicts.fillna("").to_dict("records")

    def picture(name: str) -> str:
        title = FIGURES.find(name).title
        if name not in drawn:
            return ""
        shown.append(name)
        return f"![{title}]({folder}/{name}.webp)\n\n*{title}*"

    page = _filled(
        template,
        picture=picture,
        claims=lambda letters: [row for row in rows if row["id"][0] in letters],
        verdicts=rows,
        readings=readings[readings["kind"] == "reading"].fillna("").to_dict("records"),
        made=rows[0]["made"],
        simulations=rows[0]["simulations"],
    )
    return page, shown


def _filled(template: Path, **said: Any) -> str:
    """Return the text of a template with its blanks filled."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(template.read_text(encoding="utf-8")).render(**said)


def insert_between_marks(page: str, text: str) -> str:
    """Return a page with a text between its marks; DataFileError when it has no marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise DataFileError(f"docs/accuracy.md: must have the lines {BEGIN!r} and {END!r}")
    return f"{before}{BEGIN}\n\n{text.strip()}\n\n{END}{after}"


def trade_summary(template: Path, table: pd.DataFrame, promises: pd.DataFrame | None = None) -> str:
    """Return sentences, rungs, knobs and promises of a kept trade.

    Parameters
    ----------
    template : Path
        Jinja2 template of the text.
    table : DataFrame
        The kept table of `tables.trade.tabulate`.
    promises : DataFrame, optional
        The table of `stages.promise`.
    """
    table = table.assign(varied=table["varied"].fillna(""), to=table["to"].fillna(""))
    if promises is not None:
        dear = promises["seconds [s]"] / promises["seconds of the cheapest that would have done [s]"]
        promises = promises.assign(dear=dear)
    columns = {"seconds": SECONDS, "at_most": AT_MOST, "memory": MEMORY, "called": CALLED, "case": CASE}
    return _filled(
        template,
        table=table,
        promises=promises,
        sentences=_by_case(sentences(table)),
        knobs=knobs(table).to_dict("records"),
        rungs=rungs,
        digits=digits,
        bar=BAR,
        dearest=DEAREST,
        **columns,
    )


def _by_case(said: pd.DataFrame) -> list[tuple]:
    """Return case and sentences: for each model its tightest accuracy, of failures the loosest."""
    found = []
    for case, rows in said.groupby(["cells [1]", "interaction", "direction"], sort=False):
        kept = []
        for _, of in rows.groupby("question", sort=False):
            holds = of[AT_MOST] <= of["accuracy [1]"]
            kept += list(of[holds].drop_duplicates("scene", keep="last")["sentence"])
            kept += list(of[of[AT_MOST] > of["accuracy [1]"]]["sentence"][:1])
        found.append((*case, kept))
    return found
