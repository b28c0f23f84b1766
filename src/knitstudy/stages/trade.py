"""The copy of the trade that is kept: what accuracy costs, and how price grows with the size of a knit.

``python -m knitstudy.stages.trade`` keeps what the results of the study `trade` say, as many as are there and up to
date (`make trade` makes all), with the digest behind it and the day. Scenes that ask for an accuracy are planned by it
(`knitstudy.study.choice`).
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd

from knitstudy.errors import KnitstudyError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.files import read_table, replacing, write_table
from knitstudy.report.kept_pages import filled, written
from knitstudy.stages.kept import RESULTS, Kept
from knitstudy.stages.pictures import draw_pictures
from knitstudy.stages.plan import Plan
from knitstudy.study.choice import GROWTH_KEPT, RESOURCES, TRADE_KEPT
from knitstudy.study.configuration import CONFIG

READ = ("simulation", "contacts")
"""Stages that they are made from."""

TRADE = Kept("trade", "trade", TRADE_KEPT, "Prices and errors", "make trade", READ)

GROWTH = Kept("full", "domain_growth", GROWTH_KEPT, "Laws of growth", "make trade", READ)
"""How cost grows with the size of the domain, of as many knits of rising size as are there."""

PROMISES_KEPT = RESOURCES / "trade_promise.csv"
"""Of `knitstudy.stages.promise`."""

PAGE = Path("docs/accuracy.md")

PICTURES = "fig_trade_"
"""What names of its figures begin with."""


def keep(config: Path = CONFIG) -> pd.DataFrame:
    """Keep the trade of the results that are there, and the laws by which price grows; return the trade.

    Raises
    ------
    KnitstudyError
        When there are no results, or a file of them cannot be read.
    """
    plan = Plan.of(config)
    table = TRADE.found(plan, RESULTS, config)
    write_table(table, TRADE.path)
    write_table(GROWTH.found(plan, RESULTS, config), GROWTH.path)
    write_page(table)
    displays = TRADE.displays(plan, TRADE.scenes_there(plan, RESULTS, config), config, FIGURES)
    shown = [name for name in displays.names() if name.startswith(PICTURES)]
    draw_pictures(displays, shown, RESULTS, PAGE.with_suffix(""))
    return table


def write_page(table: pd.DataFrame) -> None:
    """Write what a trade says into the page about it, with kept promises and the pictures that are drawn."""
    promises = read_table(PROMISES_KEPT) if PROMISES_KEPT.is_file() else None
    page = filled(PAGE.read_text(encoding="utf-8"), written(table, promises))
    with replacing(PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    try:
        kept = keep()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(f"{len(kept)} points of {kept['scene'].nunique()} simulations: {TRADE.path}")
