"""Tables of studies that take hours, kept in ``resources`` with the digest behind them, and the pages that show them.

``python -m knitstudy.stages.kept_tables NAME`` keeps a table (`KEEPERS`) of results that are there; `make NAME` makes
them first.
"""

from __future__ import annotations

import argparse
import datetime
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
from matplotlib.figure import Figure

from knitstudy.errors import DataFileError, KnitstudyError
from knitstudy.figures import extremes_map, trade_map
from knitstudy.figures.catalogue import FIGURES, draw
from knitstudy.figures.style import save
from knitstudy.files import read_result, read_table, replacing, write_table, write_text
from knitstudy.geometry.feasible import OUTCOMES
from knitstudy.measures.catalogue import Catalogue
from knitstudy.report.files import ScreenPicture, read_sources
from knitstudy.report.kept_pages import summarise
from knitstudy.stages.code import code_digest
from knitstudy.stages.displays import Displays, reference_files
from knitstudy.stages.extremes import load_trials
from knitstudy.stages.plan import Plan
from knitstudy.stages.table import STAGES
from knitstudy.stages.trade import bounds
from knitstudy.study.choice import COLUMNS, TRADE_KEPT
from knitstudy.study.configuration import CONFIG, load_scenes, load_study
from knitstudy.study.documents import RESOURCES, WORKFLOW
from knitstudy.study.sample import load_trade
from knitstudy.study.scene import Scene, digest
from knitstudy.tables.catalogue import TABLES, tabulate
from knitstudy.tables.reference import REFERENCE_SCENES, limits, values_of

RESULTS, NOTES = Path("results"), Path("docs/notes")

SIMULATED = ("simulation", "contacts")  # Stages that the reference is made from


def age_warning(kept: Path, column: str, wanted: str, what: str, target: str) -> str:
    """Return a warning where not all of a kept table was made under a digest, which a column holds; else nothing.

    `what` names the rows in the plural, `target` is what makes them anew.
    """
    table = read_table(kept, needs=(column, "made"))
    if set(table[column].astype(str)) == {wanted}:
        return ""
    days = ", ".join(sorted(set(table["made"].astype(str))))
    why = "code or scenes have changed since, or not all had been run"
    return f"{what} were kept on {days}; {why}: `make {target}` makes them anew."


def stamped(table: pd.DataFrame, digest: str, **said: str) -> pd.DataFrame:
    """Return a table with columns of the digest behind it, of other remarks on all of it, and of the day."""
    return table.assign(digest=digest, **said, made=datetime.date.today().isoformat())


def _keep(
    kept: pd.DataFrame, path: Path, drawing: Figure, title: str, sources: Mapping | None = None
) -> None:
    """Write a table, and in the notes a picture of it, or of the `sources` that it was made from."""
    sources = sources or {path.stem: kept.assign(code=kept["digest"])}
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

VERDICTS_KEPT = RESOURCES / "verdicts.csv"
"""What the report of every study shows beside its own verdicts."""

VERDICTS_PAGE, TEMPLATE = Path("docs/results.md"), WORKFLOW / "report" / "results.md"


def keep_verdicts(config: Path = CONFIG) -> str:
    """Keep the verdicts, and write the page about them with its pictures; return what was kept."""
    plan, study = Plan.of(config), load_study(STUDY, config)
    scenes = plan.up_to_date([plan.scenes[name] for name in study], RESULTS)
    if not scenes:
        message = f"has no simulation of the study {STUDY!r} that is up to date"
        raise DataFileError(f"{RESULTS}: {message}; run `make study STUDY={STUDY}`")
    tables, figures = (_displays(each, plan, scenes, config) for each in (TABLES, FIGURES))
    sources = read_sources(tables.files(VERDICTS, RESULTS).items())
    found = tabulate(VERDICTS, **sources, scenes=tables.scenes(VERDICTS))
    table = stamped(found, tables.digest(VERDICTS), simulations=f"{len(scenes)} of {len(study)}")
    readings = read_table(reference_files(config)["readings"])
    page, shown = summarise(TEMPLATE, table, readings, figures.names(), VERDICTS_PAGE.stem)
    files = None
    for name in shown:
        if files != (taken := figures.files(name, RESULTS)):  # several may be of the same hundreds
            files, sources = taken, read_sources(taken.items())
        drawing = draw(name, **sources, scenes=figures.scenes(name))
        picture = VERDICTS_PAGE.with_suffix("") / f"{name}.webp"
        _save_picture(drawing, picture, sources, FIGURES.find(name).title)
    write_text(page, VERDICTS_PAGE)
    write_table(table, VERDICTS_KEPT)
    return f"{len(table)} verdicts: {VERDICTS_KEPT}, page: {VERDICTS_PAGE}"


