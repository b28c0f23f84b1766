"""Does a knit of the sample stand on the branch that small increments reach? Knits that touch, with a fine beginning.

    python benchmarks/branches.py                                    # pieces that touch, solid yarns of degree 2
    python benchmarks/branches.py --setting beams --knits knit028    # one knit in another model

Where yarns take up contact, friction makes the load path one of several: an increment that is too large may end on
another branch, and later increments of half the size stay there (docs/notes/accuracy.md). Every knit runs with the
increments of the sample, and with `STOPS` besides. A row of results/trade/branches.csv has a quantity of both runs, and
the uncertainty of its reference value. A command that was stopped goes on.
"""

from __future__ import annotations

import argparse
import shutil
import sys

import pandas as pd
from trade import SAMPLE, SCRATCH

from knitstudy.datasets import read_table, write_table
from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.run.advice import TRADE_KEPT
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import Inputs, SampleCase, Trade, load_trade
from knitstudy.run.trade import run

BRANCHES = SAMPLE / "branches.csv"
# Strains at which further increments end: with 0.1 % (48 increments to 4.7 %) degree 2 ended on the wrong branch
STOPS = [round(0.0005 * k, 4) for k in range(1, 11)]
UNCERTAINTY = "uncertainty of the reference value [1]"
CHANGE = "change [1]"


def begun_finely(trade: Trade, case: SampleCase, setting: str) -> Trade:
    """Return the declaration of the sample in which a case begins with small increments in one model setting."""
    settings = trade.settings[case.yarns]
    finely = settings | {setting: settings[setting] | {"load.stops": STOPS}}
    return trade.model_copy(update={"settings": trade.settings | {case.yarns: finely}})


def rows_of(kept: pd.DataFrame, case: SampleCase, setting: str) -> list[dict[str, object]]:
    """Return a row a quantity of one knit, with both values; `kept` are its rows in resources/trade.csv."""
    trade = load_trade()
    values = []
    seconds = []
    reason = ""
    scene = trade.scene(case, Inputs.of_row(kept.iloc[0]), f"{kept.iloc[0]['knit']}-{case}")
    for each in (trade, begun_finely(trade, case, setting)):
        shutil.rmtree(SCRATCH, ignore_errors=True)  # a restart file of the other increments
        record = run(PhysicalProblem(scene, each), setting, SCRATCH)
        values.append(record["values"])
        seconds.append(record["seconds"])
        reason = reason or record["reason"]
    shutil.rmtree(SCRATCH, ignore_errors=True)
    rows = []
    for row in kept.to_dict("records"):
        before, after = (each.get(row["quantity"], float("nan")) for each in values)
        named = {name: row[name] for name in ("knit", "case", "model setting", "question", "quantity")}
        of_both = {"value [SI]": before, "with a fine beginning [SI]": after, CHANGE: after / before - 1}
        rows.append(
            named | of_both | {UNCERTAINTY: row[UNCERTAINTY], "seconds [s]": sum(seconds), "reason": reason}
        )
    return rows


def main() -> None:
    """Run what is asked for and not there yet, and print what changes by more than the reference is uncertain."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--setting", default="yarns2", help="model setting of config/trade.yaml")
    parser.add_argument("--case", default="cut-knit-touching")
    parser.add_argument("--knits", type=lambda text: text.split(","), default=[], help="by default all")
    asked = parser.parse_args()
    cases = {str(case): case for case in load_trade().cases()}
    if asked.case not in cases:
        raise ConfigurationError(f"--case: there is no {asked.case}; there are {', '.join(cases)}")
    kept = read_table(TRADE_KEPT)
    kept = kept[(kept["model setting"] == asked.setting) & (kept["case"] == asked.case)]
    kept = kept[kept["knit"].isin(asked.knits or kept["knit"]) & kept["question"].notna()]
    table = (
        read_table(BRANCHES)
        if BRANCHES.is_file()
        else pd.DataFrame(columns=["knit", "case", "model setting"])
    )
    for knit, of_knit in kept.groupby("knit", sort=False):
        known = (
            (table["knit"] == knit)
            & (table["case"] == asked.case)
            & (table["model setting"] == asked.setting)
        )
        if known.any():
            continue
        made = pd.DataFrame(rows_of(of_knit, cases[asked.case], asked.setting))
        table = pd.concat([table, made], ignore_index=True)
        write_table(table, BRANCHES)
        changes = ", ".join(f"{row.quantity} {100 * row[CHANGE]:+.2g} %" for _, row in made.iterrows())
        print(f"{knit} {asked.case} {asked.setting}: {changes}; {made['seconds [s]'][0]:.3g} s", flush=True)
    moved = table[table[CHANGE].abs() > table[UNCERTAINTY]]
    print(moved.drop(columns="reason").to_string(index=False) if len(moved) else "no value moves")


if __name__ == "__main__":
    try:
        main()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
