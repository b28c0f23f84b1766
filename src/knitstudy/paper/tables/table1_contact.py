"""Table 1: contact and friction as the paper states them, and as they were used here."""

from __future__ import annotations

import pandas as pd
import xarray as xr

from knitstudy.measures.response import allowed_penetration, penetration
from knitstudy.paper.paper_values import number
from knitstudy.run.catalogue import TABLES, Scenes, solid

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
def tabulate(dns: xr.Dataset, paper: pd.DataFrame, scenes: Scenes) -> pd.DataFrame:
    """Return one property a row."""
    contact, attrs = scenes["dns"].contact, dns.attrs
    ratio, stick, friction = (number(paper, "1", "contact", quantity) for quantity in STATED)
    by_penalty = "contact_stiffness" in attrs
    normal = contact.normal_stiffness if by_penalty else NONE
    tangential = contact.tangential_stiffness if by_penalty else NONE
    allowed, reached = allowed_penetration(dns), penetration(dns)
    stabilisation = scenes["dns"].solver.stabilisation
    rows = [
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
        ("Gauss points a facet", "1", NOT_STATED, contact.points**2),
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
