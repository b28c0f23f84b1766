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
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jinja2
import pandas as pd
from jinja2.sandbox import ImmutableSandboxedEnvironment
from matplotlib.figure import Figure

from knitstudy.datasets import STAMP, commit, read_result, read_table, write_table
from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.files import replacing, write_text
from knitstudy.knit.scene.documents import RESOURCES, WORKFLOW
from knitstudy.knit.scene.scene import Scene
from knitstudy.paper.claims import GRADES, NOT_RUN
from knitstudy.paper.claims.verdicts import counted
from knitstudy.paper.figures import draw
from knitstudy.paper.report import FULL_SCENES, ScreenPicture, read_sources
from knitstudy.paper.report import VERDICTS as VERDICTS_KEPT
from knitstudy.paper.tables.reference import limits, values_of
from knitstudy.run.catalogue import FIGURES, TABLES, Catalogue, Displays, reference_files
from knitstudy.run.code_digest import physics_digest
from knitstudy.run.configuration import CONFIG, load_scenes, load_study
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES
from knitstudy.run.store import Store
from knitstudy.use.style import save

RESULTS, NOTES = Path("results"), Path("docs/notes")


def stamped(table: pd.DataFrame, command: str, **remarks: str) -> pd.DataFrame:
    """Return a table with remarks on all of it, and with the columns that say what made it (`STAMP`)."""
    values = (physics_digest(), commit(), datetime.date.today().isoformat(), command)
    return table.assign(**remarks, **dict(zip(STAMP, values, strict=True)))


def keep_drawn(
    kept: pd.DataFrame, path: Path, drawing: Figure, title: str, sources: Mapping | None = None
) -> None:
    """Write a table, and in the notes a picture of it, or of the `sources` that it was made from."""
    sources = sources or {path.stem: kept}
    _save_picture(drawing, NOTES / f"{path.stem}.webp", sources, title)
    write_table(kept, path)


def _save_picture(drawing: Figure, path: Path, sources: Mapping, title: str) -> None:
    with TemporaryDirectory() as beside:
        picture = Path(beside) / f"{path.stem}.png"
        save(drawing, [picture], sources, title)
        with replacing(path) as temporary:
            temporary.write_bytes(ScreenPicture.of(picture).content)


# Verdicts of the full study

STUDY, VERDICTS = "full", "verdicts"
FULL = RESOURCES / "full"  # What pages of smaller studies show in place of their own
FINDINGS = "findings"  # The table that verdicts follow from
FULL_TABLES = ("readings", "sweeps", "table3_domain_size", "cost_growth")
FULL_FIGURES = ("fig11_sweeps", "fig_readings")
PAGE_TABLES = ("springs", "table4_angles")  # Beside the pictures of the page
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
    if claims and not is_up_to_date(VERDICTS_KEPT):
        raise DataFileError(f"{VERDICTS_KEPT}: is out of date; run `make {VERDICTS}`")
    plan = Plan.of(config)
    study = load_study(STUDY, config)
    scenes = up_to_date(plan, [plan.scenes[name] for name in study], RESULTS)
    if not scenes:
        message = f"has no simulation of the study {STUDY!r} that is up to date"
        raise DataFileError(f"{RESULTS}: {message}; run `make study STUDY={STUDY}`")
    names = [scene.name for scene in scenes]
    tables, figures = (full_study(each, plan, names, config) for each in (TABLES, FIGURES))
    sources = read_sources(tables.files(FINDINGS, RESULTS).items())
    found = TABLES.make(FINDINGS, **sources, scenes=tables.scenes(FINDINGS))

    def sources_of(displays: Displays, name: str) -> dict[str, Any]:
        """Return the sources of a display; findings are of the scenes that are up to date, not those of a study."""
        files = displays.files(name, RESULTS).items()
        made = {FINDINGS: found} if FINDINGS in displays.catalogue.find(name).tables else {}
        return read_sources((argument, file) for argument, file in files if argument not in made) | made

    command = f"make {VERDICTS}"
    share = f"{len(scenes)} of {len(study)}"
    table = stamped(
        TABLES.make(VERDICTS, **sources_of(tables, VERDICTS)),
        command,
        digest=tables.digest(VERDICTS),
        simulations=share,
    )
    unknown = set(claims) - set(table["id"])
    if unknown:
        raise DataFileError(f"{VERDICTS_KEPT}: there is no claim {', '.join(sorted(unknown))}")
    readings = read_table(reference_files(config)["readings"])
    behind = stamped(pd.DataFrame({"scene": names, "keys": [scene.hash for scene in scenes]}), command)
    write_table(_with_others(behind, FULL_SCENES, "scene") if claims else behind, FULL_SCENES)
    if claims:
        table = _with_others(table[table["id"].isin(claims)], VERDICTS_KEPT, "id")
        _keep_in_readings(TABLES.make("readings", **sources_of(tables, "readings")), claims)
        pictures = VERDICTS_PAGE.with_suffix("")
        page, _ = summarise(
            TEMPLATE, table, readings, [path.stem for path in pictures.iterdir()], pictures.name
        )
        return _keep_page(page, table)
    folders = dict.fromkeys(FULL_TABLES, FULL) | dict.fromkeys(PAGE_TABLES, VERDICTS_PAGE.with_suffix(""))
    for name in filter(folders.__contains__, tables.names()):
        shown_elsewhere = TABLES.make(name, **sources_of(tables, name), scenes=tables.scenes(name))
        write_table(stamped(shown_elsewhere, command), folders[name] / f"{name}.csv")
    page, shown = summarise(TEMPLATE, table, readings, figures.names(), VERDICTS_PAGE.stem)
    for name in shown:
        sources = sources_of(figures, name)
        drawing = draw(name, **sources, scenes=figures.scenes(name))
        picture = VERDICTS_PAGE.with_suffix("") / f"{name}.webp"
        _save_picture(drawing, picture, sources, FIGURES.find(name).title)
        if name in FULL_FIGURES:
            save(drawing, [FULL / f"{name}.png"], sources, FIGURES.find(name).title)
    return _keep_page(page, table)


