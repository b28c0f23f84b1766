"""The report: one HTML page that holds every figure and table with the findings of the paper, and the data's origin."""

from __future__ import annotations

import os
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from numbers import Integral
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd
from jinja2.sandbox import ImmutableSandboxedEnvironment
from PIL import Image, UnidentifiedImageError

from knitstudy.datasets import VERSIONS, read_dataset, read_result, read_table, require_unchanged
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.knit.scene.documents import RESOURCES, read_yaml
from knitstudy.knit.scene.scene import Scene
from knitstudy.paper.claims.verdicts import counted
from knitstudy.run.catalogue import FIGURES, TABLES, Display
from knitstudy.run.committed_tables import RUN, with_runs
from knitstudy.run.configuration import load_study
from knitstudy.run.stages import STAGES
from knitstudy.run.store import recorded_scenes
from knitstudy.use.deformed import deformed, page_of

# Texts of a figure: in place of it, below it, and about the paper's and this study's finding.
TEXTS = ("alt", "caption", "paper", "ours")
BY_MODEL = (
    "rom_distance",
    "table5_cost",
    "beams",
    "table2_rules",
    "table2_meshes",
)  # tables with a row for each model that a study has

MOST = 100  # rows of a table that the page shows; its file has all
NOTHING = "–"
DIGITS = 4
ATTRIBUTES = ("scene", "relaxed_limits", "digest", *VERSIONS)  # of data files


def render(
    template: Path,  # of Jinja2
    captions: Mapping[str, Any],  # ``workflow/report/captions.yaml``; others come with their registration
    pictures: Sequence[Path],  # PNG files named after the figures
    results: Mapping[str, pd.DataFrame],  # tables by name
    provenance: pd.DataFrame,  # of every data file, a row for each: first its path from the page
    study: str,
    notes: Sequence[str] = (),  # on the whole page
    kept: pd.DataFrame | None = None,  # verdicts of the full study, shown beside those of this one
    full: Path | None = None,  # tables and pictures of the full study, in place of those of a smaller one
    turning: tuple[str, Scene | None] = ("", None),  # `turning_knit`; its scene says what is pulled
    page: Path = Path(),  # where the page will be: links to files of the full study begin there
) -> str:
    """Return the page.

    Raises ConfigurationError where a figure or table is not in the catalogue, has no caption, or a caption speaks of a
    number that is not there; DataFileError where a picture cannot be read.
    """
    instead = {} if full is None or study == "full" else {path.name: path for path in full.iterdir()}
    drawn = {path.name: path for path in pictures}
    drawn |= {name: path for name, path in instead.items() if path.suffix == ".png"}
    results = {**results, **_tables_of(instead)}
    environment = ImmutableSandboxedEnvironment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    claims = results.get("verdicts", pd.DataFrame()).fillna("").to_dict("records")
    known = {"value": partial(value, results), "key": partial(key, turning[1]), "verdicts": claims}
    environment.globals |= known
    figures = {path.stem: _figure(path, captions, results, environment) for path in drawn.values()}
    tables = {name: _table(name, table, captions) for name, table in results.items()}
    _add_files(figures, "figures/{}.png", instead, page)
    _add_files(tables, "tables/{}.csv", instead, page)
    opening = captions["opening"]
    return environment.from_string(template.read_text(encoding="utf-8")).render(
        study=study,
        notes=notes,
        kept={} if kept is None else {row["id"]: row for row in kept.fillna("").to_dict("records")},
        asked=opening["asked"],
        counted=counted(results["verdicts"] if kept is None else kept, results["verdicts"]) if claims else "",
        turning=turning[0],
        pulled=_sentences(environment, opening["pulled"]),
        sentences=_sentences(environment, opening["sentences"]),
        first=next(iter(_in_order(figures, opening["pictures"])), None),
        figures=_in_order(figures, FIGURES.names()),
        tables=_in_order(tables, [name for name in TABLES.names() if name != "verdicts"]),
        provenance=cells(provenance),
    )


