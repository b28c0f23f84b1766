"""Tables that take minutes to hours to make are committed in ``resources`` with their origin; pages show them.

``python benchmarks/keep.py NAME`` keeps the table of a study (`KEEPERS`) of results that are there; `make NAME` makes
the results first. ``python benchmarks/keep.py all`` (`make committed-tables`) makes all out-of-date tables (`TARGETS`)
again, the cheapest first. ``tests/verification/test_kept.py`` makes the cheapest rows of each table again.
"""

from __future__ import annotations

import argparse
import datetime
import re
import subprocess
import sys
from collections.abc import Collection, Iterable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jinja2
import pandas as pd
from jinja2.sandbox import ImmutableSandboxedEnvironment
from matplotlib.figure import Figure

from knitstudy.datasets import read_result, read_table
from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.files import replacing, write_text
from knitstudy.knit.scene.documents import RESOURCES, WORKFLOW
from knitstudy.knit.scene.scene import Scene
from knitstudy.paper.claims import GRADES, NOT_RUN
from knitstudy.paper.claims.verdicts import counted, quantities_of, require_measured
from knitstudy.paper.figures import draw
from knitstudy.paper.report import FULL_SCENES, ScreenPicture, read_sources
from knitstudy.paper.report import VERDICTS as VERDICTS_KEPT
from knitstudy.paper.tables.fabrics import UNKNOWNS
from knitstudy.paper.tables.reference import limits, values_of
from knitstudy.run.behaviour import group_of
from knitstudy.run.catalogue import FIGURES, TABLES, Catalogue, Displays, reference_files
from knitstudy.run.committed_tables import (
    RUN,
    SEPARATOR,
    is_up_to_date,
    keep_table,
    require_up_to_date,
    stale_runs,
)
from knitstudy.run.configuration import CONFIG, load_scenes, load_study
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.store import Store
from knitstudy.use.style import save

RESULTS, NOTES = Path("results"), Path("docs/notes")


def save_picture(drawing: Figure, path: Path, sources: Mapping, title: str) -> None:
    """Write a figure as a picture for the notes."""
    with TemporaryDirectory() as beside:
        picture = Path(beside) / f"{path.stem}.png"
        save(drawing, [picture], sources, title)
        with replacing(path) as temporary:
            temporary.write_bytes(ScreenPicture.of(picture).content)


# Verdicts of the full study

STUDY, VERDICTS = "full", "verdicts"
FULL = RESOURCES / "full"  # What pages of smaller studies show in place of their own
FULL_TABLES = (
    "readings",
    "sweeps",
    "table3_domain_size",
    "cost_growth",
    "table2_meshes",
    "table2_rules",
    "springs",
)
FULL_FIGURES = ("fig11_sweeps", "fig_readings", "fig_table2_springs")
PAGE_TABLES = ("table4_angles",)  # Beside the pictures of the page
VERDICTS_PAGE = Path("docs/reference/results.md")
TEMPLATE = WORKFLOW / "report" / "results.md"
README = Path("README.md")
COUNTED = re.compile(r"^Of \d+ claims of the paper, .*$", re.MULTILINE)


def full_study(catalogue: Catalogue, plan: Plan, names: Iterable[str], config: Path) -> Displays:
    """Return the figures or tables of the full study that can be made of scenes by their names."""
    scenes = [plan.scenes[name] for name in names]
    return Displays(catalogue, plan, scenes, reference_files(config), label=f"study {STUDY!r}")


