"""The copy of the reference that is kept: what it stands on, which code it was made by, and whether that is today's.

``python -m knitstudy.stages.reference`` keeps what the simulations of the study `reference` have found, as many as are
there (`make reference` makes all), and the limits that they tend to with those kept before.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.files import read_dataset, read_table, write_table
from knitstudy.measures.reference import refinement_series_of
from knitstudy.measures.selection import ways
from knitstudy.stages.code import code_digest
from knitstudy.stages.plan import Plan
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import CONFIG, load_scenes, load_study
from knitstudy.study.scene import Scene
from knitstudy.tables.reference import limits, values_of

RESULTS = Path("results")
KEPT = Path("resources/reference/reference.csv")
"""What models are measured against."""

BESIDE = ("geometry", "mesh", "contacts")
"""Stages whose results the reference is made from besides histories."""

SEPARATOR = " "
"""Between the digests of codes that made what one row stands on."""


def values_beside(kept: Path) -> Path:
    """Return where the values of single simulations are kept that a reference stands on."""
    return kept.with_name(f"{kept.stem}_values.csv")


def code_behind(scenes: Iterable[Scene]) -> str:
    """Return a digest of the code of all simulations among scenes that the reference is made from."""
    modules = {"knitstudy.tables.reference"}
    for scene in ways(scenes):
        stages = [STAGES["simulation"], *(STAGES[name] for name in BESIDE)]
        for stage in stages:
            modules |= set(stage.modules(scene))
    return code_digest(*sorted(modules))


def study_of(config: Path = CONFIG) -> dict[str, Scene]:
    """Return the scenes of the study `reference` of a configuration folder."""
    scenes = load_scenes(config)
    return {name: scenes[name] for name in load_study("reference", config)}


def found(scenes: Mapping[str, Scene], results: Path, config: Path = CONFIG) -> pd.DataFrame:
    """Return the values of those simulations among scenes whose results are there and up to date."""
    plan, histories, contacts = Plan.of(config), {}, {}
    for name, scene in scenes.items():
        steps = STAGES["simulation"], STAGES["contacts"]
        if all(plan.is_up_to_date(stage, scene, results) for stage in steps):
            histories[name], contacts[name] = (read_dataset(results / stage.path(scene)) for stage in steps)
    return values_of(histories, contacts)


def keep(values: pd.DataFrame, scenes: Mapping[str, Scene], kept: Path, code: str) -> None:
    """Keep values of simulations with the code behind them and the day, and the limits of all that are kept.

    A simulation's rows replace those of before. Values of scenes whose keys are others now are dropped, as are those
    that the study no longer has. Rows of the reference whose problem no two ways have values of stay.

    Parameters
    ----------
    values : DataFrame
        Of `tables.reference.values_of`.
    scenes : mapping of str to Scene
        Of the study.
    kept : Path
        The reference; its values lie beside it (`values_beside`).
    code : str
        Digest of the code behind these values.

    Raises
    ------
    DataFileError
        When there are no values.
    """
    if values.empty:
        raise DataFileError(f"{RESULTS}: has no simulation of the study `reference` that is up to date")
    today = datetime.date.today().isoformat()
    hashes = {name: scene.hash for name, scene in scenes.items()}
    anew = values.assign(keys=values["scene"].map(hashes), code=code, made=today)
    all_values = _with_others(anew, values_beside(kept), "scene")
    all_values = all_values[all_values["keys"] == all_values["scene"].map(hashes)]
    reference = limits(all_values, scenes)
    of = all_values.groupby("scene")[["code", "made"]].first()
    marks = {}
    for problem, found_series in refinement_series_of(scenes[name] for name in of.index).items():
        behind = of.loc[[scene.name for each in found_series for scene in each.scenes]]
        marks[problem] = SEPARATOR.join(sorted(set(behind["code"]))), behind["made"].max()
    if not reference.empty:
        reference["code"], reference["made"] = zip(*reference["problem"].map(marks), strict=True)
        write_table(_with_others(reference, kept, "problem"), kept)
    write_table(all_values, values_beside(kept))


def _with_others(rows: pd.DataFrame, kept: Path, key: str) -> pd.DataFrame:
    """Return rows, in the place of those kept with their key, among all others that are kept."""
    if not kept.is_file():
        return rows
    before = read_table(kept, needs=(key, "code", "made"))
    others = before[~before[key].isin(set(rows[key]))]
    order = {name: place for place, name in enumerate(dict.fromkeys([*before[key], *rows[key]]))}
    return pd.concat([others, rows]).sort_values(key, key=lambda names: names.map(order), kind="stable")


def warning(kept: Path, code: str) -> str:
    """Return what is to be said of a kept copy whose code is not that of today; nothing where it is."""
    table = read_table(kept, needs=("code", "made"))
    found = sorted({digest for each in table["code"].astype(str) for digest in each.split(SEPARATOR)})
    if found == [code]:
        return ""
    return (
        f"The reference of {', '.join(sorted(set(table['made'].astype(str))))} was made by code "
        f"{', '.join(found)}, which is now {code}: `make reference` makes it anew."
    )


if __name__ == "__main__":
    try:
        study = study_of()
        keep(found(study, RESULTS), study, KEPT, code_behind(study.values()))
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    print(f"Reference: {KEPT.absolute()}")