def _tables_of(files: Mapping[str, Path]) -> dict[str, pd.DataFrame]:
    """Return the tables of the catalogue among files, without their stamps."""
    return {
        name: read_table(files[f"{name}.csv"]).drop(columns=RUN, errors="ignore")
        for name in TABLES.names()
        if f"{name}.csv" in files
    }


def _add_files(
    entries: Mapping[str, dict[str, Any]], file: str, instead: Mapping[str, Path], page: Path
) -> None:
    """Add to figures or tables the path of their file from the page: `file`, or that of the full study."""
    for name, entry in entries.items():
        own = Path(file.format(name))
        entry["file"] = own.as_posix()
        entry["own"] = own.name not in instead
        if not entry["own"]:
            entry["file"] = Path(os.path.relpath(instead[own.name], page.parent)).as_posix()
            entry["title"] += " (of the full study)"


def _in_order(entries: Mapping[str, dict[str, Any]], names: Iterable[str]) -> list[dict[str, Any]]:
    """Return those entries that there are, in the order of names."""
    return [entries[name] for name in names if name in entries]


def _sentences(environment: jinja2.Environment, texts: Iterable[str]) -> list[str]:
    """Return texts in which numbers are filled in, without those whose numbers are not there."""
    filled = (_filled(environment, f"sentence {text!r}", text) for text in texts)
    return [text for text in filled if NOTHING not in text]


def _filled(environment: jinja2.Environment, what: str, text: str) -> str:
    """Return a text in which numbers are filled in."""
    try:
        return environment.from_string(text).render()
    except jinja2.TemplateError as error:
        raise ConfigurationError(f"captions, {what}: {error}") from error