def keep_verdicts(config: Path = CONFIG, claims: Collection[str] = ()) -> str:
    """Keep the verdicts, write the page about them with its pictures, and their number into README.md.

    Of some claims alone: all other verdicts stay, and so do the tables and pictures of all claims if they are up to
    date.
    """
    if claims and (stale := stale_claims() - set(claims)):
        raise DataFileError(f"{VERDICTS_KEPT}: {', '.join(sorted(stale))} is stale; run `make {VERDICTS}`")
    reference = reference_files(config)
    for behind in ("reference", "mechanisms"):
        require_up_to_date(reference[behind])
    plan = Plan.of(config)
    study = load_study(STUDY, config)
    scenes = up_to_date(plan, [plan.scenes[name] for name in study], RESULTS)
    if not scenes:
        message = f"has no simulation of the study {STUDY!r} that is up to date"
        raise DataFileError(f"{RESULTS}: {message}; run `make study STUDY={STUDY}`")
    names = [scene.name for scene in scenes]
    tables, figures = (full_study(each, plan, names, config) for each in (TABLES, FIGURES))

    @cache
    def table_of(name: str) -> pd.DataFrame:
        """Return a table of the scenes that are up to date."""
        return TABLES.make(name, **sources_of(tables, name), scenes=tables.scenes(name))

    def sources_of(displays: Displays, name: str) -> dict[str, Any]:
        """Return the sources of a display; tables among them are not those of a study."""
        behind = displays.catalogue.find(name).tables
        files = displays.files(name, RESULTS).items()
        read = read_sources((argument, file) for argument, file in files if argument not in behind)
        return read | {other: table_of(other) for other in behind}

    command = f"make {VERDICTS}"
    group_by_name = {name: group_of(plan.scenes[name]) for name in study}
    groups = sorted(set(group_by_name.values()))
    table = table_of(VERDICTS).assign(
        digest=tables.digest(VERDICTS), simulations=f"{len(scenes)} of {len(study)}"
    )
    require_measured(table[table["id"].isin(claims)] if claims else table, read_table(reference["claims"]))
    unknown = set(claims) - set(table["id"])
    if unknown:
        raise DataFileError(f"{VERDICTS_KEPT}: there is no claim {', '.join(sorted(unknown))}")
    readings = read_table(reference["readings"])
    behind = pd.DataFrame({"scene": names, "keys": [scene.hash for scene in scenes]})
    behind = _with_others(behind, FULL_SCENES, "scene") if claims else behind
    keep_table(behind, FULL_SCENES, command, behind["scene"].map(group_by_name))
    if claims:
        table = _with_others(table[table["id"].isin(claims)], VERDICTS_KEPT, "id")
        keep_table(_in_readings(table_of("readings"), claims), FULL / "readings.csv", command, groups)
        pictures = VERDICTS_PAGE.with_suffix("")
        page, _ = summarise(
            TEMPLATE, table, readings, [path.stem for path in pictures.iterdir()], pictures.name
        )
        return _keep_page(page, table, groups)
    folders = dict.fromkeys(FULL_TABLES, FULL) | dict.fromkeys(PAGE_TABLES, VERDICTS_PAGE.with_suffix(""))
    for name in filter(folders.__contains__, tables.names()):
        shown_elsewhere = table_of(name)
        of = shown_elsewhere["scene"].map(group_by_name) if "scene" in shown_elsewhere else groups
        keep_table(shown_elsewhere, folders[name] / f"{name}.csv", command, of)
    page, shown = summarise(TEMPLATE, table, readings, figures.names(), VERDICTS_PAGE.stem)
    for name in shown:
        sources = sources_of(figures, name)
        drawing = draw(name, **sources, scenes=figures.scenes(name))
        picture = VERDICTS_PAGE.with_suffix("") / f"{name}.webp"
        save_picture(drawing, picture, sources, FIGURES.find(name).title)
        if name in FULL_FIGURES:
            save(drawing, [FULL / f"{name}.png"], sources, FIGURES.find(name).title)
    return _keep_page(page, table, groups)


def groups_of_claim(claim: str, groups: Collection[str]) -> list[str]:
    """Return those groups of the full study that a claim is judged by, sorted.

    Claims B are about beams in contact, R about networks beside solids; none is about endless cells.
    """
    others = {"cell": "", "beam": "B", "rom2d": "R", "rom3d": "R"}
    return sorted(
        group for group in groups if all(claim[0] in others[word] for word in group.split() if word in others)
    )


def stale_claims() -> set[str]:
    """Return the claims whose committed verdicts are stale."""
    table = read_table(VERDICTS_KEPT, needs=("id", RUN))
    return set(table.loc[table[RUN].isin(stale_runs(VERDICTS_KEPT)), "id"])


def _in_readings(made: pd.DataFrame, claims: Collection[str]) -> pd.DataFrame:
    """Return the committed verdicts by readings, with those of some claims as they are now; these rows are new."""
    kept = read_table(FULL / "readings.csv").astype({RUN: "Int64"}).set_index("name", drop=False)
    kept.update(made.set_index("name")[list(claims)])
    kept.loc[kept.index.isin(made["name"]), RUN] = pd.NA
    return kept


