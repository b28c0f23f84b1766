"""Newton's method."""

from __future__ import annotations

from typing import Literal

from knitstudy.study.keys import Section, key


class Newton(Section):
    """First number of increments, and tolerances."""

    increments: int = key(
        "a whole number from 1 to 10000",
        standing="choice",
        source="numerical; the first increment's share of the load, adapted on the way",
        checked="5, 12, 20 and 40: the same force to seven digits",
        ge=1,
        le=10_000,
    )

    residual_tolerance: float = key(
        "a number > 0 and <= 1e-2, relative to the mean internal force",
        standing="choice",
        source="numerical; of the mean internal force",
        checked="1e-6",
        gt=0,
        le=1e-2,
    )

    correction_tolerance: float = key(
        "a number > 0 and <= 1e-2, relative to the mesh size",
        standing="choice",
        source="numerical; of the element size",
        checked="1e-6",
        gt=0,
        le=1e-2,
    )


class SolidNewton(Newton):
    """The same of solids, with the linear solver; the viscosity `stabilisation` is relative to Young's modulus."""

    stabilisation: float = key(
        "a number from 0 to 1e6, times Young's modulus",
        unit="E",
        standing="assumed",
        source=(
            "section 2.2: static stabilisation, its size is not printed; none unless a scene asks for it"
        ),
        checked=(
            "0 to 1e-6, of one cell at 0.6 mm: force within 0.003 %; up to 1e-8 its work stays below "
            "2 % of the internal energy on the way"
        ),
        ge=0,
        le=1e6,
    )

    linear: Literal["auto", "three_scale", "amg", "lu"] = key(
        "auto, three_scale, amg or lu",
        standing="choice",
        source="numerical; no result depends on it",
        checked="auto",
    )


class HexahedralNewton(SolidNewton):
    """The same of hexahedra, with their `hourglass` coefficient, relative to the shear modulus."""

    hourglass: float = key(
        "a number > 0 and <= 1, times the shear modulus",
        unit="shear moduli",
        standing="assumed",
        source="Abaqus's default stiffness of C3D8R, 0.005 G",
        checked="0.0025 to 0.05: force -1.4 to +3.8 % (docs/sensitivity.md)",
        gt=0,
        le=1,
    )