def _figure(
    path: Path,
    captions: Mapping[str, Any],
    results: Mapping[str, pd.DataFrame],
    environment: jinja2.Environment,
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
    first = frame.columns[0]
    heads = {column: heading for heading, column in columns.items()}
    chosen = frame[frame[first].isin(rows)] if rows else frame
    text = cells(chosen[[first, *heads]].dropna(axis="columns", how="all").rename(columns=heads))
    numeric = [False] + [True] * (len(text.columns) - 1)
    return {"header": list(text), "rows": text.to_numpy().tolist(), "numeric": numeric, "title": table}


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


def key(scene: Scene | None, name: str, form: str = ".3g", unit: float = 1.0) -> str:
    """Return the number of a dotted key of a scene, in a unit, for a caption; a dash where there is no scene."""
    return NOTHING if scene is None else format(scene.value(name) / unit, form)


def value(
    results: Mapping[str, pd.DataFrame],
    table: str,
    row: str,
    column: str,
    form: str = ".3g",
    unit: float = 1.0,
) -> str:
    """Return one number or text of a table for a caption; the row is named by its cell in the first column.

    Numbers are over a `unit`.

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
    if pd.isna(number):
        return NOTHING
    return format(number if isinstance(number, str) else number / unit, form)


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table as text: integers with thousands set apart, other numbers with four digits."""
    return table.map(_cell)


def _cell(content: Any) -> str:
    if pd.isna(content):
        return NOTHING
    if isinstance(content, bool) or not isinstance(content, float | int | np.number):
        return str(content)
    if isinstance(content, Integral):
        return f"{content:,}"
    number = float(content)
    if number and not 1e-4 <= abs(number) < 1e6:
        return f"{number:.{DIGITS - 1}g}"
    # All digits before the point: without an exponent where the number is readable without one.
    return f"{number:,.{max(DIGITS, len(f'{abs(number):.0f}'))}g}"


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


# ---- What figures, tables and the page are made from

READERS: dict[str, Callable[[Path], Any]] = {".nc": read_result, ".csv": read_table, ".yaml": read_yaml}
WIDTH = 1300  # points of the widest picture of the page, which is at most 822 pixels wide on a screen
FORMAT: dict[str, Any] = {"format": "WEBP", "quality": 80}  # lines and letters stay sharp


def read_sources(files: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return the contents of files by argument; a sequence of paths by the names of their scenes.

    Raises DataFileError or ConfigurationError when a file is missing or cannot be read.
    """

    def read(source: Any) -> Any:
        if isinstance(source, str | Path):
            return READERS[Path(source).suffix](Path(source))
        return {dataset.attrs["scene"]: dataset for dataset in map(read, source)}

    return {name: read(source) for name, source in files}


@dataclass(frozen=True)
class ScreenPicture:
    """A picture as a screen shows it (WebP), with the size [points] and the metadata of its file, and its width."""

    content: bytes
    width: int
    height: int
    metadata: dict[Any, Any]
    millimetres: float = 0.0

    @classmethod
    def of(cls, path: Path) -> ScreenPicture:
        """Return the picture of a file; DataFileError when it cannot be read, or was changed after it was written."""
        require_unchanged(path)
        try:
            with Image.open(path) as image:
                shown = image.convert("RGB")
                texts = dict(image.info)
        except (OSError, UnidentifiedImageError) as error:
            message = f"{path}: is not a picture ({error}); make it again with `make study`"
            raise DataFileError(message) from error
        width, height = shown.size
        millimetres = 25.4 * width / float(texts.get("dpi", (300.0,))[0])
        shown.thumbnail((WIDTH, height), Image.Resampling.LANCZOS)
        stored = BytesIO()
        shown.save(stored, **FORMAT)
        return cls(stored.getvalue(), width, height, texts, millimetres)

    @property
    def uri(self) -> str:
        """The picture as a data URI."""
        return f"data:image/webp;base64,{b64encode(self.content).decode()}"


# ---- The knit that turns in the report: one deformed knit of the study, as a page within the page

CORNERS = 120_000  # of all increments at most: about 1 MB


def turning_knit(wanted: Sequence[str], data: Iterable[Path]) -> tuple[str, Scene | None]:
    """Return page and scene of the first of some scenes by name whose history is among the data files; else nothing."""
    histories = {path.stem: path for path in data if path.parent.name == "simulation"}
    path = next((histories[name] for name in wanted if name in histories), None)
    if path is None:
        return "", None
    history = read_dataset(path)
    scene, _ = recorded_scenes(history, path)
    geometry = read_dataset(path.parents[1] / STAGES["geometry"].path(scene.knit))
    title = f"{scene.kind.fidelity.meaning}, {scene.kind.interaction.meaning}"
    return page_of(deformed(geometry, history, scene.radius), title, CORNERS), scene


# ---- Warnings about committed tables (``benchmarks/keep.py``) whose scenes or rules have changed since

VERDICTS = RESOURCES / "verdicts.csv"  # of the full study
FULL_SCENES = RESOURCES / "full" / "scenes.csv"  # behind these verdicts
REFERENCE_VALUES = RESOURCES / "reference" / "reference_values.csv"  # behind the reference


def age_warnings(scenes: Mapping[str, Scene], config: Path, claims: Path) -> list[str]:
    """Return what has changed since verdicts and reference were committed; `claims` is the table of present rules.

    Code does not count: ``tests/regression`` fails where it changes numbers. What came later does not count either: its
    claims are not yet run.
    """

    def keys(study: str) -> dict[str, str]:
        return {name: scenes[name].hash for name in load_study(study, config)}

    rules = read_table(claims, needs=("id", "rule")).set_index("id")["rule"]
    full = "Verdicts of the full study", "verdicts"
    warnings = (
        age_warning(FULL_SCENES, "keys", keys("full"), *full),
        age_warning(VERDICTS, "rule", rules.to_dict(), *full),
        age_warning(REFERENCE_VALUES, "keys", keys("reference"), "Values of the reference", "reference"),
    )
    return [warning for warning in warnings if warning]


def age_warning(kept: Path, column: str, present: Mapping[str, str], what: str, target: str) -> str:
    """Return a warning if a column of a committed table has changed since, by its first column; else an empty text.

    `what` names the committed rows in the plural, `target` is their target of make.
    """
    table = with_runs(kept)
    changed = table[table[table.columns[0]].map(present) != table[column]]
    if changed.empty:
        return ""
    days = ", ".join(sorted(set(changed["made"].astype(str))))
    first, *more = dict.fromkeys(changed[changed.columns[0]])
    which = f"{first} and {len(more)} more" if more else first
    return (
        f"{what} were committed on {days}; changed since then: {column} of {which}; "
        f"`make {target}` makes them again."
    )
