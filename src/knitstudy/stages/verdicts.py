"""The copy of the verdicts that is kept: what the full study found.

``python -m knitstudy.stages.verdicts`` keeps what the results of the study `full` say, as many as are there and up to
date (`make verdicts` makes all), with the digest behind it and the day, and writes the page about it with its pictures.
"""

from __future__ import annotations

import sys
from pathlib import Path

from knitstudy.errors import KnitstudyError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.files import replacing, write_table
from knitstudy.report.kept_pages import summarise
from knitstudy.stages.kept import RESULTS, Kept
from knitstudy.stages.pictures import draw_pictures
from knitstudy.stages.plan import Plan
from knitstudy.study.configuration import CONFIG

VERDICTS = Kept("full", "verdicts", Path("resources/verdicts.csv"), "Verdicts", "make verdicts")
"""What the report of every study shows beside its own verdicts."""

PAGE, TEMPLATE = Path("docs/results.md"), Path("workflow/report/results.md")


def keep(config: Path = CONFIG) -> None:
    """Keep the verdicts of the results that are there, and write the page about them.

    Raises
    ------
    KnitstudyError
        When there are no results, or a file of them cannot be read.
    """
    plan = Plan.of(config)
    table = VERDICTS.found(plan, RESULTS, config)
    displays = VERDICTS.displays(plan, VERDICTS.scenes_there(plan, RESULTS, config), config, FIGURES)
    page, shown = summarise(TEMPLATE, table, displays.names(), PAGE.stem)
    draw_pictures(displays, shown, RESULTS, PAGE.with_suffix(""))
    with replacing(PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")
    write_table(table, VERDICTS.path)


if __name__ == "__main__":
    try:
        keep()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(f"Verdicts: {VERDICTS.path.absolute()}, page: {PAGE.absolute()}")
