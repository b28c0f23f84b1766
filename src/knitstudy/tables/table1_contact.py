"""Table 1: contact and friction as the paper states them, and as they were used here."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.measures.penetration import penetration
from knitstudy.measures.printed import number
from knitstudy.measures.selection import ISOTROPIC_COURSE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

NOT_SAID = "not said"

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
        History of a direct simulation with isotropic friction (see docs/architecture.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    scenes : mapping of str to Scene
        "dns" is read.
    """
    scene = scenes["dns"]
    contact, stiffness = scene.contact, scene.yarn.youngs_modulus / scene.mesh.smallest
    ratio, stick, friction = (number(paper, "1", "contact", quantity) for quantity in STATED)
    rows = [
        (
            "contact-overclosure relation",
            "1",
            "hard contact, by a penalty method",
            "penalty on smooth surfaces, augmented where penetration is too deep",
        ),
        ("contact stiffness over element stiffness", "1", ratio, contact.normal_stiffness),
        ("contact stiffness, pressure over gap", "Pa/m", NOT_SAID, contact.normal_stiffness * stiffness),
        ("friction model", "1", "isotropic Coulomb", "isotropic Coulomb, convected slip"),
        ("stick stiffness over element stiffness", "1", stick, contact.tangential_stiffness),
        ("stick stiffness, traction over slip", "Pa/m", NOT_SAID, contact.tangential_stiffness * stiffness),
        ("friction coefficient", "1", friction, contact.friction),
        (
            "discretisation",
            "1",
            "surface to surface, finite sliding, master and slave chosen at random",
            "Gauss points to smooth surface, finite sliding, both ways with half the stiffness each",
        ),
        ("Gauss points a facet", "1", NOT_SAID, contact.points**2),
        ("largest penetration allowed over element size", "1", NOT_SAID, contact.penetration),
        (
            "largest penetration reached over element size",
            "1",
            NOT_SAID,
            penetration(dns) / scene.mesh.smallest,
        ),
        ("augmentations of an increment, at most", "1", NOT_SAID, dns["augmentations"].max().item()),
        ("stabilisation, viscosity over E", "1", "used, not said", scene.solver.stabilisation),
    ]
    return pd.DataFrame(
        [(name, unit, _text(theirs), _text(ours)) for name, unit, theirs, ours in rows],
        columns=["property", "unit", "paper", "this study"],
    )


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
