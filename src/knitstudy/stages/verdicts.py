"""The copy of the verdicts that is kept: what the full study found, for everyone who has not the hours to run it.

``python -m knitstudy.stages.verdicts`` keeps what the results of the study `full` say, as many as are there and up to
date (`make verdicts` makes all), with the digest behind it and the day, and writes the page about it with its pictures.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.files.csv_table import read_table, write_table
from knitstudy.files.replacing import replacing
from knitstudy.report.screen import save_for_screen
from knitstudy.report.sources import read_sources
from knitstudy.report.summary import summarise
from knitstudy.stages.displays import Displays, reference_files
from knitstudy.stages.plan import Plan
from knitstudy.study.configuration import CONFIG, load_study
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES, tabulate

STUDY, TABLE = "full", "verdicts"
RESULTS = Path("results")
KEPT = Path("resources/verdicts.csv")
"""What the report of every study shows beside its own verdicts."""

PAGE, TEMPLATE = Path("docs/results.md"), Path("workflow/report/results.md")


def displays_of(plan: Plan, scenes: Iterable[Scene], config: Path = CONFIG) -> Displays:
    """Return the tables of the study `full`, or of some of its scenes."""
    return Displays(TABLES, plan, scenes, reference_files(config), label=f"study {STUDY!r}")


def digest_wanted(plan: Plan, config: Path = CONFIG) -> str:
    """Return the digest of the verdicts of the whole study with the code of today, none where it cannot be judged."""
    displays = displays_of(plan, _study(plan, config), config)
    return displays.digest(TABLE) if TABLE in displays.names() else ""


def found(plan: Plan, results: Path, config: Path = CONFIG) -> pd.DataFrame:
    """Return the verdicts by those scenes of the study whose results are there and up to date.

    Raises
    ------
    DataFileError
        When there is none.
    """
    study = _study(plan, config)
    scenes = [scene for scene in study if _is_there(plan, scene, results)]
    if not scenes:
        raise DataFileError(
            f"{results}: has no simulation of the study {STUDY!r} that is up to date; run `make study STUDY={STUDY}`"
        )
    displays = displays_of(plan, scenes, config)
    sources = read_sources(displays.files(TABLE, results).items())
    table = tabulate(TABLE, **sources, scenes=displays.scenes(TABLE))
    return table.assign(
        digest=displays.digest(TABLE),
        simulations=f"{len(scenes)} of {len(study)}",
        made=datetime.date.today().isoformat(),
    )


def warning(kept: Path, wanted: str) -> str:
    """Return what is to be said of kept verdicts that those of today need not be; nothing where they are the same."""
    table = read_table(kept, needs=("digest", "made"))
    if set(table["digest"].astype(str)) == {wanted}:
        return ""
    return (
        f"Verdicts of the study {STUDY!r} were kept on {', '.join(sorted(set(table['made'].astype(str))))}; code or "
        f"scenes have changed since, or not all had been run: `make verdicts` makes them anew."
    )


def keep(config: Path = CONFIG) -> None:
    """Keep the verdicts of the results that are there, and write the page about them.

    Raises
    ------
    KnitstudyError
        When there are no results, or a file of them cannot be read.
    """
    table = found(Plan.of(config), RESULTS, config)
    drawn = {path.stem: path for path in (RESULTS / "figures").glob("*.png")}
    page, shown = summarise(TEMPLATE, table, drawn, PAGE.stem)
    for name in shown:
        save_for_screen(drawn[name], PAGE.with_suffix("") / f"{name}.webp")
    with replacing(PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")
    write_table(table, KEPT)


def _study(plan: Plan, config: Path) -> list[Scene]:
    return [plan.scenes[name] for name in load_study(STUDY, config)]


def _is_there(plan: Plan, scene: Scene, results: Path) -> bool:
    """Whether all data of a scene are there and up to date."""
    data = (step for step in plan.steps([scene]) if step[0].leaves.endswith(".nc"))
    return all(plan.is_up_to_date(*step, results) for step in data)


if __name__ == "__main__":
    try:
        keep()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(f"Verdicts: {KEPT.absolute()}, page: {PAGE.absolute()}")
