"""Committed tables say what made their rows, and whether the present physics would make them again.

A row of a table has the number of its run. ``runs.csv``, one for all tables of a folder, has a row for every run: the
groups of scenes behind it, the digest of their recorded numbers (`behaviour`), code, commit, day and command.
"""

from __future__ import annotations

import datetime
from collections.abc import Collection
from pathlib import Path

import pandas as pd

from knitstudy.datasets import commit, read_table, write_table
from knitstudy.errors import DataFileError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.behaviour import behaviour
from knitstudy.run.code_digest import physics_digest

RUN = "run"
"""Column of a committed table: the number of the run that made a row, in the order of the runs."""

COLUMNS = ("table", RUN, "groups", "behaviour", "code", "commit", "made", "command")
"""Columns of ``runs.csv``."""

SEPARATOR = "; "  # between groups


def runs_file(table: Path) -> Path:
    """Return the file that has the runs of a table: one for all of ``resources``, or one in the folder of the table."""
    table = table.resolve()
    return (RESOURCES if table.is_relative_to(RESOURCES) else table.parent) / "runs.csv"


def runs_of(table: Path) -> pd.DataFrame:
    """Return the runs behind a committed table, by their numbers."""
    runs = _all_runs(runs_file(table))
    return runs[runs["table"] == _name(table)].set_index(RUN)


def with_runs(path: Path) -> pd.DataFrame:
    """Return a committed table whose rows have the columns of their runs in place of the number."""
    return read_table(path, needs=(RUN,)).join(runs_of(path).drop(columns="table"), on=RUN).drop(columns=RUN)


def stale_runs(table: Path) -> list[int]:
    """Return the runs of a committed table that the present physics would give other numbers for.

    A run is judged by the behaviour of its groups; one that names no group by its code.
    """
    stale = []
    for number, run in runs_of(table).iterrows():
        if not run["groups"]:
            same = run["code"] == physics_digest()
        else:
            same = run["behaviour"] == behaviour(run["groups"].split(SEPARATOR))
        if not same:
            stale.append(number)
    return stale


def is_up_to_date(table: Path) -> bool:
    """Return whether a committed table is there, and the present physics would make all of its rows again."""
    return table.is_file() and len(runs_of(table)) > 0 and not stale_runs(table)


def require_up_to_date(table: Path) -> None:
    """Refuse a committed table that others are to be made from, where it is stale: they would count as fresh.

    Raises DataFileError, which names the command that makes the table.
    """
    if not is_up_to_date(table):
        commands = ", ".join(f"`{command}`" for command in sorted(set(runs_of(table)["command"])))
        raise DataFileError(f"{table}: is stale; run {commands or 'the command that makes it'} first")


def keep_table(
    table: pd.DataFrame,
    path: Path,
    command: str,
    groups: Collection[str] | pd.Series[str] = (),
    digits: int | None = None,
) -> pd.DataFrame:
    """Write a committed table, and its new run into the file of runs; return the table.

    Parameters
    ----------
    table : DataFrame
        Rows that have the number of a `RUN` are of that one; all others are of the new run.
    path : Path
        Of the table, in ``resources``.
    command : str
        That makes the table.
    groups : collection of str, or Series
        Groups of scenes that all new rows come from (`knitstudy.run.behaviour`), or the group of every row, in which
        case there is a run for every group. Without groups a table is of the very code that made it.
    digits : int, optional
        Significant digits of the numbers in the file, by default all.
    """
    known = runs_of(path)
    table = table.assign(**{RUN: table[RUN] if RUN in table else pd.NA}).astype({RUN: "Int64"})
    last = max(table[RUN].dropna(), default=0)
    new = table[RUN].isna()
    if not isinstance(groups, pd.Series):
        groups = pd.Series(SEPARATOR.join(sorted(groups)), table.index)
    entries = []
    for number, of in enumerate(sorted(set(groups[new])), last + 1):
        table.loc[new & (groups == of), RUN] = number
        entries.append(_entry(path, number, of, command))
    still = known[known.index.isin(table.loc[~new, RUN])]
    runs = pd.concat([still.reset_index(), pd.DataFrame(entries, columns=list(COLUMNS))])
    everything = _all_runs(runs_file(path))
    others = everything[everything["table"] != _name(path)]
    write_table(pd.concat([others, runs])[list(COLUMNS)].sort_values(["table", RUN]), runs_file(path))
    write_table(table, path, digits=digits)
    return table


def _entry(path: Path, number: int, groups: str, command: str) -> tuple[object, ...]:
    """Return the row of a new run."""
    recorded = behaviour(groups.split(SEPARATOR)) if groups else ""
    today = datetime.date.today().isoformat()
    return (_name(path), number, groups, recorded, physics_digest(), commit(), today, command)


def _name(table: Path) -> str:
    """Return the name of a table in the file of runs."""
    return table.resolve().relative_to(runs_file(table).parent).as_posix()


def _all_runs(path: Path) -> pd.DataFrame:
    if not path.is_file():
        return pd.DataFrame(columns=list(COLUMNS))
    runs = read_table(path, needs=COLUMNS)
    texts = ("groups", "behaviour")
    return runs.assign(**{name: runs[name].astype(object).fillna("") for name in texts})
