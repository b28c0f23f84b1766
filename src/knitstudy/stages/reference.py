"""The copy of the reference that is kept: which code it was made by, and whether that is the code of today.

``python -m knitstudy.stages.reference`` keeps the table that the study `reference` has made (`make reference`).
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Iterable
from pathlib import Path

from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.files.csv_table import read_table, write_table
from knitstudy.measures.selection import ways
from knitstudy.stages.code import code_digest
from knitstudy.stages.table import STAGES, stage_of
from knitstudy.study.configuration import CONFIG, load_scenes, load_study
from knitstudy.study.scene import Scene

MADE, KEPT = Path("results/tables/reference.csv"), Path("resources/reference/reference.csv")
"""What the study makes, and what models are measured against."""

BESIDE = ("geometry", "mesh", "contacts")
"""Stages whose results the reference is made from besides histories."""


def code_behind(scenes: Iterable[Scene]) -> str:
    """Return a digest of the code of all simulations among scenes that the reference is made from."""
    modules = {"knitstudy.tables.reference"}
    for scene in ways(scenes):
        stages = [stage_of(scene), *(STAGES.find(name) for name in BESIDE)]
        for stage in stages:
            modules |= {stage.module, *stage.code(scene)}
    return code_digest(*sorted(modules))


def code_of_study(config: Path = CONFIG) -> str:
    """Return that digest of the study `reference` of a configuration folder."""
    scenes = load_scenes(config)
    return code_behind(scenes[name] for name in load_study("reference", config))


def keep(made: Path, kept: Path, code: str) -> None:
    """Copy the table of the reference, with the digest of the code behind it and the day in every row.

    Raises
    ------
    DataFileError
        When there is no such table, or it is empty.
    """
    table = read_table(made)
    if table.empty:
        raise DataFileError(
            f"{made}: has no rows; the study must have two discretisations of a problem or more"
        )
    write_table(table.assign(code=code, made=datetime.date.today().isoformat()), kept)


def warning(kept: Path, code: str) -> str:
    """Return what is to be said of a kept copy whose code is not that of today; nothing where it is."""
    table = read_table(kept, needs=("code", "made"))
    found = sorted(set(table["code"].astype(str)))
    if found == [code]:
        return ""
    return (
        f"The reference of {', '.join(sorted(set(table['made'].astype(str))))} was made by code "
        f"{', '.join(found)}, which is now {code}: `make reference` makes it anew."
    )


if __name__ == "__main__":
    try:
        keep(MADE, KEPT, code_of_study())
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(f"Reference: {KEPT.absolute()}")
