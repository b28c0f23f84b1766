"""CalculiX CrunchiX; what it computes for these words stands in docs/calculix.md."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from knitstudy.exchange.deck import Step
from knitstudy.exchange.dialects.dialect import (
    DIALECTS,
    NUMBER,
    Dialect,
    Element,
    Wording,
    Words,
    elastic,
    quadratic,
    small_strain_neo_hooke,
)

if TYPE_CHECKING:
    from knitstudy.exchange.deck import Deck, Interaction
    from knitstudy.mechanics.materials import Material

HOURGLASS = 0.008
"""Hourglass stiffness of C3D8R over (1 + nu) G: it is fixed, as 0.0005 E."""

ROUGH = 1e6
"""Friction coefficient that stands for rough contact, which CalculiX has no word for."""


def one_point(deck: Deck) -> Element:
    """C3D8R with the hourglass control that it has."""
    theirs = HOURGLASS * (1 + deck.material.poisson_ratio)
    return Element(
        "C3D8R",
        departures=(
            f"solver.hourglass is {deck.hourglass:g}, which CalculiX has no word for: the hourglass stiffness of its "
            f"C3D8R is {theirs:.5g} in the same measure, with other hourglass vectors (docs/calculix.md)",
        ),
    )


def hencky(material: Material) -> Wording:
    """*ELASTIC under NLGEOM, for want of the law."""
    return Wording(
        elastic(material),
        (
            "yarn.material is hencky, which CalculiX does not have: under NLGEOM *ELASTIC is St Venant-Kirchhoff's "
            "law there; equal to first order in strain, 3 % apart at 1 % of it",
        ),
    )


def st_venant_kirchhoff(material: Material) -> Wording:
    """*ELASTIC under NLGEOM, which is that law."""
    return Wording(elastic(material))


def _linear_contact(interaction: Interaction) -> str:
    # The second number belongs to contact of nodes and must be positive.
    return f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{NUMBER % interaction.law.normal}, 1.0\n"


def _friction(interaction: Interaction, coefficient: float) -> str:
    return f"*FRICTION\n{NUMBER % coefficient}, {NUMBER % interaction.law.tangential}\n"


def rough(interaction: Interaction) -> Wording:
    """Linear penalty, and a friction coefficient that no pressure gives way to."""
    return Wording(
        _linear_contact(interaction) + _friction(interaction, ROUGH),
        (
            f"interaction is rough, which CalculiX has no word for: a friction coefficient of {ROUGH:g} stands for it "
            "(docs/calculix.md)",
        ),
    )


def isotropic(interaction: Interaction) -> Wording:
    """Linear penalty, and Coulomb friction with a stick slope."""
    law = interaction.law
    friction = _friction(interaction, law.friction) if law.friction else ""
    return Wording(_linear_contact(interaction) + friction)


@DIALECTS.register
class CalculiX(Dialect):
    """CalculiX CrunchiX."""

    name = "calculix"
    program = "CalculiX"
    elements: ClassVar[Words] = {
        "one_point": one_point,
        "quadratic": quadratic,
    }
    materials: ClassVar[Words] = {
        "hencky": hencky,
        "neo_hookean": partial(small_strain_neo_hooke, program="CalculiX"),
        "st_venant_kirchhoff": st_venant_kirchhoff,
    }
    interactions: ClassVar[Words] = {"rough": rough, "isotropic": isotropic}

    def tie(self, name: str, tolerance: float) -> str:
        """Return the line that opens a tie; slave nodes are moved onto the master unless that is switched off."""
        return f"*TIE, NAME={name}, POSITION TOLERANCE={NUMBER % tolerance}\n"

    def steps(self, deck: Deck) -> tuple[Step, ...]:
        """Return those of the deck, with contact after a step in which nothing is driven.

        In the first step, and in no other, CalculiX takes what has penetrated at the beginning of an increment for
        an overlap of the mesh and lets it act in proportion to the time that has passed: contact pressures are too
        small until the step ends, and the more so the smaller the increments (docs/calculix.md).
        """
        if not (deck.contacts and deck.rests):
            return deck.steps
        still = tuple(replace(each, value=0.0) for each in deck.steps[0].prescribed)
        return (Step(still, 1), *deck.steps)

    def outputs(self, deck: Deck) -> str:
        """Ask for the total reaction of the driven set, displacements and contact stresses, in every increment."""
        reaction = f"*NODE PRINT, NSET={deck.driven}, TOTALS=ONLY\nRF\n"
        contact = "*CONTACT FILE\nCDIS, CSTR\n" if deck.contacts else ""
        return reaction + ("*NODE FILE\nU\n" + contact if deck.fields else "")
