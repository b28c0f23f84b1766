"""Do promises hold? Knits of the sample judge what others promise of them.

    python benchmarks/promises.py               # every knit judges what all others promise
    python benchmarks/promises.py --basis 24    # later knits judge what the first ones promise

Reads ``resources/trade.csv``, or with ``--basis`` ``results/trade/trade.csv``, which has later knits. For every knit
that judges, case, question and accuracy, the cheapest model is taken that is promised to do, as `plan` does. Prints how
many models were promised, which share of the promises held, and which share cost at most three times the cheapest that
would have done; keeps all promises in ``resources/promises.csv``, with the physics of the errors. The exit status is 1
where the shares are less than 95 % and 85 %.
"""

from __future__ import annotations

import argparse
import sys
from operator import attrgetter

import pandas as pd
from trade import SAMPLE

from knitstudy.errors import KnitstudyError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.advice import ERROR, SECONDS, TRADE_KEPT, Promises, measured_rows
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import Inputs, load_trade
from knitstudy.run.committed_tables import keep_table, require_up_to_date

KEPT = RESOURCES / "promises.csv"
ACCURACIES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
HOLD, CHEAP, DEAR = 0.95, 0.85, 3.0  # Shares of promises, and how many times the cheapest price is too much

PROMISED, CHEAPEST = "promised [1]", "cheapest [s]"
COLUMNS = ["scene", "question", "accuracy [1]", "model", PROMISED, ERROR, "held", SECONDS, CHEAPEST]


def judged(rows: tuple[dict, ...], basis: int | None) -> pd.DataFrame:
    """Return a row a knit that judges, case, question and accuracy, with what was taken, and whether it held.

    The first `basis` knits promise, or all but the one that judges. Where nothing is promised `model` is empty.
    """
    trade = load_trade()
    table = []
    first = set(sorted({row["knit"] for row in rows})[:basis])
    cases = {str(case): case for case in trade.cases()}
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        if (basis is None or row["knit"] not in first) and row["question"]:
            groups.setdefault((row["knit"], row["case"], row["question"]), []).append(row)
    for (knit, case, question), there in groups.items():
        problem = PhysicalProblem(trade.scene(cases[case], Inputs.of_row(there[0]), knit), trade)
        errors, seconds = (
            {row["model setting"]: row[column] for row in there} for column in (ERROR, SECONDS)
        )
        promising = [row for row in rows if row["knit"] in first - {knit}]
        promised = Promises(problem, promising).settings(question)
        settings = [setting for setting in promised if setting.name in errors]
        for accuracy in ACCURACIES:
            of = {"scene": f"{knit}-{case}", "question": question, "accuracy [1]": accuracy, "model": ""}
            if good := [setting for setting in settings if setting.error <= accuracy]:
                taken = min(good, key=attrgetter("seconds", "error", "name"))
                least = min((seconds[name] for name in errors if errors[name] <= accuracy), default=None)
                of |= {"model": taken.name, PROMISED: taken.error, ERROR: errors[taken.name]}
                of |= {"held": errors[taken.name] <= accuracy, SECONDS: seconds[taken.name], CHEAPEST: least}
            table.append(of)
    return pd.DataFrame(table, columns=COLUMNS)


def shares(of: pd.DataFrame) -> tuple[float, float]:
    """Return the share of promises that held, and of these the share that cost at most `DEAR` times the least."""
    held = of[of["held"].astype(bool)]
    return len(held) / len(of), float((held[SECONDS] <= DEAR * held[CHEAPEST]).mean())


def main() -> int:
    """Judge, print and keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--basis", type=int, help="first knits that promise; by default all but the one that judges"
    )
    basis = parser.parse_args().basis
    if basis is None:
        require_up_to_date(TRADE_KEPT)
    rows = measured_rows(SAMPLE / "trade.csv" if basis else TRADE_KEPT)
    table = judged(rows, basis)
    made = table[table["model"] != ""]
    if made.empty:
        sys.exit(f"error: none of {len(table)} questions was promised an answer")
    if basis is None:
        trade = load_trade()
        groups = {trade.group_of(case, name) for case in trade.cases() for name in trade.settings_of(case)}
        keep_table(made, KEPT, "python benchmarks/promises.py", groups)
    print(
        f"{len(made)} of {len(table)} questions were promised an answer, of {made['scene'].nunique()} scenes"
    )
    for question, of in [("all questions", made), *made.groupby("question", sort=False)]:
        held, cheap = shares(of)
        print(f"{question}: {held:.1%} of the promises held (bar {HOLD:.0%})", end=", ")
        print(f"{cheap:.1%} of these cost at most {DEAR:g} times the least (bar {CHEAP:.0%})")
    held, cheap = shares(made)
    return 0 if held >= HOLD and cheap >= CHEAP else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
