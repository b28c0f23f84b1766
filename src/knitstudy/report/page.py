"""Figures, tables and the origin of the data on one HTML page that needs no other file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd

from knitstudy.errors import ConfigurationError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.files import read_dataset
from knitstudy.measures.catalogue import Catalogue, Display
from knitstudy.report.files import ScreenPicture, for_screen
from knitstudy.tables.catalogue import TABLES

TEXTS = ("alt", "caption", "paper", "ours")
"""Texts of a figure: in place of it, below it, and about the paper's and this study's finding."""

BY_MODEL = ("rom_distance", "table5_cost", "beams")  # tables with a row for each model that a study has

COMPARISON, COMPARED = "fig15", ("rom_distance", "table5_cost")
"""Figures whose names begin so, and tables, that follow the verdicts on which the page opens."""

LONG = 40  # rows from which on a table is folded
MOST = 400  # rows of a table that the page shows; its file has all


@dataclass(frozen=True)
class FigureItem:
    """A figure on the page."""

    name: str
    title: str
    picture: ScreenPicture
    texts: Mapping[str, str]

    @property
    def origin(self) -> str:
        """Sources of the figure."""
        return self.picture.said.get("Source", "")


@dataclass(frozen=True)
class TableItem:
    """A table on the page, as text: ``rows`` of cells below a ``header``, ``numeric`` tells which columns.

    ``count`` is how many rows there are: the page may show fewer.
    """

    name: str
    title: str
    caption: str
    header: list[str]
    rows: list[list[str]]
    numeric: list[bool]
    count: int


def render(
    template: Path,
    captions: Mapping[str, Any],
    pictures: Sequence[Path],
    results: Mapping[str, pd.DataFrame],
    provenance: pd.DataFrame,
    study: str,
    notes: Sequence[str] = (),
    kept: pd.DataFrame | None = None,
) -> str:
    """Return the page.

    Parameters
    ----------
    template : Path
        Jinja2 template of the page.
    captions : mapping
        Under ``figures`` and ``tables`` the texts of each by its name; see ``workflow/report/captions.yaml``. Those
        that have none there bring them with their registration.
    pictures : sequence of Path
        PNG files named after the figures.
    results : mapping of str to DataFrame
        Tables by name.
    provenance : DataFrame
        What made each data file, one a row; its first column is the file's path from the page.
    study : str
        Name of the study.
    notes : sequence of str
        What readers are to know of the whole page.
    kept : DataFrame, optional
        Verdicts of the full study, to be shown beside this one's.

    Raises
    ------
    ConfigurationError
        When a figure or table is not in the catalogue, has no caption, or a caption speaks of a number that
        is not there.
    DataFileError
        When a picture cannot be read.
    """
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    environment.globals["value"] = partial(_value, results)
    items = {path.stem: _figure(path, captions, environment) for path in pictures}
    built = {name: _table(name, table, captions) for name, table in results.items()}
    return environment.from_string(template.read_text(encoding="utf-8")).render(
        study=study,
        notes=notes,
        kept={} if kept is None else {row["id"]: row for row in kept.fillna("").to_dict("records")},
        figures=_in_order(items, FIGURES),
        tables=_in_order(built, TABLES),
        comparison=COMPARISON,
        compared=COMPARED,
        long=LONG,
        verdicts=results.get("verdicts", pd.DataFrame()).fillna("").to_dict("records"),
        provenance=_item("provenance", "Data files", "", cells(provenance)),
    )


def _value(results: Mapping[str, pd.DataFrame], table: str, row: str, column: str, form: str = ".3g") -> str:
    """Return a number for a caption, or a dash where the study has no scenes for its table or for its row."""
    if table in TABLES.names() and table not in results:
        return NOTHING
    if table in BY_MODEL and row not in set(results[table].iloc[:, 0]):
        return NOTHING
    return value(results, table, row, column, form)


def _in_order(items: Mapping[str, Any], catalogue: Catalogue) -> list[Any]:
    return [items[name] for name in catalogue.names() if name in items]


def _figure(path: Path, captions: Mapping[str, Any], environment: jinja2.Environment) -> FigureItem:
    name = path.stem
    display = FIGURES.find(name)
    texts = _texts(captions, "figures", display, TEXTS)
    picture = for_screen(path)
    filled = {key: _filled(text, f"{key} of {name}", environment) for key, text in texts.items()}
    return FigureItem(name, display.title, picture, filled)


def _table(name: str, table: pd.DataFrame, captions: Mapping[str, Any]) -> TableItem:
    display = TABLES.find(name)
    caption = _texts(captions, "tables", display, ("caption",))["caption"]
    text = cells(table)
    if len(text) < len(text.columns) and text.iloc[:, 0].is_unique:  # turned, it fits narrow screens
        text = text.set_index(text.columns[0]).T.rename_axis("").reset_index()
    return _item(name, display.title, caption, text, MOST)


def _item(name: str, title: str, caption: str, text: pd.DataFrame, most: int | None = None) -> TableItem:
    numeric = [text[column].str.match(r"^[-+−–\d.,e ]*$").all() for column in text.columns]
    rows = text.iloc[:most].to_numpy().tolist()
    return TableItem(name, title, caption, list(text.columns), rows, numeric, len(text))


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


def _filled(text: str, where: str, environment: jinja2.Environment) -> str:
    """Return a text with its numbers from the tables."""
    try:
        return environment.from_string(text).render()
    except jinja2.TemplateError as error:
        raise ConfigurationError(f"captions, {where}: {error}") from error


# ---- numbers ----

NOTHING = "–"
DIGITS = 4


def value(results: Mapping[str, pd.DataFrame], table: str, row: str, column: str, form: str = ".3g") -> str:
    """Return one number of a table; the row is named by its cell in the first column.

    Raises ConfigurationError when there is no such table, row or column.
    """
    if table not in results:
        raise ConfigurationError(
            f"captions: there is no table {table!r}, only {', '.join(results) or 'none'}"
        )
    frame = results[table]
    names = frame[frame.columns[0]]
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
    if isinstance(content, bool | np.bool_):
        return str(content)
    if isinstance(content, int | np.integer):
        return f"{content:,}"
    if isinstance(content, float | np.floating):
        return NOTHING if np.isnan(content) else _rounded(float(content))
    return NOTHING if content is None else str(content)


def _rounded(number: float) -> str:
    """Return four digits, without an exponent where the number is readable without one."""
    if number == 0:
        return "0"
    if 1e-4 <= abs(number) < 1e6:
        decimals = max(0, DIGITS - 1 - int(np.floor(np.log10(abs(number)))))
        text = f"{number:,.{decimals}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{number:.{DIGITS - 1}g}"


# ---- origin of the data ----

ATTRIBUTES = {
    "scene": "scene",
    "digest": "digest",
    "code_version": "code",
    "numpy": "numpy",
    "scipy": "scipy",
    "pyamg": "pyamg",
}


def origins(files: Iterable[Path | str], page: Path | str) -> pd.DataFrame:
    """Return one row for every netCDF file; the first column is its path from the page.

    Raises DataFileError when a file is missing or truncated.
    """
    folder = Path(page).parent
    rows = []
    for file in files:
        attributes = read_dataset(file).attrs
        row = {"file": Path(os.path.relpath(file, folder)).as_posix()}
        rows.append(row | {title: str(attributes.get(key, "")) for key, title in ATTRIBUTES.items()})
    return pd.DataFrame(rows, columns=["file", *ATTRIBUTES.values()])
