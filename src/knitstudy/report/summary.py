"""What holds of the paper and what does not, for people who have read it: Markdown, with pictures beside it."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import jinja2
import pandas as pd

from knitstudy.figures.catalogue import FIGURES


def summarise(
    template: Path, verdicts: pd.DataFrame, drawn: Collection[str], folder: str
) -> tuple[str, list[str]]:
    """Return the page, and the figures that it shows.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page. ``claims(letters)`` gives it the claims whose ids begin with one of some letters,
        ``picture(name)`` a figure, or nothing where that is not drawn.
    verdicts : DataFrame
        As they are kept, with the day ``made`` and how many ``simulations`` of the study they stand on.
    drawn : collection of str
        Names of figures.
    folder : str
        Where the page's pictures lie, from the page.
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
