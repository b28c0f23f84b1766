"""Entries of figures and tables: what each shows and needs, and how one is found by its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.schema import unknown_choice

TIED_COURSE = {"interaction": "tie", "load.direction": "course"}
"""Scenes with ties, pulled in the course direction."""


@dataclass(frozen=True)
class Entry:
    """A figure or a table.

    Attributes
    ----------
    title : str
        With its number in the paper.
    needs : tuple of str
        What its function takes, by keyword: "geometry", "mesh", "dns", "contacts", "rom3d", "rom2d"; tables also
        files of reference.
    of : dict
        Which scenes it is about: values of keys of the scene.
    """

    title: str
    needs: tuple[str, ...]
    of: dict[str, str]


def find(kind: str, entries: Mapping[str, Entry], name: str) -> Entry:
    """Return the entry of a name; `kind` is what the message calls it.

    Raises
    ------
    ConfigurationError
        When there is none; the message names those that there are.
    """
    if name not in entries:
        raise ConfigurationError(unknown_choice(f"unknown {kind}", name, name, sorted(entries)))
    return entries[name]


def select(kind: str, entries: Mapping[str, Entry], name: str, sources: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the sources that an entry needs.

    Raises
    ------
    ConfigurationError
        When there is no such entry, or something that it needs is missing.
    """
    needs = find(kind, entries, name).needs
    missing = [need for need in needs if need not in sources]
    if missing:
        raise ConfigurationError(f"{kind} {name!r} needs {', '.join(needs)}: {', '.join(missing)} is missing")
    return {need: sources[need] for need in needs}
