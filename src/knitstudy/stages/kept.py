"""Tables of studies that take hours, kept with the digest of what is behind them."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.files import read_table
from knitstudy.measures.catalogue import Catalogue
from knitstudy.report.files import read_sources
from knitstudy.stages.displays import Displays, reference_files
from knitstudy.stages.plan import Plan
from knitstudy.study.configuration import CONFIG, load_study
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES, tabulate

RESULTS = Path("results")


@dataclass(frozen=True)
class Kept:
    """A table of a study, as it is kept.

    Attributes
    ----------
    study, table : str
    path : Path
        Where it is kept.
    what : str
        What messages call its rows, in the plural.
    command : str
        What makes it anew.
    stages : tuple of str
        Those whose results a scene must have to count; nothing for all.
    """

    study: str
    table: str
    path: Path
    what: str
    command: str
    stages: tuple[str, ...] = ()

    def displays(
        self, plan: Plan, scenes: Iterable[Scene], config: Path = CONFIG, catalogue: Catalogue = TABLES
    ) -> Displays:
        """Return the tables, or the figures, of the study, or of some of its scenes."""
        return Displays(catalogue, plan, scenes, reference_files(config), label=f"study {self.study!r}")

    def digest_wanted(self, plan: Plan, config: Path = CONFIG) -> str:
        """Return the digest of the table of the whole study with the code of today, none where it cannot be made."""
        displays = self.displays(plan, self._scenes(plan, config), config)
        return displays.digest(self.table) if self.table in displays.names() else ""

    def scenes_there(self, plan: Plan, results: Path, config: Path = CONFIG) -> list[Scene]:
        """Return those scenes of the study whose results are there and up to date.

        Raises
        ------
        DataFileError
            When there is none.
        """
        scenes = up_to_date(plan, self._scenes(plan, config), results, self.stages)
        if not scenes:
            raise DataFileError(
                f"{results}: has no simulation of the study {self.study!r} that is up to date; "
                f"run `make study STUDY={self.study}`"
            )
        return scenes

    def found(self, plan: Plan, results: Path, config: Path = CONFIG) -> pd.DataFrame:
        """Return the table by those scenes of the study whose results are there and up to date.

        Raises
        ------
        DataFileError
            When there is none.
        """
        scenes = self.scenes_there(plan, results, config)
        displays = self.displays(plan, scenes, config)
        sources = read_sources(displays.files(self.table, results).items())
        table = tabulate(self.table, **sources, scenes=displays.scenes(self.table))
        simulations = f"{len(scenes)} of {len(self._scenes(plan, config))}"
        return stamped(table, displays.digest(self.table), simulations=simulations)

    def warning(self, kept: Path, wanted: str) -> str:
        """Return what is to be said of a kept table that today's need not be; nothing where they are the same."""
        days = made_otherwise(kept, wanted)
        return days and (
            f"{self.what} of the study {self.study!r} were kept on {days}; "
            f"code or scenes have changed since, or not all had been run: `{self.command}` makes them anew."
        )

    def _scenes(self, plan: Plan, config: Path) -> list[Scene]:
        return [plan.scenes[name] for name in load_study(self.study, config)]


def up_to_date(
    plan: Plan, scenes: Iterable[Scene], results: Path, stages: tuple[str, ...] = ()
) -> list[Scene]:
    """Return those scenes whose data are there and up to date, of all stages or of some."""
    return [
        scene
        for scene in scenes
        if all(
            plan.is_up_to_date(stage, of, results)
            for stage, of in plan.steps([scene])
            if stage.path_pattern.endswith(".nc") and (not stages or stage.name in stages)
        )
    ]


def stamped(table: pd.DataFrame, digest: str, **said: str) -> pd.DataFrame:
    """Return a table with the digest behind it, what else is to be said of all of it, and the day."""
    return table.assign(digest=digest, **said, made=datetime.date.today().isoformat())


def made_otherwise(kept: Path, wanted: str) -> str:
    """Return the days on which a kept table was made by other code or inputs; nothing where it was by these.

    Raises
    ------
    DataFileError
        When the table cannot be read, or does not say what it was made by.
    """
    table = read_table(kept, needs=("digest", "made"))
    if set(table["digest"].astype(str)) == {wanted}:
        return ""
    return ", ".join(sorted(set(table["made"].astype(str))))