def _keep_page(page: str, table: pd.DataFrame, groups: Collection[str]) -> str:
    write_text(page, VERDICTS_PAGE)
    write_text(COUNTED.sub(counted(table, table), README.read_text(encoding="utf-8")), README)
    of_claims = table["id"].map(lambda claim: SEPARATOR.join(groups_of_claim(claim, groups)))
    keep_table(table, VERDICTS_KEPT, f"make {VERDICTS}", of_claims)
    return f"{len(table)} verdicts: {VERDICTS_KEPT}, page: {VERDICTS_PAGE}"


def summarise(
    template: Path,
    verdicts: pd.DataFrame,
    readings: pd.DataFrame,
    drawn: Collection[str],
    folder: str,
) -> tuple[str, list[str]]:
    """Return the page of verdicts, and the figures that it shows.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page. ``claims(letters)`` gives it the claims whose ids begin with one of some letters,
        ``picture(name)`` a figure, or nothing where that is not drawn, ``measured(claim, quantity)`` a value.
    verdicts : DataFrame
        The verdicts, with the number of ``simulations`` behind them.
    readings : DataFrame
        Readings of the paper and values of inputs, ``resources/reference/readings.csv``.
    drawn : collection of str
        Names of figures.
    folder : str
        Folder of the pictures, from the page.
    """
    shown: list[str] = []
    rows = verdicts.astype(object).fillna("").to_dict("records")

    def picture(name: str) -> str:
        title = FIGURES.find(name).title
        if name not in drawn:
            return ""
        shown.append(name)
        return f"![{name}]({folder}/{name}.webp)\n\n*{title}*"

    def measured(claim: str, quantity: str) -> str:
        values = quantities_of(next(row for row in rows if row["id"] == claim))
        if quantity not in values:
            known = ", ".join(values)
            raise DataFileError(f"{template}: {claim} has no quantity {quantity!r}; known are {known}")
        return values[quantity]

    environment = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = environment.from_string(template.read_text(encoding="utf-8")).render(
        picture=picture,
        measured=measured,
        claims=lambda letters: [row for row in rows if row["id"][0] in letters],
        verdicts=rows,
        counted=counted(verdicts, verdicts),
        grades=(*reversed(GRADES), NOT_RUN),
        readings=readings[readings["kind"] == "reading"].fillna("").to_dict("records"),
        made=datetime.date.today().isoformat(),
        simulations=rows[0]["simulations"],
    )
    return page, shown


# The reference: values to which independent discretisations converge

REFERENCE = RESOURCES / "reference" / "reference.csv"
"""Reference values; a file beside it has the values of single simulations."""

SIMULATED = ("simulation", "contacts")  # Stages that the reference is made from


def values_beside(kept: Path) -> Path:
    """Return where the values of single simulations are kept that a reference is made from."""
    return kept.with_name(f"{kept.stem}_values.csv")


def up_to_date(
    plan: Plan, scenes: Iterable[Scene], results: Path, stages: Collection[str] = tuple(STAGES)
) -> list[Scene]:
    """Return those scenes of which all datasets, of some stages, that a study makes are there and up to date."""
    store = Store(results)

    def there(scene: Scene) -> bool:
        steps = plan.steps_of(scene).values()
        needed = {need.path for step in steps if step.wanted for need in step.needs.values()}
        made = (step for step in steps if step.wanted or step.path in needed)
        return all(store.holds(step) for step in made if step.stage.is_dataset and step.stage.name in stages)

    return list(filter(there, scenes))


def values_found(scenes: Mapping[str, Scene], results: Path, config: Path = CONFIG) -> pd.DataFrame:
    """Return the values of those simulations among scenes whose results are there and up to date."""
    there = up_to_date(Plan.of(config), scenes.values(), results, SIMULATED)
    stages = [STAGES[name] for name in SIMULATED]
    read = (
        {scene.name: read_result(results / stage.path(scene.name)) for scene in there} for stage in stages
    )
    return values_of(*read)