def _keep_in_readings(made: pd.DataFrame, claims: Collection[str]) -> None:
    """Write the verdicts of claims by all readings that they were made for into the committed table."""
    kept = read_table(FULL / "readings.csv").set_index("name", drop=False)
    kept.update(made.set_index("name")[list(claims)])
    write_table(kept, FULL / "readings.csv")


def _keep_page(page: str, table: pd.DataFrame) -> str:
    write_text(page, VERDICTS_PAGE)
    write_text(COUNTED.sub(counted(table, table), README.read_text(encoding="utf-8")), README)
    write_table(table, VERDICTS_KEPT)
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
        return f"![{name}]({folder}/{name}.webp)\n\n*{title}*"

    environment = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = environment.from_string(template.read_text(encoding="utf-8")).render(
        picture=picture,
        claims=lambda letters: [row for row in rows if row["id"][0] in letters],
        verdicts=rows,
        counted=counted(verdicts, verdicts),
        grades=(*reversed(GRADES), NOT_RUN),
        readings=readings[readings["kind"] == "reading"].fillna("").to_dict("records"),
        made=rows[0]["made"],
        simulations=rows[0]["simulations"],
    )
    return page, shown


# The reference: values to which independent discretisations converge

REFERENCE = RESOURCES / "reference" / "reference.csv"
"""Reference values; a file beside it has the values of single simulations."""

SIMULATED = ("simulation", "contacts")  # Stages that the reference is made from
SEPARATOR = " "  # Between digests, or commits, where values behind the reference are of several


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
    new = stamped(values.assign(keys=values["scene"].map(hashes)), command)
    all_values = _with_others(new, values_beside(kept), "scene")
    all_values = all_values[all_values["keys"] == all_values["scene"].map(hashes)]
    reference = limits(all_values, scenes)
    if not reference.empty:
        behind = {name: SEPARATOR.join(sorted(set(all_values[name]))) for name in ("physics", "commit")}
        write_table(_with_others(stamped(reference, command).assign(**behind), kept, "problem"), kept)
    write_table(all_values, values_beside(kept))


def _with_others(rows: pd.DataFrame, kept: Path, key: str) -> pd.DataFrame:
    """Return rows, in the place of those kept with their key, among all others that are kept."""
    if not kept.is_file():
        return rows
    before = read_table(kept, needs=(key, *STAMP))
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
    kept = RESOURCES / "predictions.csv"
    picture = Path("docs/notes/fabrics.webp")
    # Stamped first: a picture that has changed would count as a change of the code.
    table = stamped(read_table(RESULTS / "tables" / kept.name).round(4), "make predictions")
    with replacing(picture) as temporary:
        temporary.write_bytes(ScreenPicture.of(RESULTS / "figures" / "fig_fabrics.png").content)
    write_table(table, kept)
    return f"{len(table)} predicted strains: {kept}, {picture}"


KEEPERS = {
    "reference": keep_reference,
    "verdicts": keep_verdicts,
    "predictions": keep_predictions,
}


# All tables

TARGETS = {
    "mechanisms": ("reference/mechanisms.csv", 7),
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


def is_up_to_date(table: Path) -> bool:
    """Return whether all rows of a committed table were made by the present code of the physics."""
    return table.is_file() and set(read_table(table, needs=STAMP)["physics"]) == {physics_digest()}


def keep_all() -> str:
    """Make every out-of-date table again; a run that was stopped resumes."""
    due = [name for name, (file, _) in TARGETS.items() if not is_up_to_date(RESOURCES / file)]
    for number, name in enumerate(due):
        left = sum(TARGETS[other][1] for other in due[number:])
        print(f"[{number + 1}/{len(due)}] make {name} (about {left / 60:.1f} h left)", flush=True)
        subprocess.run(["make", name], check=True)
    return f"{len(TARGETS)} committed tables are up to date (physics {physics_digest()}); {len(due)} were made again"


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
