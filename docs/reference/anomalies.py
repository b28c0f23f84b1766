"""Write the generated tables of docs/anomalies.md: ``python docs/reference/anomalies.py``.

Stale tables come from the runs behind committed tables, their reasons and expected failures from the tests that list
them, relaxed limits from the shipped scenes.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

from knitstudy.datasets import read_table
from knitstudy.knit.loading.gates import relaxed_limits
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.committed_tables import RUN, runs_of, stale_runs
from knitstudy.run.configuration import load_scenes

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "anomalies.md"
TESTS = ROOT / "tests" / "verification" / "test_kept.py"


def listed(name: str) -> dict[str, str]:
    """Return a constant of the tests of committed tables: reasons by the name of a table."""
    for node in ast.parse(TESTS.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name:
            constant: dict[str, str] = ast.literal_eval(node.value)
            return constant
    raise ValueError(f"{TESTS}: has no {name}; docs/reference/anomalies.py reads it")


def stale_tables() -> list[tuple[str, ...]]:
    """Return a row for every committed table with stale runs."""
    rows = []
    for name, reason in listed("STALE_TABLES").items():
        path = RESOURCES / f"{name}.csv"
        stale = stale_runs(path)
        if not stale:
            continue
        runs, table = runs_of(path), read_table(path, needs=(RUN,))
        rows_of_stale = int(table[RUN].isin(stale).sum())
        commands = ", ".join(f"`{command}`" for command in sorted({*runs.loc[stale, "command"]}))
        oldest = min(runs.loc[stale, "made"])
        rows.append((f"`{name}.csv`", f"{rows_of_stale} of {len(table)}", oldest, reason, commands))
    return rows


def expected_failures() -> list[tuple[str, ...]]:
    """Return a row for every table whose cheapest rows are known not to come out again."""
    return [(f"`{name}.csv`", reason) for name, reason in listed("STALE").items()]


def relaxed_scenes() -> list[tuple[str, ...]]:
    """Return a row for every set of limits that shipped scenes relax, with the number of scenes and one of them."""
    scenes = defaultdict(list)
    for name, scene in load_scenes().items():
        if wider := relaxed_limits(scene.gates):
            scenes[wider].append(name)
    return [(wider, str(len(names)), f"`{names[0]}`") for wider, names in sorted(scenes.items())]


TABLES = {
    "stale tables": (("table", "stale rows", "oldest of", "what moved since", "made by"), stale_tables),
    "expected failures": (("table", "what its cheapest rows miss"), expected_failures),
    "relaxed limits": (("limits", "scenes", "such as"), relaxed_scenes),
}
"""Head and rows of every table, by the name in the comments that it stands between."""


def markdown(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table, or a sentence if it has no rows."""
    if not rows:
        return "None."
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows))


def renewed(page: str) -> str:
    """Return the text of the page with its tables as they are now.

    Raises
    ------
    ValueError
        If the page has no place for one of them.
    """
    for name, (head, rows) in TABLES.items():
        begin, end = f"<!-- {name}: python docs/reference/anomalies.py -->", f"<!-- end of {name} -->"
        place = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        if not place.search(page):
            raise ValueError(
                f"{PAGE.name} has no lines {begin!r} and {end!r}: put them where the table belongs"
            )
        table = f"{begin}\n\n{markdown(head, rows())}\n\n{end}"
        page = place.sub(lambda _, table=table: table, page)
    return page


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
