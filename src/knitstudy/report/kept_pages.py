"""The page of kept verdicts on the claims of the paper, in Markdown."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import jinja2
import pandas as pd
from jinja2.sandbox import ImmutableSandboxedEnvironment

from knitstudy.figures.catalogue import FIGURES


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

    environment = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = environment.from_string(template.read_text(encoding="utf-8")).render(
        picture=picture,
        claims=lambda letters: [row for row in rows if row["id"][0] in letters],
        verdicts=rows,
        readings=readings[readings["kind"] == "reading"].fillna("").to_dict("records"),
        made=rows[0]["made"],
        simulations=rows[0]["simulations"],
    )
    return page, shown
