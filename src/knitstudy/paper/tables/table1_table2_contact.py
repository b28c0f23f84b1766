"""Tables 1 and 2: contact and friction as the paper states them and as they were used here, and springs for contact."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.yarns.joints import AXES, MAIN, MEASURES, NORMALS, springs
from knitstudy.knit.yarns.solids import CONTACT_POINTS
from knitstudy.measures.response import allowed_penetration, penetration
from knitstudy.paper.cases import number
from knitstudy.paper.columns import Simulation, rows_of
from knitstudy.paper.scene_names import OTHER_SOLIDS, SOLIDS, of_cases, solid
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

NOT_STATED, NONE = "not stated", "none"
# Numbers of Table 1.
STATED = ("stiffness ratio (contact / element)", "stick ratio (stick / element)", "friction coefficient")

HARD = "hard contact, by a penalty method"
PENALTY = "penalty on smooth surfaces, augmented where penetration is too deep"
INDENTATION = (
    "hard contact, in series with the local indentation that polynomials over the section do not show"
)

OVER_NORMAL = "stick over normal stiffness of the local indentation"

MASTER_AND_SLAVE = "surface to surface, finite sliding, master and slave chosen at random"
BOTH_WAYS = "Gauss points to smooth surface, finite sliding, both ways with half the stiffness each"


@TABLES.add(
    "table1_contact",
    "Table 1: contact and friction",
    results={"dns": solid("simulation", "isotropic-course")},
    order=3,
)
def tabulate_contact(dns: xr.Dataset, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return one property a row."""
    contact = scenes["dns"].value("contact")
    attrs = dns.attrs
    ratio, stick, friction = (number(paper, "1", "contact", quantity) for quantity in STATED)
    by_penalty = "contact_stiffness" in attrs
    normal = contact.normal_stiffness if by_penalty else NONE
    tangential = contact.tangential_stiffness if by_penalty else NONE
    allowed, reached = allowed_penetration(dns), penetration(dns)
    stabilisation = scenes["dns"].value("solver.stabilisation")
    rows: list[tuple[str, str, Any, Any]] = [
        ("contact-overclosure relation", "1", HARD, PENALTY if by_penalty else INDENTATION),
        ("contact stiffness over element stiffness", "1", ratio, normal),
        ("contact stiffness, pressure over gap", "Pa/m", NOT_STATED, attrs.get("contact_stiffness", NONE)),
        ("modulus of the local indentation", "Pa", NONE, attrs.get("indentation_modulus", NONE)),
        ("friction model", "1", "isotropic Coulomb", "isotropic Coulomb, convected slip"),
        ("stick stiffness over element stiffness", "1", stick, tangential),
        ("stick stiffness, traction over slip", "Pa/m", NOT_STATED, attrs.get("stick_stiffness", NONE)),
        (OVER_NORMAL, "1", NONE, attrs.get("stick_over_normal", NONE)),
        ("friction coefficient", "1", friction, contact.friction),
        ("discretisation", "1", MASTER_AND_SLAVE, BOTH_WAYS),
        ("Gauss points a facet", "1", NOT_STATED, CONTACT_POINTS**2),
        ("deepest penetration or local indentation allowed", "m", NOT_STATED, allowed),
        ("deepest penetration or local indentation reached", "m", NOT_STATED, reached),
        ("augmentations of an increment, at most", "1", NOT_STATED, dns["augmentations"].max().item()),
        ("stabilisation, viscosity over E", "1", "used, not stated", stabilisation),
    ]
    return pd.DataFrame(
        [(name, unit, _text(theirs), _text(ours)) for name, unit, theirs, ours in rows],
        columns=["property", "unit", "paper", "this study"],
    )


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


# ---- Table 2: springs that stand for contact

# Names of the direct simulations with rough contact or friction.
TOUCHING = of_cases(
    ("rough-course", "rough-wale", "isotropic-course", "isotropic-wale"),
    (*SOLIDS, *OTHER_SOLIDS, "dns-{case}-penalty*", "*as-printed-*yarns-{case}"),
)

# Springs of reduced models: crossings count by their displacements
AVERAGED = "averaged, sum(F d) / sum(d d) [N/m]"
SECANTS = {  # Statistics of the secants of the crossings
    "mean of F / d [N/m]": "mean",
    "standard deviation of F / d [N/m]": "std",
    "smallest F / d [N/m]": "min",
    "largest F / d [N/m]": "max",
}

# Normals and axes of the springs: main normal along all axes, other normals along local axes.
READINGS = [(MAIN, axes) for axes in AXES] + [(normal, "local") for normal in NORMALS if normal != MAIN]
CONTACTS = {"contacts": several("contacts", *TOUCHING)}


@TABLES.add("table2_springs", "Table 2: all springs that stand for contact", results=CONTACTS, order=5)
def tabulate_springs(contacts: Datasets, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return one row a scene, displacement measure that it has recorded, normal, axes and axis.

    The paper does not say how it averages: its numbers may be the weighted average or the mean. Raises
    DataFileError if all crossings of a simulation are tied.
    """
    simulations = rows_of(scenes, {}, contacts=contacts).values()
    return pd.DataFrame([row for each in simulations for row in _rows(each, paper)])


def _rows(simulation: Simulation, paper: pd.DataFrame) -> Iterator[dict[str, Any]]:
    scene = simulation.scene
    contacts = simulation.results["contacts"]
    theirs = _printed(simulation, paper)
    measures = [measure for measure, variable in MEASURES.items() if variable in contacts]
    for measure, (normal, axes) in product(measures, READINGS):
        measured = springs(contacts, measure, axes, normal)
        secants = np.ma.masked_invalid(measured.stiffness)
        over = {name: np.ma.filled(getattr(secants, of)(axis=0), np.nan) for name, of in SECANTS.items()}
        for place, axis in enumerate("xyz"):
            yield {
                "scene": scene.name,
                "load": scene.value("load.direction"),
                "interaction": scene.interaction,
                "contact stiffness over E / h [1]": scene.value("contact.normal_stiffness"),
                "displacement": measure,
                "normal": normal,
                "axes": axes,
                "axis": axis,
                AVERAGED: measured.averaged[place],
                "paper [N/m]": theirs[place],
                "averaged, over the paper's [1]": measured.averaged[place] / theirs[place],
                **{name: values[place] for name, values in over.items()},
                "crossings [1]": measured.used[place],
                "negative [1]": measured.negative[place],
                "undefined [1]": measured.undefined[place],
                "open [1]": int(measured.open.sum()),
            }


def _printed(simulation: Simulation, paper: pd.DataFrame) -> list[float]:
    """Return the springs of Table 2 (3,) [N/m], which are of friction; refuse contacts that are all tied."""
    scene = simulation.scene
    if simulation.results["contacts"]["tied"].all():
        raise DataFileError(
            f"the contacts of {scene.name!r} are all tied: springs come from a scene of solid yarns with contact"
        )
    if scene.interaction != "isotropic":
        return [np.nan] * 3
    return [number(paper, "2", scene.value("load.direction"), f"spring stiffness k{axis}") for axis in "xyz"]
