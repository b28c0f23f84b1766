"""Tables on the console: drawn in a terminal, tab-separated in a pipe."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import click
import yaml
from rich import box
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

ONE_LINE, LONGEST = 32, 120
"""Characters of a value that a terminal does not break, and that it shows at all."""


def open_standard_streams() -> None:
    """Put the null device where the shell has closed a standard stream (``knitstudy list >&-``).

    Otherwise the next file that is opened would be taken for it.
    """
    for descriptor, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, mode, encoding="utf-8", closefd=False))


def forget_output() -> None:
    """Send what is still to be printed nowhere: whoever read it has gone (``knitstudy list | head -1``)."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def print_table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print rows under the names of their columns."""
    texts = [[plain(value) for value in row] for row in rows]
    if not sys.stdout.isatty():
        click.echo("\n".join("\t".join(line) for line in (columns, *texts)))
        return
    heads = [
        Column(name, no_wrap=_longest(place, texts) <= ONE_LINE, overflow="fold")
        for place, name in enumerate(columns)
    ]
    table = Table(*heads, box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for line in texts:
        table.add_row(*(Text(shortened(text)) for text in line))
    Console().print(table)


def _longest(place: int, rows: list[list[str]]) -> int:
    """Return the length of the longest text in a column."""
    return max((len(row[place]) for row in rows), default=0)


def plain(value: Any) -> str:
    """Return a value as it would stand in the configuration; numbers with the digits that matter."""
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"{value:.6g}"
    return yaml.safe_dump(value, default_flow_style=True, width=float("inf")).removesuffix("\n...\n").strip()


def shortened(text: str) -> str:
    """Return a long text up to where a terminal still shows it."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."