def _displays(catalogue: Catalogue, plan: Plan, scenes: list[Scene], config: Path) -> Displays:
    return Displays(catalogue, plan, scenes, reference_files(config), label=f"study {STUDY!r}")


def verdicts_warning(plan: Plan, config: Path = CONFIG) -> str:
    """Return a warning where the kept verdicts were made by other code or scenes than today's; otherwise nothing."""
    displays = _displays(TABLES, plan, [plan.scenes[name] for name in load_study(STUDY, config)], config)
    wanted = displays.digest(VERDICTS) if VERDICTS in displays.names() else ""
    return age_warning(VERDICTS_KEPT, "digest", wanted, f"Verdicts of the study {STUDY!r}", VERDICTS)


# What accuracy costs


def keep_trade(config: Path = CONFIG) -> str:
    """Keep the errors and prices of the sample of knits, and draw them; return what was kept."""
    trade = load_trade()
    table = read_table(RESULTS / "trade" / "trade.csv", needs=COLUMNS)
    first = sorted(set(table["knit"]))[: trade.knits]  # knits beyond are there to judge promises
    table = table[table["knit"].isin(first)]
    counted = f"{len(first)} of {trade.knits}"
    kept = stamped(table, digest(sorted(set(table["code"].dropna()))), knits=counted)
    _keep(kept, TRADE_KEPT, trade_map.draw(table, bounds(table, trade)), "What accuracy costs")
    failed = table.loc[table["reason"].notna(), ["knit", "case", "rung"]].drop_duplicates()
    return f"{counted} knits, {len(table)} errors and prices, {len(failed)} runs failed: {TRADE_KEPT}"


# The reference: values to which independent discretisations converge

REFERENCE = RESOURCES / "reference" / "reference.csv"
"""What models are measured against; the values of single simulations lie beside it."""

SEPARATOR = " "  # Between the digests of all codes that the values behind the reference were made by


def values_beside(kept: Path) -> Path:
    """Return where the values of single simulations are kept that a reference is made from."""
    return kept.with_name(f"{kept.stem}_values.csv")


def code_behind(scenes: Iterable[Scene]) -> str:
    """Return a digest of the code of all simulations among scenes that the reference is made from."""
    modules = {"knitstudy.tables.reference"}
    for scene in REFERENCE_SCENES.scenes({scene.name: scene for scene in scenes}):
        for stage in ("geometry", "mesh", *SIMULATED):
            modules |= set(STAGES[stage].modules(scene))
    return code_digest(*sorted(modules))


def values_found(scenes: Mapping[str, Scene], results: Path, config: Path = CONFIG) -> pd.DataFrame:
    """Return the values of those simulations among scenes whose results are there and up to date."""
    there = Plan.of(config).up_to_date(scenes.values(), results, SIMULATED)
    stages = [STAGES[name] for name in SIMULATED]
    read = ({scene.name: read_result(results / stage.path(scene)) for scene in there} for stage in stages)
    return values_of(*read)


