"""Do promises hold? Other knits judge what knits of the sample promise.

    python benchmarks/promises.py               # every knit judges what all others promise
    python benchmarks/promises.py --basis 48    # later knits judge what the first ones promise

Reads ``results/trade/trade.csv`` (of ``benchmarks/trade.py``). For every knit that judges, case, question and accuracy,
the cheapest model is taken that is promised to do, as `plan` does. Prints how many models were promised, which share of
the promises held, and which share cost at most three times the cheapest that would have done; writes
``results/tables/promises.csv``. The exit status is 1 where that is less than 95 % and 85 %.
"""

from __future__ import annotations

import argparse
import sys
from operator import attrgetter
from pathlib import Path

import pandas as pd
from trade import SAMPLE

from knitstudy.files import write_table
from knitstudy.study.choice import ERROR, SECONDS, measured_rows, promised
from knitstudy.study.configuration import drawn_defaults
from knitstudy.study.sample import Inputs, load_trade

ACCURACIES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
HOLD, CHEAP, DEAR = 0.95, 0.85, 3.0  # Shares of promises, and how many times the cheapest price is too much


def judged(rows: tuple[dict, ...], basis: int | None) -> pd.DataFrame:
    """Return a row a knit that judges, case, question and accuracy, with what was taken, and whether it held.

    The first `basis` knits promise, or all but the one that judges.
    """
    trade, defaults, found = load_trade(), drawn_defaults(), []
    names = sorted({row["knit"] for row in rows})
    first = set(names[:basis])
    cases = {str(case): case for case in trade.cases()}
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        if (basis is None or row["knit"] not in first) and row["question"]:
            groups.setdefault((row["knit"], row["case"], row["question"]), []).append(row)
    for (knit, case, question), there in groups.items():
        problem = trade.scene(cases[case], Inputs.of_row(there[0]), defaults, knit)
        errors, seconds = (
            {row["model setting"]: row[column] for row in there} for column in (ERROR, SECONDS)
        )
        promising = [row for row in rows if row["knit"] in first - {knit}]
        settings = [
            setting for setting in promised(problem, question, trade, promising) if setting.name in errors
        ]
        for accuracy in ACCURACIES:
            said = {"knit": knit, "case": case, "question": question, "accuracy": accuracy, "taken": ""}
            if good := [setting for setting in settings if setting.error <= accuracy]:
                taken = min(good, key=attrgetter("seconds", "error", "name")).name
                least = min(
                    (seconds[name] for name in errors if errors[name] <= accuracy), default=float("nan")
                )
                held = errors[taken] <= accuracy
                said |= {"taken": taken, "held": held, "times": seconds[taken] / least}
            found.append(said)
    return pd.DataFrame(found, columns=["knit", "case", "question", "accuracy", "taken", "held", "times"])


def main() -> int:
    """Judge, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--basis", type=int, help="first knits that promise; by default all but the one that judges"
    )
    table = judged(measured_rows(SAMPLE / "trade.csv"), parser.parse_args().basis)
    write_table(table, Path("results/tables/promises.csv"))
    made = table[table["taken"] != ""]
    if made.empty:
        sys.exit(f"error: none of {len(table)} questions was promised an answer")
    kept = made["held"].astype(bool)
    held, cheap = kept.mean(), (made.loc[kept, "times"] <= DEAR).mean()
    print(f"{len(made)} of {len(table)} questions were promised an answer")
    print(f"{held:.1%} of the promises held (bar {HOLD:.0%})")
    print(
        f"{cheap:.1%} of these cost at most {DEAR:g} times the least that would have done (bar {CHEAP:.0%})"
    )
    return 0 if held >= HOLD and cheap >= CHEAP else 1


if __name__ == "__main__":
    sys.exit(main())
