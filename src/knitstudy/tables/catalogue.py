"""All tables by name: what each holds, which results it needs, and how it is built.

A new table is a module with a function ``build(...) -> DataFrame`` and an entry here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from knitstudy.measures.catalogue import Entry, find, module_of, select
from knitstudy.measures.selection import COURSE, ISOTROPIC_COURSE, ISOTROPIC_WALE, TIED_COURSE, TIED_WALE

if TYPE_CHECKING:
    import pandas as pd

TABLES = {
    "rom_distance": Entry("Reduced models and their direct simulations", ("every", "scenes"), {}),
    "interactions": Entry(
        "Ties, rough contact and isotropic friction",
        ("tie", "rough", "isotropic", "geometry"),
        ISOTROPIC_COURSE,
    ),
    "table1_contact": Entry("Table 1: contact and friction", ("dns", "paper", "scenes"), ISOTROPIC_COURSE),
    "springs": Entry("Table 2 at a glance: springs", ("sprung_contacts", "paper", "scenes"), {}),
    "table2_springs": Entry(
        "Table 2: all springs that stand for contact", ("sprung_contacts", "paper", "scenes"), {}
    ),
    "table4_angles": Entry("Table 4: angles of the honeycomb's segments", ("contacts", "paper"), TIED_COURSE),
    "table5_cost": Entry("Table 5: cost of the models", ("every", "paper", "scenes"), {}),
    "beams": Entry("Beams in contact and solid yarns", ("every", "scenes"), {}),
    "responses": Entry("Every simulation of a knit", ("every", "scenes"), {}),
    "simulation": Entry(
        "What the direct simulations stand on: ties, course tension", ("dns", "scenes"), TIED_COURSE
    ),
    "simulation_contact": Entry(
        "What they stand on: friction, course tension",
        ("dns", "scenes"),
        ISOTROPIC_COURSE,
        module="simulation",
    ),
    "simulation_wale": Entry(
        "What they stand on: ties, wale tension", ("dns", "scenes"), TIED_WALE, module="simulation"
    ),
    "simulation_contact_wale": Entry(
        "What they stand on: friction, wale tension", ("dns", "scenes"), ISOTROPIC_WALE, module="simulation"
    ),
    "geometry": Entry("Unit cell before and after optimisation", ("geometry", "targets"), TIED_COURSE),
    "claims": Entry(
        "Claims of the paper and verdicts",
        ("geometry", "paper", "claims", "scenes", "every"),
        COURSE,
        (
            "tie",
            "rough",
            "isotropic",
            "untied",
            "isotropic_contacts",
            "untied_contacts",
            "frictions",
            "sprung_contacts",
        ),
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
