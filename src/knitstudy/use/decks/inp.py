"""Keywords of Abaqus and CalculiX for the values of a scene's keys, in one table.

A value without an entry in the table is refused. An entry that says less than the scene, or something else, has a
departure: a sentence that the deck shows as a comment and the log as a warning.
"""

from __future__ import annotations

import logging
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.datasets import code_version
from knitstudy.errors import ConfigurationError
from knitstudy.files import replacing
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.materials.isotropic import Isotropic
from knitstudy.registry import find
from knitstudy.use.decks.cell import cell_deck
from knitstudy.use.decks.deck import Deck, DeckStep, DeckSurface, specimen_deck

NUMBER = "%.12e"  # at most 19 characters: CalculiX reads no more than 20 of a number

# Hourglass stiffness over G in Abaqus at a scaling factor of 1; over (1 + nu) G in CalculiX, where it is fixed
HOURGLASS_OF_C3D8R = {"abaqus": 0.005, "calculix": 0.008}

ROUGH = 1e6  # friction coefficient that stands for rough contact in CalculiX


@dataclass(frozen=True)
class Keywords:
    """Templates of the keywords for one value of a key, with numbers by name (`_numbers`)."""

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

# The second number belongs to contact of nodes and must be positive.
LINEAR = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{normal:.12e}, 1.0\n"

# How contact in CalculiX differs from the scene (docs/notes/calculix.md)
FACETS = (
    "contact in CalculiX is of the faces of elements. Flat ones of linear elements touch before the load begins, and "
    "carry 5 to 30 % more at 5 % strain; quadratic ones are within 5 % there. Both carry more at small strains and "
    "large friction (docs/notes/calculix.md)"
)

# Keywords by key and value, then by dialect
TABLE: dict[tuple[str, str], dict[str, Keywords]] = {
    ("mesh.element", "one_point"): {
        "abaqus": Keywords(
            "*SECTION CONTROLS, NAME=HOURGLASS, HOURGLASS=STIFFNESS\n{hourglass_factor:.12e}\n",
            element="C3D8R",
            section=", CONTROLS=HOURGLASS",
        ),
        "calculix": Keywords(
            departure="solver.hourglass is {hourglass:g}, which CalculiX cannot set: the hourglass stiffness of its "
            "C3D8R is {hourglass_of_calculix:.5g} in the same measure, with other hourglass vectors (decks.md)",
            element="C3D8R",
        ),
    },
    ("mesh.element", "eight_point"): dict.fromkeys(("abaqus", "calculix"), Keywords(element="C3D8")),
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
        "calculix": Keywords(LINEAR + "*FRICTION\n{friction:.12e}, {tangential:.12e}\n", FACETS),
    },
    ("interaction", "rough"): {
        "abaqus": Keywords(HARD + "*FRICTION, ROUGH\n"),
        "calculix": Keywords(
            LINEAR + f"*FRICTION\n{ROUGH:.12e}, {{tangential:.12e}}\n",
            f"interaction is rough, which CalculiX does not have: a friction coefficient of {ROUGH:g} replaces it; "
            + FACETS,
        ),
    },
}

# Cards that ask for results, by dialect: energies and the reaction of the driven set in every increment; fields; and
# fields of yarns that touch
OUTPUTS = {
    "abaqus": (
        "*OUTPUT, HISTORY, FREQUENCY=1\n*ENERGY OUTPUT\nALLIE, ALLSE, ALLAE, ALLWK, ALLFD\n"
        "*NODE PRINT, NSET=DRIVEN, TOTALS=YES, SUMMARY=NO\nRF\n",
        "*OUTPUT, FIELD, NUMBER INTERVAL=1\n*NODE OUTPUT\nU, RF\n*ELEMENT OUTPUT\nS, LE\n",
        "*CONTACT OUTPUT\nCSTRESS, CDISP\n",
    ),
    "calculix": (
        "*NODE PRINT, NSET=DRIVEN, TOTALS=ONLY\nRF\n",
        "*NODE FILE\nU\n",
        "*CONTACT FILE\nCDIS, CSTR\n",
    ),
}


def keywords(deck: Deck, dialect: str) -> dict[str, Keywords]:
    """Return the keywords of a deck's element, material and interaction, by their keys.

    Raises ConfigurationError if the dialect is unknown, or the program does not have one of them.
    """
    find("deck dialect", OUTPUTS, dialect)
    values = {"mesh.element": deck.element, "yarn.material": deck.material.name}
    if deck.interaction is not None:
        values["interaction"] = deck.interaction.kind
    for key, value in values.items():
        if (key, value) not in TABLE:
            known = ", ".join(other for name, other in TABLE if name == key)
            raise ConfigurationError(f"{key} is {value!r}, which a deck cannot express; allowed are {known}")
    numbers = _template_numbers(deck)
    return {key: TABLE[key, value][dialect].filled(numbers) for key, value in values.items()}