def keep_values(values: pd.DataFrame, scenes: Mapping[str, Scene], kept: Path) -> None:
    """Keep values of simulations with what made them, and the limits of all that are kept.

    A simulation's rows (`paper.tables.reference.values_of`) replace those of before; those of scenes whose keys have
    changed are dropped. Rows of the reference `kept` stay if fewer than two discretisations of their problem have
    values.
    """
    if values.empty:
        raise DataFileError(f"{RESULTS}: has no simulation of the study `reference` that is up to date")
    command = "make reference"
    hashes = {name: scene.hash for name, scene in scenes.items()}
    new = values.assign(keys=values["scene"].map(hashes))
    all_values = _with_others(new, values_beside(kept), "scene")
    all_values = all_values[all_values["keys"] == all_values["scene"].map(hashes)]
    groups = {name: group_of(scene) for name, scene in scenes.items()}
    reference = limits(all_values, scenes)
    if not reference.empty:
        keep_table(_with_others(reference, kept, "problem"), kept, command, sorted(set(groups.values())))
    keep_table(all_values, values_beside(kept), command, all_values["scene"].map(groups))


def _with_others(rows: pd.DataFrame, kept: Path, key: str) -> pd.DataFrame:
    """Return rows, in the place of those kept with their key, among all others that are kept with their runs."""
    if not kept.is_file():
        return rows
    before = read_table(kept, needs=(key, RUN))
    others = before[~before[key].isin(set(rows[key]))]
    order = {name: place for place, name in enumerate(dict.fromkeys([*before[key], *rows[key]]))}
    return pd.concat([others, rows]).sort_values(key, key=lambda names: names.map(order), kind="stable")


def keep_reference(config: Path = CONFIG) -> str:
    """Keep the values of the study `reference` and their limits; return what was kept."""
    scenes = load_scenes(config)
    study = {name: scenes[name] for name in load_study("reference", config)}
    keep_values(values_found(study, RESULTS, config), study, REFERENCE)
    return f"Reference: {REFERENCE}"


# Predictions of fabrics


def keep_predictions(config: Path = CONFIG) -> str:
    """Keep the predictions of the study `fabrics` and its figure; return what was kept."""
    require_up_to_date(UNKNOWNS)
    kept = RESOURCES / "predictions.csv"
    picture = Path("docs/notes/fabrics.webp")
    scenes = load_scenes(config)
    groups = {group_of(scenes[name]) for name in load_study("fabrics", config)}
    table = keep_table(read_table(RESULTS / "tables" / kept.name).round(4), kept, "make predictions", groups)
    with replacing(picture) as temporary:
        temporary.write_bytes(ScreenPicture.of(RESULTS / "figures" / "fig_fabrics.png").content)
    return f"{len(table)} predicted strains: {kept}, {picture}"


KEEPERS = {
    "reference": keep_reference,
    "verdicts": keep_verdicts,
    "predictions": keep_predictions,
}


# All tables

TARGETS = {
    "mechanisms": ("reference/mechanisms.csv", 12),
    "loops": ("loops.csv", 8),
    "predictions": ("predictions.csv", 15),
    "verify": ("verification.csv", 25),
    "extremes": ("extremes.csv", 15),
    "swatches": ("swatches.csv", 30),
    "reference": ("reference/reference.csv", 90),
    "trade": ("trade.csv", 140),
    "verdicts": ("verdicts.csv", 480),
}
"""Targets of make by the committed table that they write, with its minutes on two cores, the cheapest first."""


def keep_all() -> str:
    """Make every out-of-date table again; a run that was stopped resumes."""
    due = [name for name, (file, _) in TARGETS.items() if not is_up_to_date(RESOURCES / file)]
    for number, name in enumerate(due):
        left = sum(TARGETS[other][1] for other in due[number:])
        print(f"[{number + 1}/{len(due)}] make {name} (about {left / 60:.1f} h left)", flush=True)
        subprocess.run(["make", name], check=True)
    return f"{len(TARGETS)} committed tables are up to date; {len(due)} were made again"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", choices=(*KEEPERS, "all"))
    parser.add_argument("--claims", nargs="+", default=(), help="of verdicts: those of these claims alone")
    asked = parser.parse_args()
    if asked.claims and asked.table != VERDICTS:
        parser.error(f"--claims are of `{VERDICTS}`")
    options = {"claims": asked.claims} if asked.claims else {}
    try:
        print(keep_all() if asked.table == "all" else KEEPERS[asked.table](**options))
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
