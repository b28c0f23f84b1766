"""Table 1: contact and friction as the paper states them, and as they were used here."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.history_checks import allowed_penetration, penetration
from knitstudy.measures.paper_values import number
from knitstudy.measures.selection import ISOTROPIC_COURSE
from knitstudy.study.model_sections import SolidContact
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

NOT_SAID, NONE = "not said", "none"

STATED = ("stiffness ratio (contact / element)", "stick ratio (stick / element)", "friction coefficient")
"""Numbers of Table 1."""


@TABLES.add(
    "table1_contact",
    "Table 1: contact and friction",
    needs=("dns", "paper", "scenes"),
    of=ISOTROPIC_COURSE,
    order=3,
)
def tabulate(dns: xr.Dataset, paper: pd.DataFrame, scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return one property a row.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation with isotropic friction (see docs/files.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    scenes : mapping of str to Scene
        "dns" is read.
    """
    contact = scenes["dns"].contact
    ratio, stick, friction = (number(paper, "1", "contact", quantity) for quantity in STATED)
    relation, stiffness = _penalty(dns, contact) if "contact_stiffness" in dns.attrs else _indentation(dns)
    rows = [
        ("contact-overclosure relation", "1", "hard contact, by a penalty method", relation),
        ("contact stiffness over element stiffness", "1", ratio, stiffness.get("ratio", NONE)),
        ("contact stiffness, pressure over gap", "Pa/m", NOT_SAID, stiffness.get("normal", NONE)),
        ("modulus of the local indentation", "Pa", NONE, stiffness.get("modulus", NONE)),
        ("friction model", "1", "isotropic Coulomb", "isotropic Coulomb, convected slip"),
        ("stick stiffness over element stiffness", "1", stick, stiffness.get("stick ratio", NONE)),
        ("stick stiffness, traction over slip", "Pa/m", NOT_SAID, stiffness.get("stick", NONE)),
        (
            "stick over normal stiffness of the local indentation",
            "1",
            NONE,
            stiffness.get("stick over normal", NONE),
        ),
        ("friction coefficient", "1", friction, contact.friction),
        (
            "discretisation",
            "1",
            "surface to surface, finite sliding, master and slave chosen at random",
            "Gauss points to smooth surface, finite sliding, both ways with half the stiffness each",
        ),
        ("Gauss points a facet", "1", NOT_SAID, contact.points**2),
        ("deepest penetration or local indentation allowed", "m", NOT_SAID, allowed_penetration(dns)),
        ("deepest penetration or local indentation reached", "m", NOT_SAID, penetration(dns)),
        ("augmentations of an increment, at most", "1", NOT_SAID, dns["augmentations"].max().item()),
        ("stabilisation, viscosity over E", "1", "used, not said", scenes["dns"].solver.stabilisation),
    ]
    return pd.DataFrame(
        [(name, unit, _text(theirs), _text(ours)) for name, unit, theirs, ours in rows],
        columns=["property", "unit", "paper", "this study"],
    )


def _penalty(dns: xr.Dataset, contact: SolidContact) -> tuple[str, dict[str, float]]:
    return "penalty on smooth surfaces, augmented where penetration is too deep", {
        "ratio": contact.normal_stiffness,
        "normal": dns.attrs["contact_stiffness"],
        "stick ratio": contact.tangential_stiffness,
        "stick": dns.attrs["stick_stiffness"],
    }


def _indentation(dns: xr.Dataset) -> tuple[str, dict[str, float]]:
    return (
        "hard contact, in series with the local indentation that polynomials over the section do not show",
        {
            "modulus": dns.attrs["indentation_modulus"],
            "stick over normal": dns.attrs["stick_over_normal"],
        },
    )


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