def steps(deck: Deck, dialect: str) -> tuple[DeckStep, ...]:
    """Return the steps of a deck, in CalculiX with contact after a step in which nothing is driven.

    In the first step CalculiX takes the penetration at the beginning of an increment for an overlap of the mesh, which
    acts in proportion to the time that has passed: contact pressures are too small until it ends (decks.md).
    """
    if dialect != "calculix" or not deck.contacts:
        return deck.steps
    still = DeckStep(dict.fromkeys(deck.steps[0].moves, 0.0), increments=1)
    return (still, *deck.steps)


def _template_numbers(deck: Deck) -> dict[str, float]:
    """Return the numbers of the templates: moduli [Pa], penalties [Pa/m], elastic slip [m], ratios."""
    material, touch = deck.material, deck.interaction
    assert isinstance(material, Isotropic), "materials of the table are isotropic"
    bulk = material.lame + 2 / 3 * material.shear_modulus
    numbers: dict[str, float] = {
        "E": material.youngs_modulus,
        "nu": material.poisson_ratio,
        "C10": material.shear_modulus / 2,
        "D1": 2 / bulk,
        "hourglass": deck.hourglass,
        "hourglass_factor": deck.hourglass / HOURGLASS_OF_C3D8R["abaqus"],
        "hourglass_of_calculix": HOURGLASS_OF_C3D8R["calculix"] * (1 + material.poisson_ratio),
    }
    if touch is not None:
        numbers |= {name: float(getattr(touch.law, name)) for name in ("normal", "tangential", "friction")}
        numbers["elastic_slip"] = touch.elastic_slip
    return numbers


COMMENT = 120  # characters a line of comments; CalculiX reads 132

log = logging.getLogger(__name__)


def write_inp(deck: Deck, path: Path | str, dialect: str) -> None:
    """Write a deck as a keyword file of Abaqus or CalculiX, whole or not at all.

    Properties of the scene that keywords cannot express are comments in the file's head, and logged as warnings.
    Raises ConfigurationError if the dialect is unknown, or the program lacks the deck's element, material or
    interaction; DataFileError if the file cannot be written.
    """
    words = keywords(deck, dialect)
    departures = [*filter(None, (word.departure for word in words.values())), *deck.departures]
    with replacing(path) as temporary, open(temporary, "w", encoding="ascii") as file:
        file.writelines(_cards(deck, dialect, words, departures))
    for sentence in departures:
        log.warning("%s: not quite the scene: %s", path, sentence)


def _cards(deck: Deck, dialect: str, words: dict[str, Keywords], departures: list[str]) -> Iterator[str]:
    """Yield the cards of a deck with their data."""
    element, material = words["mesh.element"], words["yarn.material"]
    yield f"*HEADING\n{deck.title}\n** knitstudy {code_version()}; m, N, Pa\n"
    for sentence in departures:
        yield comment(f"NOT QUITE THE SCENE: {sentence}")
    yield from _nodes(deck)
    yield from _elements(deck, element)
    if deck.equations is not None or deck.jumps:
        yield "*EQUATION\n"
        yield from _terms(deck)
    yield f"*MATERIAL, NAME=YARN\n{material.cards}{element.cards}"
    yield f"*SOLID SECTION, ELSET=SOLID, MATERIAL=YARN{element.section}\n"
    yield from _contacts(deck, words)
    for step in steps(deck, dialect):
        yield _step(deck, step, dialect)


def _nodes(deck: Deck) -> Iterator[str]:
    yield "*NODE, NSET=ALL\n"
    for number, place in enumerate(deck.nodes.tolist(), 1):
        yield lines([number, *(NUMBER % x for x in place)])


def _elements(deck: Deck, element: Keywords) -> Iterator[str]:
    """Yield elements of solids, node sets, and springs."""
    first = 1
    for name, corners in deck.elements.items():
        yield f"*ELEMENT, TYPE={element.element}, ELSET={name}\n"
        for number, row in enumerate((corners + 1).tolist(), first):
            yield lines([number, *row], end=",\n")  # a comma where a line is continued
        first += len(corners)
    yield "*ELSET, ELSET=SOLID\n" + "".join(f"{name}\n" for name in deck.elements)
    for name, nodes in deck.node_sets.items():
        yield f"*NSET, NSET={name}\n" + lines(nodes + 1)
    for nodes, stiffness in deck.springs:
        for i in (1, 2, 3):
            yield f"*ELEMENT, TYPE=SPRING{nodes.shape[1]}, ELSET=SPRINGS{first}\n"
            yield from (lines([number, *row]) for number, row in enumerate((nodes + 1).tolist(), first))
            yield f"*SPRING, ELSET=SPRINGS{first}\n{lines(nodes.shape[1] * [i])}{NUMBER % stiffness}\n"
            first += len(nodes)


