"""Figures, tables and the origin of the data on one HTML page that needs no other file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from numbers import Integral, Number
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
from jinja2.sandbox import ImmutableSandboxedEnvironment

from knitstudy.errors import ConfigurationError
from knitstudy.files import STAMP, VERSIONS, read_dataset, read_table
from knitstudy.paper.report.files import ScreenPicture
from knitstudy.run.catalogue import FIGURES, TABLES, Display

# Texts of a figure: in place of it, below it, and about the paper's and this study's finding.
TEXTS = ("alt", "caption", "paper", "ours")
BY_MODEL = ("rom_distance", "table5_cost", "beams")  # tables with a row for each model that a study has

MOST = 100  # rows of a table that the page shows; its file has all
NOTHING = "–"
DIGITS = 4
ATTRIBUTES = ("scene", "loosened", "digest", *VERSIONS)  # of data files


def render(
    template: Path,
    captions: Mapping[str, Any],
    pictures: Sequence[Path],
    results: Mapping[str, pd.DataFrame],
    provenance: pd.DataFrame,
    study: str,
    notes: Sequence[str] = (),
    kept: pd.DataFrame | None = None,
    full: Path | None = None,
    turning: str = "",
) -> str:
    """Return the page.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page.
    captions : mapping
        Under ``figures`` and ``tables`` a text by the name of each, under ``opening`` the texts that come first; see
        ``workflow/report/captions.yaml``. Other figures and tables bring their texts with their registration.
    pictures : sequence of Path
        PNG files named after the figures.
    results : mapping of str to DataFrame
        Tables by name.
    provenance : DataFrame
        Provenance of every data file, a row for each; its first column is the file's path from the page.
    study : str
        Name of the study.
    notes : sequence of str
        Notes for readers on the whole page.
    kept : DataFrame, optional
        Verdicts of the full study, shown beside the verdicts of this one.
    full : Path, optional
        Folder of tables (CSV) and pictures (PNG) of the full study, which replace the ones of a smaller study.
    turning : str, optional
        Page of a knit that turns in the browser (`paper.report.turning_knit`).

    Raises
    ------
    ConfigurationError
        When a figure or table is not in the catalogue, has no caption, or a caption speaks of a number that
        is not there.
    DataFileError
        When a picture cannot be read.
    """
    instead = {} if full is None or study == "full" else {path.name: path for path in full.iterdir()}
    pictures = [instead.get(path.name, path) for path in pictures]
    results = {
        name: read_table(instead[f"{name}.csv"]).drop(columns=[*STAMP], errors="ignore")
        if f"{name}.csv" in instead
        else table
        for name, table in results.items()
    }
    environment = ImmutableSandboxedEnvironment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    claims = results.get("verdicts", pd.DataFrame()).fillna("").to_dict("records")
    environment.globals |= {"value": partial(value, results), "verdicts": claims}
    figures = {path.stem: _figure(path, captions, results, environment) for path in pictures}
    tables = {name: _table(name, table, captions) for name, table in results.items()}
    for shown, ending in ((figures, "png"), (tables, "csv")):
        for name, entry in shown.items():
            entry["title"] += " (of the full study)" if f"{name}.{ending}" in instead else ""
    opening = captions["opening"]
    sentences = [_filled(environment, f"sentence {text!r}", text) for text in opening["sentences"]]
    return environment.from_string(template.read_text(encoding="utf-8")).render(
        study=study,
        notes=notes,
        kept={} if kept is None else {row["id"]: row for row in kept.fillna("").to_dict("records")},
        asked=opening["asked"],
        turning=turning,
        sentences=[text for text in sentences if NOTHING not in text],
        first=next((figures[name] for name in opening["pictures"] if name in figures), None),
        figures=[figures[name] for name in FIGURES.names() if name in figures],
        tables=[tables[name] for name in TABLES.names() if name in tables and name != "verdicts"],
        provenance=cells(provenance),
    )


def _filled(environment: jinja2.Environment, what: str, text: str) -> str:
    """Return a text in which numbers are filled in."""
    try:
        return environment.from_string(text).render()
    except jinja2.TemplateError as error:
        raise ConfigurationError(f"captions, {what}: {error}") from error


def _figure(
    path: Path, captions: Mapping, results: Mapping[str, pd.DataFrame], environment: jinja2.Environment
) -> dict[str, Any]:
    """Return name, title, picture, texts and numbers of a figure, and whether it is folded."""
    display = FIGURES.find(path.stem)
    texts = _texts(captions, "figures", display, TEXTS)
    more = captions["figures"].get(display.name) or {}
    return {
        "name": display.name,
        "title": display.title,
        "picture": ScreenPicture.of(path),
        "texts": {key: _filled(environment, f"{key} of {display.name}", text) for key, text in texts.items()},
        "numbers": numbers(results, **more["numbers"]) if "numbers" in more else None,
        "folded": more.get("folded", False),
    }


def numbers(
    results: Mapping[str, pd.DataFrame], table: str, columns: Mapping[str, str], rows: Sequence[str] = ()
) -> dict[str, Any] | None:
    """Return columns of a table by their headings, of some rows or all; None where the study lacks them.

    Columns without a number are left out. Raises ConfigurationError when the table has no such column.
    """
    if (frame := results.get(table)) is None:
        return None
    if missing := [column for column in columns.values() if column not in frame]:
        raise ConfigurationError(f"captions: table {table!r} has no column {missing[0]!r}")
    first, heads = frame.columns[0], {column: heading for heading, column in columns.items()}
    chosen = frame[frame[first].isin(rows)] if rows else frame
    text = cells(chosen[[first, *heads]].dropna(axis="columns", how="all").rename(columns=heads))
    rows, numeric = text.to_numpy().tolist(), [False] + [True] * (len(text.columns) - 1)
    return {"header": list(text.columns), "rows": rows, "numeric": numeric, "title": table}


def _table(name: str, table: pd.DataFrame, captions: Mapping[str, Any]) -> dict[str, Any]:
    """Return name, title and caption of a table, its text as far as it is shown, and which columns are numbers."""
    display = TABLES.find(name)
    text = cells(table)
    if len(text) < len(text.columns) and text.iloc[:, 0].is_unique:  # turned, it fits narrow screens
        text = text.set_index(text.columns[0]).T.rename_axis("").reset_index()
    return {
        "name": name,
        "title": display.title,
        "caption": _texts(captions, "tables", display, ("caption",))["caption"],
        "header": list(text.columns),
        "rows": text.iloc[:MOST].to_numpy().tolist(),
        "numeric": [text[column].str.match(r"^[-+−–\d.,e ]*$").all() for column in text.columns],
        "count": len(text),
    }


def _texts(captions: Mapping[str, Any], kind: str, display: Display, keys: Sequence[str]) -> dict[str, str]:
    """Return the texts of a figure or table, from the captions or else from its registration."""
    try:
        texts = captions[kind].get(display.name) or display.texts
        return {key: str(texts[key]).strip() for key in keys}
    except (AttributeError, KeyError, TypeError) as error:
        raise ConfigurationError(
            f"captions: {kind}.{display.name} must have the texts {', '.join(keys)}, or its registration must;"
            f" {error} is missing"
        ) from error


def value(results: Mapping[str, pd.DataFrame], table: str, row: str, column: str, form: str = ".3g") -> str:
    """Return one number of a table for a caption; the row is named by its cell in the first column.

    Returns a dash if the study lacks the scenes of the table or of the row. Raises ConfigurationError if no such table,
    row or column exists.
    """
    if table not in results:
        if table in TABLES.names():
            return NOTHING
        raise ConfigurationError(
            f"captions: there is no table {table!r}, only {', '.join(results) or 'none'}"
        )
    frame = results[table]
    names = frame[frame.columns[0]]
    if table in BY_MODEL and row not in set(names):
        return NOTHING
    if column not in frame or (names == row).sum() != 1:
        raise ConfigurationError(
            f"captions: table {table!r} has no cell of row {row!r} and column {column!r}; rows are "
            f"{', '.join(map(str, names))}, columns {', '.join(map(str, frame.columns))}"
        )
    number = frame.loc[names == row, column].iloc[0]
    return NOTHING if pd.isna(number) else format(number, form)


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table as text: integers with thousands set apart, other numbers with four digits."""
    return table.map(_cell)


def _cell(content: object) -> str:
    if pd.isna(content):
        return NOTHING
    if isinstance(content, bool) or not isinstance(content, Number):
        return str(content)
    if isinstance(content, Integral):
        return f"{content:,}"
    if content and not 1e-4 <= abs(content) < 1e6:
        return f"{content:.{DIGITS - 1}g}"
    # All digits before the point: without an exponent where the number is readable without one.
    return f"{content:,.{max(DIGITS, len(f'{abs(content):.0f}'))}g}"


def origins(files: Iterable[Path | str], page: Path | str) -> pd.DataFrame:
    """Return one row for every netCDF file; the first column is its path from the page.

    Raises DataFileError when a file is missing or truncated.
    """
    rows = []
    for file in files:
        attributes = read_dataset(file).attrs
        path = Path(os.path.relpath(file, Path(page).parent)).as_posix()
        rows.append([path, *(str(attributes.get(key, "")) for key in ATTRIBUTES)])
    return pd.DataFrame(rows, columns=["file", *(key.removesuffix("_version") for key in ATTRIBUTES)])
