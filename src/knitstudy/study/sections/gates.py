"""Limits of what a run may leave wrong: beyond them it ends in one line (docs/gates.md)."""

from __future__ import annotations

from knitstudy.study.keys import Section, key


class Gates(Section):
    """Limits of every model."""

    ledger: float = key(
        "a number > 0, over the external work",
        standing="choice",
        source="every scene of the study stays below 0.035; pairs in 8 increments leave 0.14, docs/gates.md",
        checked="0.05",
        default=0.05,
        gt=0,
    )


class SolidGates(Gates):
    """Those of solids besides."""

    stabilisation: float = key(
        "a number >= 0, over the internal energy",
        standing="choice",
        source="5 % is the field's rule",
        checked="0.05",
        default=0.05,
        ge=0,
    )

    viscous_force: float = key(
        "a number >= 0, over the reaction of the driven side",
        standing="choice",
        source="forces are wrong by about as much, docs/gates.md",
        checked="0.05",
        default=0.05,
        ge=0,
    )


class HexahedralGates(SolidGates):
    """Those of hexahedra besides."""

    hourglass: float = key(
        "a number > 0, over the internal energy",
        standing="choice",
        source="5 % is the field's rule; at least the usual stiffness of 0.005 G is counted",
        checked="0.05: the study's scenes stay below 0.046",
        default=0.05,
        gt=0,
    )

    elements_across: float | None = key(
        "a number > 0 of elements of mesh.size across the yarn, or null for 3 of a knit and 7 of a pair",
        standing="choice",
        source="force of a tied knit +5 % at 3.3, of a pressed pair within 8 % from 8 on, docs/gates.md",
        checked="2 to 12",
        default=None,
        gt=0,
    )