def _contacts(deck: Deck, words: dict[str, Keywords]) -> Iterator[str]:
    """Yield surfaces that touch, and how they act on each other."""
    for pair in deck.contacts:
        yield _surface(f"{pair.name}_SLAVE", pair.slave) + _surface(f"{pair.name}_MASTER", pair.master)
    if deck.interaction is not None:
        yield "*SURFACE INTERACTION, NAME=YARNS\n" + words["interaction"].cards
        yield "*CONTACT PAIR, INTERACTION=YARNS, TYPE=SURFACE TO SURFACE\n"
        yield "".join(f"{pair.name}_SLAVE, {pair.name}_MASTER\n" for pair in deck.contacts)


def lines(entries: Iterable[object], count: int = 12, end: str = "\n") -> str:
    """Return entries in lines of so many at most."""
    texts = [str(entry) for entry in entries]
    return end.join(", ".join(texts[i : i + count]) for i in range(0, len(texts), count)) + "\n"


def comment(text: str) -> str:
    """Return a text as lines of comments."""
    return "".join(f"** {line}\n" for line in textwrap.wrap(text, COMMENT, break_on_hyphens=False))


def _surface(name: str, surface: DeckSurface) -> str:
    """Return element sets, one for every face number that occurs, and the surface that they make up."""
    faces = np.unique(surface.faces)
    sets = (
        f"*ELSET, ELSET={name}_S{face}\n" + lines(surface.elements[surface.faces == face] + 1)
        for face in faces
    )
    parts = (f"{name}_S{face}, S{face}\n" for face in faces)
    return "".join([*sets, f"*SURFACE, NAME={name}, TYPE=ELEMENT\n", *parts])


def _terms(deck: Deck) -> Iterator[str]:
    """Yield an equation for every slave and component; the slave's term comes first, which eliminates it."""
    for slave, masters, weights in zip(*(deck.equations or ((), (), ())), strict=True):
        terms = [
            (slave, -1.0),
            *((node, value) for node, value in zip(masters, weights, strict=True) if value),
        ]
        for i in (1, 2, 3):
            yield _equation((node, i, value) for node, value in terms)
    for jump in deck.jumps:
        for slave, master in zip(jump.slave, jump.master, strict=True):
            for i, rate in enumerate(jump.rate, 1):
                driven = ((jump.driver, j, value) for j, value in enumerate(rate, 1) if value)
                yield _equation([(slave, i, -1.0), (master, i, 1.0), *driven])


def _equation(terms: Iterable[tuple[int, int, float]]) -> str:
    """Return an equation of terms: node from 0, component from 1, factor."""
    written = [f"{node + 1}, {component}, {NUMBER % value}" for node, component, value in terms]
    return f"{len(written)}\n" + lines(written, 4)


def _step(deck: Deck, step: DeckStep, dialect: str) -> str:
    # Friction makes the tangent unsymmetric, which Abaqus must be told.
    unsymmetric = ", UNSYMM=YES" if dialect == "abaqus" and deck.contacts else ""
    controls = ""
    if deck.tolerance is not None:
        number = NUMBER % deck.tolerance
        controls = f"*CONTROLS, PARAMETERS=FIELD, FIELD=DISPLACEMENT\n{number}, {number}\n"
    moves = (f"DRIVEN, {i}, {i}, {NUMBER % value}\n" for i, value in step.moves.items())
    outputs, fields, contact = OUTPUTS[dialect]
    if deck.fields:
        outputs += fields + (contact if deck.contacts else "")
    # Whole numbers of time: increments of a rounded fraction would leave a last one of almost nothing.
    static, sizes = ("*STATIC", ", 0.01, 1.0") if deck.halved else ("*STATIC, DIRECT", "")
    return (
        f"*STEP, NLGEOM, INC={100 * step.increments}{unsymmetric}\n{controls}{static}\n"
        f"1.0, {step.increments}.0{sizes}\n*BOUNDARY\nHELD, 1, 3, {NUMBER % 0.0}\n{''.join(moves)}{outputs}*END STEP\n"
    )


def write(
    scene: Any, path: Path | str, geometry: xr.Dataset, dialect: str, mesh: xr.Dataset | None = None
) -> int:
    """Write the deck of a scene of hexahedra, or of a cell of solid yarns in contact, and count its hexahedra.

    The `dialect` is "abaqus" or "calculix"; a cell has no `mesh` of its own.
    """
    fabric = fabric_of(geometry)
    deck = (
        specimen_deck(scene, fabric, SweptMesh.from_dataset(mesh))
        if mesh is not None
        else cell_deck(scene, fabric)
    )
    write_inp(deck, path, dialect)
    return sum(map(len, deck.elements.values()))


write_abaqus, write_calculix = (partial(write, dialect=dialect) for dialect in OUTPUTS)
