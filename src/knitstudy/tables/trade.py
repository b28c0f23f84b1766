"""What accuracy costs: points of error and cost, the cheapest model for an accuracy, and the effect of single knobs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.catalogue import Datasets, Scenes, is_whole_knit, several
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.questions import QUESTIONS, UNITS
from knitstudy.measures.trade import ACCURACIES, nothing, points_of, rungs, sentence
from knitstudy.measures.trade_points import TIES, Point, shown, turned
from knitstudy.study.choice import cheapest, front, nearest
from knitstudy.tables.catalogue import TABLES

CASE = ["question", "interaction", "direction", "cells [1]"]  # Columns that the points of one front share
ERROR, UNCERTAIN, AT_MOST = "error [1]", "uncertainty of that error [1]", "error at most [1]"

CALLED = "model and knobs"

SECONDS, MEMORY = "seconds [s]", "memory growth [MB]"

COLUMNS = [
    *CASE,
    *("model", "varied", "to", CALLED, "quantity", "strain [1]", "unit", "value", "reference"),
    *("uncertainty of the reference", "error is to", ERROR, UNCERTAIN, AT_MOST, SECONDS),
    *("seconds of its sources [s]", "seconds are of the", MEMORY, "unknowns [1]", "on the front", "scene"),
]

SAID = [*CASE, "accuracy [1]", CALLED, "scene", AT_MOST, SECONDS, MEMORY, "sentence"]

RUNGS = [
    *CASE,
    *("points [1]", "on the front [1]", "under 1 s", "under 30 s", "within 2 %"),
    *("cheapest [s]", "smallest error at most [1]"),
]

KNOBS = [
    *("model", "interaction", "varied", "to", "points [1]", "largest change of an error [1]"),
    *("seconds over the main model's [1]", "memory over the main model's [1]", "verdict"),
]

# Keys that are turned as one knob.
TOGETHER = (
    "solver.residual_tolerance; solver.correction_tolerance",
    "mesh.span; mesh.crossing_span",
    "contact.normal_stiffness; contact.tangential_stiffness",
)

SAME = 1e-3  # Change of an error below which a knob has changed nothing [1]
CHEAPER, DEARER = 0.8, 1.25  # Ratios of seconds: the same run twice differs by a tenth

RESULTS = {
    "every": several("simulation", "*", where=is_whole_knit),
    "every_contacts": several("contacts", "*", where=is_whole_knit),
}

# What tables are made from that follow from the points.
OF_POINTS = {"results": RESULTS, "files": ("reference",), "scenes": True}


@TABLES.add("trade", "What accuracy costs: all points", results=RESULTS, order=20)
def tabulate(
    every: Datasets, every_contacts: Datasets, scenes: Scenes, reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a simulation and question; contacts are those of the direct simulations."""
    points = points_of(every, every_contacts, scenes, reference)
    rows = pd.DataFrame([_row(point, every[point.scene.name]) for point in points], columns=COLUMNS)
    return with_fronts(rows)


@TABLES.add("trade_sentences", "What an accuracy costs least", order=21, **OF_POINTS)
def tabulate_sentences(**sources) -> pd.DataFrame:
    """Return one row a front and accuracy: the model to take; see `tabulate` for the arguments."""
    return sentences(tabulate(**sources))


@TABLES.add("trade_rungs", "What fronts of accuracy and price reach", order=22, **OF_POINTS)
def tabulate_rungs(**sources) -> pd.DataFrame:
    """Return one row a front: the number of points, and its rungs; see `tabulate` for the arguments."""
    rows = []
    for case, points in tabulate(**sources).groupby(CASE, sort=False):
        on = points[points["on the front"]]
        found = rungs(on[SECONDS], on[AT_MOST])
        rows.append((*case, len(points), len(on), *found.values(), on[SECONDS].min(), on[AT_MOST].min()))
    return pd.DataFrame(rows, columns=RUNGS)


@TABLES.add("trade_knobs", "What single knobs of models buy", order=23, **OF_POINTS)
def tabulate_knobs(**sources) -> pd.DataFrame:
    """Return one row a model and single knob, over all its points; see `tabulate` for the arguments."""
    return knobs(tabulate(**sources))


