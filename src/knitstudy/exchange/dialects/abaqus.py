"""Abaqus/Standard."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, ClassVar

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

HOURGLASS = 0.005
"""Hourglass stiffness over shear modulus that a scaling factor of 1 stands for."""


def one_point(deck: Deck) -> Element:
    """C3D8R with hourglass control by stiffness, also where enhanced control is the default (hyperelastic laws)."""
    factor = NUMBER % (deck.hourglass / HOURGLASS)
    controls = f"*SECTION CONTROLS, NAME=HOURGLASS, HOURGLASS=STIFFNESS\n{factor}\n"
    return Element("C3D8R", controls, section=", CONTROLS=HOURGLASS")


def hencky(material: Material) -> Wording:
    """*ELASTIC under NLGEOM."""
    return Wording(
        elastic(material),
        (
            "yarn.material is hencky: under NLGEOM *ELASTIC relates Cauchy stress and logarithmic strain in Abaqus, "
            "Hencky's law Kirchhoff stress (det F times Cauchy stress) and that strain; equal to first order in strain",
        ),
    )


def st_venant_kirchhoff(material: Material) -> Wording:
    """*ELASTIC under NLGEOM, for want of the law."""
    return Wording(
        elastic(material),
        (
            "yarn.material is st_venant_kirchhoff, which Abaqus does not have: under NLGEOM *ELASTIC relates Cauchy "
            "stress and logarithmic strain; equal to first order in strain, 3 % apart at 1 % of it",
        ),
    )


def _hard_contact(interaction: Interaction) -> str:
    return f"*SURFACE BEHAVIOR, PENALTY=LINEAR\n{NUMBER % interaction.law.normal}\n"


def rough(interaction: Interaction) -> Wording:
    """Hard contact by a penalty, without slip."""
    return Wording(_hard_contact(interaction) + "*FRICTION, ROUGH\n")


def isotropic(interaction: Interaction) -> Wording:
    """Hard contact by a penalty, and Coulomb friction by an elastic slip; sliding is finite unless said otherwise."""
    law = interaction.law
    if law.friction == 0:
        return Wording(_hard_contact(interaction))
    slip = NUMBER % interaction.elastic_slip
    return Wording(
        f"{_hard_contact(interaction)}*FRICTION, ELASTIC SLIP={slip}\n{NUMBER % law.friction}\n",
        (
            "contact.tangential_stiffness: Abaqus sticks by mu p over an elastic slip, which gives the scene's "
            "stiffness at the pressure of the largest penetration alone",
        ),
    )


@DIALECTS.register
class Abaqus(Dialect):
    """Abaqus/Standard."""

    name = "abaqus"
    program = "Abaqus"
    elements: ClassVar[Words] = {
        "one_point": one_point,
        "quadratic": quadratic,
    }
    materials: ClassVar[Words] = {
        "hencky": hencky,
        "neo_hookean": partial(small_strain_neo_hooke, program="Abaqus"),
        "st_venant_kirchhoff": st_venant_kirchhoff,
    }
    interactions: ClassVar[Words] = {"rough": rough, "isotropic": isotropic}

    def tie(self, name: str, tolerance: float) -> str:
        """Return the line that opens a tie; every slave node meets the master facet under it, as in CalculiX."""
        return (
            f"*TIE, NAME={name}, TYPE=NODE TO SURFACE, ADJUST=YES, POSITION TOLERANCE={NUMBER % tolerance}\n"
        )

    def step(self, deck: Deck) -> str:
        """Return the parameters of every step; friction makes the tangent unsymmetric."""
        return ", UNSYMM=YES" if deck.contacts else ""

    def outputs(self, deck: Deck) -> str:
        """Ask for energies and the total reaction of the driven set in every increment, and for fields at the end."""
        contact = "*CONTACT OUTPUT\nCSTRESS, CDISP\n" if deck.contacts else ""
        ending = "*OUTPUT, FIELD, NUMBER INTERVAL=1\n*NODE OUTPUT\nU, RF\n*ELEMENT OUTPUT\nS, LE\n" + contact
        always = "*OUTPUT, HISTORY, FREQUENCY=1\n*ENERGY OUTPUT\nALLIE, ALLSE, ALLAE, ALLWK, ALLFD\n"
        reaction = f"*NODE PRINT, NSET={deck.driven}, TOTALS=YES, SUMMARY=NO\nRF\n"
        return (ending if deck.fields else "") + always + reaction
