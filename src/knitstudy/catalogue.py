"""Entries of figures and tables: what each shows and needs, and how one is found by its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice

FRICTION = 0.76
"""Coefficient of friction of Table 1: scenes with another one are variants."""

COURSE = {"specimen": "knit", "load.direction": "course"}
WALE = {"specimen": "knit", "load.direction": "wale"}
TIE = {"interaction": "tie"}
ROUGH = {"interaction": "rough"}
ISOTROPIC = {"interaction": "isotropic", "contact.friction": FRICTION}
OUTER_TIED = {"contact.tied_edges": "outer"}

TIED_COURSE, TIED_WALE = COURSE | TIE, WALE | TIE
"""Scenes with ties."""

ISOTROPIC_COURSE, ISOTROPIC_WALE = COURSE | ISOTROPIC | OUTER_TIED, WALE | ISOTROPIC | OUTER_TIED
"""Scenes with the friction of Table 1 and the ties of Fig. 3."""

CASES = {
    "tie_course": TIED_COURSE,
    "tie_wale": TIED_WALE,
    "isotropic_course": ISOTROPIC_COURSE,
    "isotropic_wale": ISOTROPIC_WALE,
}
"""The four cases that reduced models are compared in (Fig. 15)."""

MAIN_MODEL = {
    "rom.joint": "rigid",
    "rom.springs_from": None,
    "rom.springs": "averaged",
    "rom.stiffness": (),
    "rom.axes": "contact",
    "rom.displacement": "interface",
    "rom.section": "single",
}
"""What makes a reduced model the main one of its simulation: others are variants."""


VARIANTS = {
    "tie": TIE,
    "rough": ROUGH | OUTER_TIED,
    "isotropic": ISOTROPIC | OUTER_TIED,
    "untied": ISOTROPIC | {"contact.tied_edges": "none"},
}
"""Interactions that are compared with each other."""


@dataclass(frozen=True)
class Entry:
    """A figure or a table.

    Attributes
    ----------
    title : str
        With its number in the paper.
    needs : tuple of str
        What its function takes, by keyword: results by the names of `report.selection`, "scenes", and for tables
        files of reference.
    of : dict
        Which scenes it is about: values of keys of the scene.
    may : tuple of str
        What its function takes as well, where a study has it.
    module : str
        The module of its function, where several entries share one; otherwise that of its own name.
    """

    title: str
    needs: tuple[str, ...]
    of: dict[str, Any]
    may: tuple[str, ...] = ()
    module: str = ""


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


def module_of(kind: str, entries: Mapping[str, Entry], name: str) -> str:
    """Return the module that makes an entry.

    Raises
    ------
    ConfigurationError
        As `find`.
    """
    return find(kind, entries, name).module or name


def select(kind: str, entries: Mapping[str, Entry], name: str, sources: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the sources that an entry needs, and those that it may have.

    Raises
    ------
    ConfigurationError
        When there is no such entry, or something that it needs is missing.
    """
    entry = find(kind, entries, name)
    missing = [need for need in entry.needs if need not in sources]
    if missing:
        raise ConfigurationError(
            f"{kind} {name!r} needs {', '.join(entry.needs)}: {', '.join(missing)} is missing"
        )
    return {need: sources[need] for need in (*entry.needs, *entry.may) if need in sources}
