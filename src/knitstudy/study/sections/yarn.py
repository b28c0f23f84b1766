"""What yarns are made of."""

from __future__ import annotations

from pydantic import field_validator

from knitstudy.mechanics.materials import LAWS
from knitstudy.study.keys import LONGEST, Section, key, registered


class Yarn(Section):
    """Circular yarn of one isotropic material."""

    diameter: float = key(
        "a number > 0 and <= 1e6, in m",
        unit="m",
        standing="inferred",
        source=(
            "63,171 nodes at 0.3 mm (Table 5) over 0.5 m of yarn are about 38 nodes a section: 6 "
            "elements of 0.3 mm across"
        ),
        checked="1.8 mm",
        gt=0,
        le=LONGEST,
    )

    youngs_modulus: float = key(
        "a number > 0 and <= 1e20, in Pa",
        unit="Pa",
        standing="inferred",
        source=(
            "data sheet of the polypropylene that the paper cites: homopolymer 1.30 GPa, copolymer 1.10 GPa"
        ),
        checked="1.30 GPa; forces are proportional to it, 1.1 to 1.5 GPa need no run of their own",
        gt=0,
        le=1e20,
    )

    poisson_ratio: float = key(
        "a number between -1 and 0.5 (both excluded)",
        standing="inferred",
        source="the same data sheet",
        checked="0.42",
        gt=-1,
        lt=0.5,
    )

    density: float = key(
        "a number > 0 and <= 1e6, in kg/m3",
        unit="kg/m3",
        standing="inferred",
        source="the same data sheet; no quasi-static result depends on it",
        checked="905",
        gt=0,
        le=1e6,
    )

    material: str = key(
        LAWS.allowed,
        standing="assumed",
        source=(
            "isotropic polypropylene (section 2.3) with geometric nonlinearity; Hencky is what Abaqus"
            " computes then"
        ),
        checked="all three laws: force +1.2 % at most (docs/sensitivity.md)",
    )

    @field_validator("material")
    @classmethod
    def _is_registered(cls, value: str) -> str:
        return registered(value, LAWS.names())

    @property
    def radius(self) -> float:
        """Yarn radius in m."""
        return self.diameter / 2