def keep_values(values: pd.DataFrame, scenes: Mapping[str, Scene], kept: Path, code: str) -> None:
    """Keep values of simulations with the code behind them and the day, and the limits of all that are kept.

    A simulation's rows (`tables.reference.values_of`) replace those of before; those of scenes whose keys have changed
    are dropped. Rows of the reference `kept` stay if fewer than two discretisations of their problem have values.
    """
    if values.empty:
        raise DataFileError(f"{RESULTS}: has no simulation of the study `reference` that is up to date")
    today = datetime.date.today().isoformat()
    hashes = {name: scene.hash for name, scene in scenes.items()}
    anew = values.assign(keys=values["scene"].map(hashes), code=code, made=today)
    all_values = _with_others(anew, values_beside(kept), "scene")
    all_values = all_values[all_values["keys"] == all_values["scene"].map(hashes)]
    reference = limits(all_values, scenes)
    if not reference.empty:
        codes = SEPARATOR.join(sorted(set(all_values["code"])))
        write_table(_with_others(reference.assign(code=codes, made=today), kept, "problem"), kept)
    write_table(all_values, values_beside(kept))


def _with_others(rows: pd.DataFrame, kept: Path, key: str) -> pd.DataFrame:
    """Return rows, in the place of those kept with their key, among all others that are kept."""
    if not kept.is_file():
        return rows
    before = read_table(kept, needs=(key, "code", "made"))
    others = before[~before[key].isin(set(rows[key]))]
    order = {name: place for place, name in enumerate(dict.fromkeys([*before[key], *rows[key]]))}
    return pd.concat([others, rows]).sort_values(key, key=lambda names: names.map(order), kind="stable")


def keep_reference(config: Path = CONFIG) -> str:
    """Keep the values of the study `reference` and their limits; return what was kept."""
    scenes = load_scenes(config)
    study = {name: scenes[name] for name in load_study("reference", config)}
    keep_values(values_found(study, RESULTS, config), study, REFERENCE, code_behind(study.values()))
    return f"Reference: {REFERENCE}"


# The campaign of extremes

EXTREMES = RESOURCES / "extremes.csv"


def keep_extremes(config: Path = CONFIG) -> str:
    """Keep the table of the campaign, and draw its map; return what was kept."""
    table, trials = read_table(RESULTS / "extremes" / "extremes.csv"), load_trials(config)
    counted = f"{len(table)} of {len(trials)}"
    kept = stamped(table, digest({"trials": [trial.digest() for trial in trials]}), trials=counted)
    _keep(kept, EXTREMES, extremes_map.draw(table), "What breaks")
    return f"{counted} trials: {EXTREMES}"


# Loops that fit

LOOPS = RESOURCES / "loops.csv"


def keep_loops(config: Path = CONFIG) -> str:
    """Keep the map of loops that fit, and draw it; return what was kept."""
    display = FIGURES.find("fig_loops")
    (scene,) = display.results["feasible"].scenes(load_scenes(config))
    found = read_result(RESULTS / STAGES["loop_map"].path(scene))
    sources = {"feasible": found}
    drawing = draw(display.name, **sources, scenes={"feasible": scene})
    table = found.to_dataframe().reset_index()
    table["outcome"] = [OUTCOMES[int(number)] for number in table["outcome"]]
    _keep(stamped(table.round(6), found.attrs["digest"]), LOOPS, drawing, display.title, sources)
    return f"{(table['outcome'] == OUTCOMES[0]).sum()} of {len(table)} loops fit: {LOOPS}"


# Predictions of fabrics


def keep_predictions(config: Path = CONFIG) -> str:
    """Keep the predictions of the study `fabrics` and its figure; return what was kept."""
    kept, picture = RESOURCES / "predictions.csv", Path("docs/fabrics.webp")
    table = read_table(RESULTS / "tables" / kept.name)
    with replacing(picture) as temporary:
        temporary.write_bytes(ScreenPicture.of(RESULTS / "figures" / "fig_fabrics.png").content)
    write_table(table.round(4), kept)
    return f"{len(table)} predicted strains: {kept}, {picture}"


KEEPERS = {
    "reference": keep_reference,
    "verdicts": keep_verdicts,
    "trade": keep_trade,
    "extremes": keep_extremes,
    "loops": keep_loops,
    "predictions": keep_predictions,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", choices=KEEPERS)
    try:
        print(KEEPERS[parser.parse_args().table]())
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
