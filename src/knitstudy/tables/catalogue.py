"""All tables by name: what each holds, which results it needs, and how it is built.

A new table is a module with a function ``build(...) -> DataFrame`` and an entry here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from knitstudy.catalogue import ISOTROPIC_COURSE, TIED_COURSE, Entry, find, module_of, select

if TYPE_CHECKING:
    import pandas as pd

TABLES = {
    "stiffness": Entry(
        "Stiffness and out-of-plane motion", ("dns", "rom3d", "rom2d", "geometry"), TIED_COURSE
    ),
    "interactions": Entry(
        "Ties, rough contact and isotropic friction",
        ("tie", "rough", "isotropic", "geometry"),
        ISOTROPIC_COURSE,
    ),
    "table1_contact": Entry("Table 1: contact and friction", ("dns", "paper", "scenes"), ISOTROPIC_COURSE),
    "table4_angles": Entry("Table 4: angles of the honeycomb's segments", ("contacts", "paper"), TIED_COURSE),
    "table5_cost": Entry(
        "Table 5: cost of the models", ("dns", "rom3d", "rom2d", "paper", "scenes"), TIED_COURSE
    ),
    "simulation": Entry("What the direct simulation stands on", ("dns", "scenes"), TIED_COURSE),
    "simulation_contact": Entry(
        "What the direct simulation with friction stands on", ("dns", "scenes"), ISOTROPIC_COURSE
    ),
    "geometry": Entry("Unit cell before and after optimisation", ("geometry", "targets"), TIED_COURSE),
    "claims": Entry(
        "Claims of the paper and verdicts",
        ("geometry", "dns", "rom3d", "rom2d", "paper", "claims", "scenes"),
        TIED_COURSE,
        ("tie", "rough", "isotropic", "untied", "isotropic_contacts", "untied_contacts", "frictions"),
    ),
}
"""In the order of the report. "paper", "claims" and "targets" are files of reference, "scenes" the scenes."""


def entry(name: str) -> Entry:
    """Return a table's entry.

    Raises
    ------
    ConfigurationError
        When there is no such table; the message names those that there are.
    """
    return find("table", TABLES, name)


def module(name: str) -> str:
    """Return the dotted name of the module that builds a table.

    Raises
    ------
    ConfigurationError
        When there is no such table.
    """
    return f"knitstudy.tables.{module_of('table', TABLES, name)}"


def build(name: str, **sources: Any) -> pd.DataFrame:
    """Build a table from what its entry names.

    Raises
    ------
    ConfigurationError
        When there is no such table, or something that it needs is missing.
    """
    needed = select("table", TABLES, name, sources)
    return import_module(module(name)).build(**needed)
