"""Keywords of Abaqus and CalculiX for the values of a scene's keys, in one table.

A value without an entry in the table is refused. An entry that says less than the scene, or something else, has a
departure: a sentence that the deck shows as a comment and the log as a warning.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from knitstudy.errors import ConfigurationError

if TYPE_CHECKING:
    from knitstudy.exchange.deck import Deck, Step

NUMBER = "%.12e"
"""At most 19 characters: CalculiX reads no more than 20 of a number."""

HOURGLASS_OF_C3D8R = {"abaqus": 0.005, "calculix": 0.008}
"""Hourglass stiffness over G in Abaqus at a scaling factor of 1; over (1 + nu) G in CalculiX, where it is fixed."""

ROUGH = 1e6
"""Friction coefficient that stands for rough contact in CalculiX."""


@dataclass(frozen=True)
class Keywords:
    """Templates of what a deck says for one value of a key, with numbers by name (`_numbers`)."""

    cards: str = ""  # keyword lines
    departure: str = ""  # how the cards differ from the scene
    element: str = ""  # type of an element
    section: str = ""  # parameters of the solid section

    def filled(self, numbers: dict[str, float]) -> Keywords:
        """Return the keywords with numbers in place of their names."""
        return replace(self, cards=self.cards.format(**numbers), departure=self.departure.format(**numbers))


E_NU = "*ELASTIC\n{E:.12e}, {nu:.12e}\n"

NEO_HOOKE = Keywords(
    "*HYPERELASTIC, NEO HOOKE\n{C10:.12e}, {D1:.12e}\n",
    "yarn.material is neo_hookean, G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2; the other program has "
    "C10 (J^(-2/3) tr C - 3) + (J - 1)^2 / D1 with the same G and K: equal to first order in strain",
)

HARD = "*SURFACE BEHAVIOR, PENALTY=LINEAR\n{normal:.12e}\n"

LINEAR = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{normal:.12e}, 1.0\n"
"""The second number belongs to contact of nodes and must be positive."""

TABLE: dict[tuple[str, str], dict[str, Keywords]] = {
    ("mesh.element", "one_point"): {
        "abaqus": Keywords(
            "*SECTION CONTROLS, NAME=HOURGLASS, HOURGLASS=STIFFNESS\n{hourglass_factor:.12e}\n",
            element="C3D8R",
            section=", CONTROLS=HOURGLASS",
        ),
        "calculix": Keywords(
            departure="solver.hourglass is {hourglass:g}, which CalculiX cannot set: the hourglass stiffness of its "
            "C3D8R is {hourglass_of_calculix:.5g} in the same measure, with other hourglass vectors (docs/decks.md)",
            element="C3D8R",
        ),
    },
    ("mesh.element", "quadratic"): dict.fromkeys(("abaqus", "calculix"), Keywords(element="C3D20R")),
    ("yarn.material", "hencky"): {
        "abaqus": Keywords(
            E_NU,
            "yarn.material is hencky: under NLGEOM *ELASTIC relates Cauchy stress and logarithmic strain in Abaqus, "
            "Hencky's law Kirchhoff stress (det F times Cauchy stress) and that strain; equal to first order in strain",
        ),
        "calculix": Keywords(
            E_NU,
            "yarn.material is hencky, which CalculiX does not have: under NLGEOM *ELASTIC is St Venant-Kirchhoff's "
            "law there; equal to first order in strain, 3 % apart at 1 % of it",
        ),
    },
    ("yarn.material", "neo_hookean"): dict.fromkeys(("abaqus", "calculix"), NEO_HOOKE),
    ("yarn.material", "st_venant_kirchhoff"): {
        "abaqus": Keywords(
            E_NU,
            "yarn.material is st_venant_kirchhoff, which Abaqus does not have: under NLGEOM *ELASTIC relates Cauchy "
            "stress and logarithmic strain; equal to first order in strain, 3 % apart at 1 % of it",
        ),
        "calculix": Keywords(E_NU),
    },
    ("interaction", "frictionless"): {"abaqus": Keywords(HARD), "calculix": Keywords(LINEAR)},
    ("interaction", "isotropic"): {
        "abaqus": Keywords(
            HARD + "*FRICTION, ELASTIC SLIP={elastic_slip:.12e}\n{friction:.12e}\n",
            "contact.tangential_stiffness: Abaqus sticks by mu p over an elastic slip, which gives the scene's "
            "stiffness at the pressure of the largest penetration alone",
        ),
        "calculix": Keywords(LINEAR + "*FRICTION\n{friction:.12e}, {tangential:.12e}\n"),
    },
    ("interaction", "rough"): {
        "abaqus": Keywords(HARD + "*FRICTION, ROUGH\n"),
        "calculix": Keywords(
            LINEAR + f"*FRICTION\n{ROUGH:.12e}, {{tangential:.12e}}\n",
            f"interaction is rough, which CalculiX does not have: a friction coefficient of {ROUGH:g} stands for it "
            "(docs/decks.md)",
        ),
    },
}
"""Keywords by key and value, then by dialect."""


def _abaqus_outputs(deck: Deck) -> str:
    """Ask for fields at the end, and for energies and the reaction of the driven set in every increment."""
    contact = "*CONTACT OUTPUT\nCSTRESS, CDISP\n" if deck.contacts else ""
    ending = "*OUTPUT, FIELD, NUMBER INTERVAL=1\n*NODE OUTPUT\nU, RF\n*ELEMENT OUTPUT\nS, LE\n" + contact
    always = "*OUTPUT, HISTORY, FREQUENCY=1\n*ENERGY OUTPUT\nALLIE, ALLSE, ALLAE, ALLWK, ALLFD\n"
    reaction = f"*NODE PRINT, NSET={deck.driven}, TOTALS=YES, SUMMARY=NO\nRF\n"
    return (ending if deck.fields else "") + always + reaction


def _calculix_outputs(deck: Deck) -> str:
    """Ask for the reaction of the driven set, displacements and contact stresses in every increment."""
    reaction = f"*NODE PRINT, NSET={deck.driven}, TOTALS=ONLY\nRF\n"
    contact = "*CONTACT FILE\nCDIS, CSTR\n" if deck.contacts else ""
    return reaction + ("*NODE FILE\nU\n" + contact if deck.fields else "")


DIALECTS: dict[str, Callable[[Deck], str]] = {"abaqus": _abaqus_outputs, "calculix": _calculix_outputs}
"""Cards that ask for results, by dialect."""


def keywords(deck: Deck, dialect: str) -> dict[str, Keywords]:
    """Return the keywords of a deck's element, material and interaction, by their keys.

    Raises ConfigurationError if the dialect is unknown, or the program does not have one of them.
    """
    if dialect not in DIALECTS:
        raise ConfigurationError(f"unknown deck dialect {dialect!r}; allowed are {', '.join(DIALECTS)}")
    values = {"mesh.element": deck.element, "yarn.material": deck.material.name}
    if deck.interaction is not None:
        values["interaction"] = deck.interaction.kind
    for key, value in values.items():
        if (key, value) not in TABLE:
            known = ", ".join(other for name, other in TABLE if name == key)
            raise ConfigurationError(f"{key} is {value!r}, which a deck cannot say; allowed are {known}")
    numbers = _numbers(deck)
    return {key: TABLE[key, value][dialect].filled(numbers) for key, value in values.items()}


def step_parameters(deck: Deck, dialect: str) -> str:
    """Return the parameters of every step: friction makes the tangent unsymmetric, which Abaqus must be told."""
    return ", UNSYMM=YES" if dialect == "abaqus" and deck.contacts else ""


def steps(deck: Deck, dialect: str) -> tuple[Step, ...]:
    """Return the steps of a deck, in CalculiX with contact after a step in which nothing is driven.

    In the first step CalculiX takes the penetration at the beginning of an increment for an overlap of the mesh, which
    acts in proportion to the time that has passed: contact pressures are too small until it ends (docs/decks.md).
    """
    if dialect != "calculix" or not (deck.contacts and deck.rests):
        return deck.steps
    first = deck.steps[0]
    still = tuple(replace(each, value=0.0) for each in first.prescribed)
    return (replace(first, prescribed=still, increments=1), *deck.steps)


def _numbers(deck: Deck) -> dict[str, float]:
    """Return the numbers of the templates: moduli [Pa], penalties [Pa/m], elastic slip [m], ratios."""
    material, touch = deck.material, deck.interaction
    bulk = material.lame + 2 / 3 * material.shear_modulus
    numbers = {
        "E": material.youngs_modulus,
        "nu": material.poisson_ratio,
        "C10": material.shear_modulus / 2,
        "D1": 2 / bulk,
        "hourglass": deck.hourglass,
        "hourglass_factor": deck.hourglass / HOURGLASS_OF_C3D8R["abaqus"],
        "hourglass_of_calculix": HOURGLASS_OF_C3D8R["calculix"] * (1 + material.poisson_ratio),
    }
    if touch is None:
        return numbers
    law = touch.law
    contact = {"normal": law.normal, "tangential": law.tangential, "friction": law.friction}
    return numbers | contact | {"elastic_slip": touch.elastic_slip}