def with_fronts(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose column of fronts is filled."""
    on: set[int] = set()
    for _, rows in table.groupby(CASE, sort=False):
        on |= set(front(rows.index, lambda row: table.at[row, SECONDS], lambda row: table.at[row, AT_MOST]))
    return table.assign(**{"on the front": [row in on for row in table.index]})


def sentences(table: pd.DataFrame, accuracies: Iterable[float] = ACCURACIES) -> pd.DataFrame:
    """Return one row a front and accuracy from the rows of `tabulate`."""
    rows = []
    for case, points in table.groupby(CASE, sort=False):
        words, records = QUESTIONS[case[0]].words, points.to_dict("records")
        for accuracy in accuracies:
            found = cheapest(records, accuracy, lambda row: row[SECONDS], lambda row: row[AT_MOST])
            best = found or nearest(records, lambda row: row[AT_MOST])
            said = (
                sentence(words, accuracy, best[CALLED], best[SECONDS], best[MEMORY], best[AT_MOST])
                if found
                else nothing(words, accuracy, best[CALLED], best[AT_MOST])
            )
            row = dict(zip(CASE, case, strict=True)) | {key: best[key] for key in SAID if key in best}
            rows.append(row | {"accuracy [1]": accuracy, "sentence": said})
    return pd.DataFrame(rows, columns=SAID)


def knobs(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row a model and single knob from the rows of `tabulate`, without ties in place of contact."""
    table = table[~table["model"].str.startswith(TIES)]
    main = {_place(row): row for row in table.to_dict("records") if not row["varied"]}
    pairs: dict[tuple, list[tuple[dict, dict]]] = {}
    for row in table.to_dict("records"):
        single = ";" not in row["varied"] or row["varied"] in TOGETHER
        if row["varied"] and single and (base := main.get(_place(row))):
            key = (row["model"], row["interaction"], row["varied"], row["to"])
            pairs.setdefault(key, []).append((row, base))
    return pd.DataFrame([_knob(key, found) for key, found in pairs.items()], columns=KNOBS)


def _place(row: Mapping) -> tuple:
    return (*(row[key] for key in CASE), row["model"], row["strain [1]"])


def _knob(key: tuple, pairs: list[tuple[dict, dict]]) -> tuple:
    change = max(abs(row[ERROR] - base[ERROR]) for row, base in pairs)
    gain = max(base[AT_MOST] - row[AT_MOST] for row, base in pairs)
    alike = [(row, base) for row, base in pairs if row["seconds are of the"] == base["seconds are of the"]]
    seconds, memory = (
        float(pd.Series([row[column] / base[column] for row, base in alike]).median())
        for column in (SECONDS, MEMORY)
    )
    return (*key, len(pairs), change, seconds, memory, _verdict(change, gain, seconds))


def _verdict(change: float, gain: float, seconds: float) -> str:
    if change <= SAME:
        return "same answers for less" if seconds < CHEAPER else "buys nothing"
    if gain <= SAME and seconds > CHEAPER:
        return "buys nothing"
    if seconds < CHEAPER:
        return "cheaper, other answers"
    return "dearer, other answers" if seconds > DEARER else "other answers"


def _row(point: Point, history: xr.Dataset) -> dict:
    scene, expense = point.scene, point.expense
    knobs_turned = turned(scene)
    values = (
        point.question.name,
        INTERACTIONS[point.interaction],
        scene.load.direction,
        f"{scene.pattern.loops} x {scene.pattern.rows}",
        point.model,
        "; ".join(knobs_turned),
        "; ".join(shown(value) for value in knobs_turned.values()),
        point.called,
        point.quantity,
        point.strain,
        UNITS[point.quantity],
        point.value,
        point.true.value,
        point.true.uncertainty,
        point.source,
        point.error.value,
        point.error.uncertainty,
        point.bound,
        expense.seconds,
        expense.sources,
        expense.clock,
        expense.memory,
        int(history.attrs["unknowns"]),
        False,
        scene.name,
    )
    return dict(zip(COLUMNS, values, strict=True))
