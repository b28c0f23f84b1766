"""What accuracy costs, on knits of a sample: all model settings of config/trade.yaml on one knit after the other.

    python benchmarks/trade.py --first 48     # or less, or more; a run that was stopped goes on
    python benchmarks/trade.py --cases cell-touching-large,cell-touching-cycle    # the others stay as they are kept

Every run leaves a record in results/trade, named by a digest of its keys. The table of errors and prices is written
after every knit to results/trade/trade.csv, and kept in resources/trade.csv and drawn in docs/notes/trade.webp at the
end. Knits beyond those that config/trade.yaml asks for judge promises (``benchmarks/promises.py``).
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Collection, Mapping
from dataclasses import asdict
from functools import partial
from itertools import islice
from math import isinf
from pathlib import Path

import pandas as pd
from keep import NOTES, save_picture
from matplotlib.figure import Figure
from records import Record, counted, record
from sample_points import drawn, points_of

from knitstudy.datasets import read_table, write_table
from knitstudy.errors import ConfigurationError, GeometryError, KnitstudyError, message_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.measures.questions import QUESTIONS
from knitstudy.run.advice import ERROR, MEMORY, SECONDS, TRADE_KEPT
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import TIED, Inputs, SampleCase, Trade, load_trade
from knitstudy.run.committed_tables import keep_table
from knitstudy.run.trade import collect, run
from knitstudy.use.style import DOUBLE, YARNS, figure, place, shared_legend, styled

SAMPLE = Path("results/trade")  # Records of the sample's runs, its knits, and its table of errors and prices
# Results of the runs of one knit, so that model settings share a geometry
SCRATCH = Path("run/trade") / str(os.getpid())

FOUND = "found"  # The column ``outcome`` of a knit whose loop can be made; others have the reason

MOST_TRIED = 20  # Points of the box for each knit of the sample: with fewer loops than that, the box is wrong


def sampled(trade: Trade, first: int, outcomes: Mapping[Inputs, str]) -> pd.DataFrame:
    """Return the first knits of the sample, a row a point of the box: a point without a loop is replaced by the next.

    `outcomes` are those that are known already.
    """
    rows = []
    count = 0
    for inputs, slips in islice(points_of(trade), MOST_TRIED * first):
        outcome = outcomes.get(inputs) or _outcome(trade, inputs)
        count += outcome == FOUND
        name = f"knit{count:03}" if outcome == FOUND else ""
        rows.append({"knit": name, "outcome": outcome, "slips": slips} | asdict(inputs))
        if count == first:
            return pd.DataFrame(rows)
    found = f"only {count} of {len(rows)} points have a loop"
    raise ConfigurationError(f"box: {found}; narrow course or wale in config/trade.yaml")


def _outcome(trade: Trade, inputs: Inputs) -> str:
    try:
        lay_out(trade.scene(SampleCase("cut_knit", TIED), inputs))
    except GeometryError as error:
        return message_of(error)
    return FOUND


def made_by(problem: PhysicalProblem, setting: str) -> list[str]:
    """Return the behaviour of the models, and the hash of all keys, behind a run."""
    recorded = problem.trade.behaviours(problem.case)[setting]
    return [recorded, problem.scene.vary(problem.settings[setting]).hash]


def measure_sample(first: int, folder: Path = SAMPLE, only: Collection[str] = ()) -> pd.DataFrame:
    """Run all model settings on the first knits of the sample, one after the other, and return their errors and prices.

    A record that is there is used where it was made by models that behave as those of today do; `only` are cases, or
    all.
    """
    trade = load_trade()
    listed = folder / "knits.csv"
    cases = [case for case in trade.cases() if not only or str(case) in only]
    if unknown := set(only) - set(map(str, cases)):
        known_cases = ", ".join(map(str, trade.cases()))
        raise ConfigurationError(
            f"--cases: there is no {', '.join(sorted(unknown))}; there are {known_cases}"
        )
    problems = {}
    records = {}
    for number in counted(range(first), "knits"):
        before = read_table(listed).to_dict("records") if listed.is_file() else ()
        known = {Inputs.of_row(row): row["outcome"] for row in before}
        points = sampled(trade, number + 1, known)
        if len(points) > len(known):
            write_table(points, listed)
        knit = f"knit{number + 1:03}"
        point = Inputs.of_row(points.iloc[-1])
        for case in (each for each in cases if trade.settings_of(each, number)):
            inputs = drawn(trade, case, point, bool(points.iloc[-1]["slips"]))
            name = f"{knit}-{case}"
            problem = problems[knit, case] = PhysicalProblem(trade.scene(case, inputs, name), trade)
            records[knit, case] = []
            for setting in trade.settings_of(case, number):
                if setting not in problem.settings:
                    continue
                measured = record(
                    folder,
                    f"{name}-{setting}",
                    made_by(problem, setting),
                    partial(_measured, problem, setting),
                )
                records[knit, case].append(measured)
        shutil.rmtree(SCRATCH, ignore_errors=True)
    found = collect(trade, problems, records)
    write_table(found, folder / "trade.csv")
    return found


def _measured(problem: PhysicalProblem, setting: str) -> Record:
    """Return the record of a run from its beginning, since one that goes on has no price."""
    shutil.rmtree(SCRATCH / "restart", ignore_errors=True)
    measured = run(problem, setting, SCRATCH)
    print(f"{problem.scene.name} {setting}: {measured['reason'] or 'ended'}, {measured['seconds']:.3g} s")
    return measured


def bounds(table: pd.DataFrame, trade: Trade) -> pd.DataFrame:
    """Return what the knits of a table promise: one row for every case, question and model setting."""
    rows = []
    of_settings = ["case", "question", "model setting"]
    for of_setting, of in table.dropna(subset=[ERROR]).groupby(of_settings, sort=False):
        row = dict(zip(of_settings, of_setting, strict=True))
        row |= {"knits": len(of), "failed": sum(map(isinf, of[ERROR]))}
        row |= {"median error [1]": of[ERROR].median(), ERROR: trade.bound(of[ERROR].to_numpy())}
        rows.append(row | of[[SECONDS, MEMORY]].median().to_dict())
    return pd.DataFrame(rows)


COLOURS = (*YARNS, "#56B4E9", "#7B3294", "#1A1A1A", "#8C8C8C", "#8E1B5A")  # of model settings

ENDS = (1e-4, 20.0)  # Errors that are drawn
FAILED = (1200.0, 10.0)  # Seconds and error where failed runs stand

HIGH, GAP, FOOT, HEAD = 34.0, 5.0, 26.0, 6.0  # of a row, between rows, below and above them [mm]


@styled
def draw(table: pd.DataFrame, bounds: pd.DataFrame) -> Figure:
    """Draw a panel a case and question: dots are knits, large marks are median seconds and promised errors.

    Parameters
    ----------
    table : DataFrame
        Errors and prices of knits (``resources/trade.csv``).
    bounds : DataFrame
        What is promised of every setting (`bounds`).
    """
    table = table.dropna(subset=[ERROR])
    cases, settings = list(dict.fromkeys(table["case"])), list(dict.fromkeys(table["model setting"]))
    page = figure(DOUBLE, HEAD + FOOT + len(cases) * (HIGH + GAP))
    panels = list(dict.fromkeys(zip(table["case"], table["question"], strict=True)))
    columns = {name: k for k, name in enumerate(QUESTIONS) if name != "loss"} | {
        "loss": 0
    }  # which cycles alone have
    lowest = {columns[name]: case for case, name in panels}
    for case, name in panels:
        column = columns[name]
        row = cases[::-1].index(case)
        axes = place(page, 0.115 + 0.178 * column, FOOT + row * (HIGH + GAP), 0.155, HIGH)
        bottom = lowest[column] == case
        axes.tick_params(labelleft=column == 0, labelbottom=bottom)
        axes.set(xscale="log", yscale="log", xlim=(0.03, 2000), ylim=ENDS)
        for setting, colour in zip(settings, COLOURS, strict=False):
            which = f"case == {case!r} and question == {name!r} and `model setting` == {setting!r}"
            knits, bound = table.query(which), bounds.query(which)
            of_knits = {"s": 5, "alpha": 0.5, "linewidths": 0}
            seconds = knits[SECONDS].fillna(FAILED[0])
            errors = knits[ERROR].clip(ENDS[0], FAILED[1])
            axes.scatter(seconds, errors, color=colour, **of_knits)
            of_setting = {"s": 26, "marker": "D", "edgecolors": "white", "linewidths": 0.6, "zorder": 3}
            axes.scatter(bound[SECONDS], bound[ERROR], color=colour, label=setting, **of_setting)
        axes.set_title(name.replace("_", " ") if case == cases[0] or name == "loss" else "", fontsize=8)
        axes.set_ylabel("" if column else f"{case.replace('-', ' ')}\nerror [1]")
        axes.set_xlabel("processor time [s]" if bottom else "")
    shared_legend(page, ncols=5)
    return page


def keep(table: pd.DataFrame) -> str:
    """Keep the errors and prices of the sample, and draw them; return what was kept. Other cases stay as they are."""
    trade = load_trade()
    first = sorted(set(table["knit"]))[: trade.knits]  # knits beyond are there to judge promises
    table = table[table["knit"].isin(first)]
    counted = f"{len(first)} of {trade.knits}"
    kept = table.drop(columns="problem")
    cases = {str(case): case for case in trade.cases()}
    if TRADE_KEPT.is_file():
        before = read_table(TRADE_KEPT)
        others = before[before["case"].isin(set(cases) - set(table["case"]))]
        order = list(cases)
        kept = pd.concat([others, kept], ignore_index=True).sort_values(
            "case", key=lambda of: of.map(order.index), kind="stable"
        )
    groups = pd.Series(
        [
            trade.group_of(cases[case], setting or trade.reference[0])
            for case, setting in kept[["case", "model setting"]].fillna("").to_numpy()
        ],
        index=kept.index,
    )
    kept = keep_table(kept, TRADE_KEPT, "make trade", groups)
    picture = NOTES / f"{TRADE_KEPT.stem}.webp"
    save_picture(draw(kept, bounds(kept, trade)), picture, {"trade": kept}, "What accuracy costs")
    failed = table.loc[table["reason"].fillna("") != "", ["knit", "case", "model setting"]].drop_duplicates()
    return f"{counted} knits, {len(table)} errors and prices, {len(failed)} runs failed: {TRADE_KEPT}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=48, help="knits of the sample")
    parser.add_argument(
        "--cases", type=lambda text: text.split(","), default=[], help="cases to measure, all"
    )
    asked = parser.parse_args()
    try:
        print(keep(measure_sample(asked.first, only=asked.cases)))
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
