"""Pages of kept results: verdicts on the claims of the paper, and accuracy against cost."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import jinja2
import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.measures.promises import BAR, DEAREST
from knitstudy.measures.trade import rungs
from knitstudy.study.choice import digits
from knitstudy.tables.trade import AT_MOST, CALLED, CASE, MEMORY, SECONDS, knobs, sentences


def summarise(
    template: Path, verdicts: pd.DataFrame, drawn: Collection[str], folder: str
) -> tuple[str, list[str]]:
    """Return the page of verdicts in Markdown, and the figures that it shows.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page. ``claims(letters)`` gives it the claims whose ids begin with one of some letters,
        ``picture(name)`` a figure, or nothing where that is not drawn.
    verdicts : DataFrame
        The kept verdicts, with the day ``made`` and the number of ``simulations`` behind them.
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

    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string(template.read_text(encoding="utf-8")).render(
        picture=picture,
        claims=lambda letters: [row for row in rows if row["id"][0] in letters],
        verdicts=rows,
        made=rows[0]["made"],
        simulations=rows[0]["simulations"],
    )
    return page, shown


# ---- the part of docs/accuracy.md that is written from the kept table of accuracy and cost ----

BEGIN, END = "<!-- what the kept trade says: make trade -->", "<!-- end of what the kept trade says -->"

SLOWER = "seconds over the main model's [1]"
MIXED = "unseen-mixed-"  # what names of knits with several inputs changed at once begin with


def insert_between_marks(page: str, text: str) -> str:
    """Return a page with a text between its marks; DataFileError when it has no marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise DataFileError(f"docs/accuracy.md: must have the lines {BEGIN!r} and {END!r}")
    return f"{before}{BEGIN}\n\n{text.strip()}\n\n{END}{after}"


def trade_summary(table: pd.DataFrame, promises: pd.DataFrame | None = None) -> str:
    """Return sentences, rungs, knobs and promises of a kept trade in Markdown.

    Parameters
    ----------
    table : DataFrame
        The kept table of `tables.trade.tabulate`.
    promises : DataFrame, optional
        The table of `stages.promise`.
    """
    table = table.assign(varied=table["varied"].fillna(""), to=table["to"].fillna(""))
    parts = [
        f"{len(table)} points of {table['scene'].nunique()} simulations ({table['simulations'].iloc[0]} of the study), "
        f"made on {table['made'].iloc[0]}.",
        "### What to take\n\n" + _sentences(table),
        "### Rungs\n\n" + _rungs(table),
        "### Knobs\n\n" + _knobs(table),
    ]
    if promises is not None and len(promises):
        parts.append("### On other knits\n\n" + _promises(promises))
    return "\n\n".join(parts)


def _sentences(table: pd.DataFrame) -> str:
    """Return sentences by case: for each model its tightest accuracy, of failures the loosest."""
    said = sentences(table)
    lines = []
    for case, rows in said.groupby(["cells [1]", "interaction", "direction"], sort=False):
        kept = []
        for _, of in rows.groupby("question", sort=False):
            reached = of[of[AT_MOST] <= of["accuracy [1]"]]
            kept += list(reached.drop_duplicates("scene", keep="last")["sentence"])
            kept += list(of[of[AT_MOST] > of["accuracy [1]"]]["sentence"][:1])
        cells, interaction, direction = case
        lines.append(f"**{cells} cells, {interaction}, {direction} tension.** " + " ".join(kept))
    return "\n\n".join(lines)


def _rungs(table: pd.DataFrame) -> str:
    rows = ["| question | case | points | on the front | cheapest | surest | lacks |", "| --- " * 7 + "|"]
    for (question, interaction, direction, cells), points in table.groupby(CASE, sort=False):
        on = points[points["on the front"]]
        cheap, sure = on.loc[on[SECONDS].idxmin()], on.loc[on[AT_MOST].idxmin()]
        lacks = [name for name, there in rungs(on[SECONDS], on[AT_MOST]).items() if not there]
        rows.append(
            f"| {question} | {cells}, {interaction}, {direction} | {len(points)} | {len(on)} | "
            f"{digits(cheap[SECONDS])} s: {digits(100 * cheap[AT_MOST])} %, {cheap[CALLED]} | "
            f"{digits(100 * sure[AT_MOST])} %: {digits(sure[SECONDS])} s, {digits(sure[MEMORY])} MB, {sure[CALLED]} | "
            f"{', '.join(lacks) or '-'} |"
        )
    return "\n".join(rows)


def _knobs(table: pd.DataFrame) -> str:
    rows = [
        "| model | interaction | knob | points | largest change of an error | time over the main model's | |",
        "| --- " * 7 + "|",
    ]
    for knob in knobs(table).to_dict("records"):
        rows.append(
            f"| {knob['model']} | {knob['interaction']} | `{knob['varied']}` {knob['to']} | {knob['points [1]']} | "
            f"{digits(100 * knob['largest change of an error [1]'])} % | "
            f"{digits(knob[SLOWER])} | {knob['verdict']} |"
        )
    return "\n".join(rows)


def _promises(table: pd.DataFrame) -> str:
    rows = ["| question, accuracy | interaction | promises | held | surely | dearest |", "| --- " * 6 + "|"]
    dear = table["seconds [s]"] / table["seconds of the cheapest that would have done [s]"]
    for case, found in table.assign(dear=dear).groupby(
        ["question", "accuracy [1]", "interaction"], sort=False
    ):
        question, accuracy, interaction = case
        rows.append(
            f"| {question}, {100 * accuracy:g} % | {interaction} | {len(found)} | {int(found['held'].sum())} | "
            f"{int((found['surely held'].astype(str) == 'True').sum())} | {digits(found['dear'].max())} |"
        )
    held, other = table.groupby("scene")["held"].all(), table[table["of another model [1]"]]
    rows.append(
        f"\nOf {len(held)} knits {int(held.sum())} kept every promise, and {_kept(table)} promises held "
        f"(bar: {100 * BAR:g} %); of those by another model than that which the truth is drawn from {_kept(other)}, "
        f"and {_kept(table[table['scene'].str.startswith(MIXED)])} of knits with several inputs changed at once. "
        f"{int((dear > DEAREST).sum())} cost more than {DEAREST:g} times the cheapest rung that would have done, "
        f"the dearest {digits(dear.max())} times (bar: {DEAREST:g})."
    )
    return "\n".join(rows)


def _kept(table: pd.DataFrame) -> str:
    return f"{int(table['held'].sum())} of {len(table)}"
