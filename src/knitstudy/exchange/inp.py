"""Keyword files (.inp) in the dialects of Abaqus and CalculiX."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.exchange.deck import ContactPair, Deck, Equations, Interaction, Step, Surface, TiedPair
from knitstudy.files.provenance import code_version
from knitstudy.files.replacing import replacing

NUMBER = "%.12e"
"""At most 19 characters: CalculiX reads no more than 20 of a number."""

ENTRIES_PER_LINE = 12

INTERACTION = "YARNS"
"""Name of the surface interaction of all contact pairs."""

ROUGH = 1e6
"""Friction coefficient that stands for rough contact in CalculiX, which has no word for it."""


class Abaqus:
    """Abaqus/Standard."""

    law = "Under NLGEOM *ELASTIC relates Cauchy stress and logarithmic strain."
    section_controls = ", CONTROLS=HOURGLASS"

    def controls(self) -> str:
        """Hourglass control by stiffness, with the default coefficient."""
        return "*SECTION CONTROLS, NAME=HOURGLASS, HOURGLASS=STIFFNESS\n"

    def tie(self, name: str, tolerance: float) -> str:
        """Line that opens a tie; every slave node meets the master facet under it, as in CalculiX."""
        return (
            f"*TIE, NAME={name}, TYPE=NODE TO SURFACE, ADJUST=YES, POSITION TOLERANCE={NUMBER % tolerance}\n"
        )

    def behaviour(self, interaction: Interaction) -> str:
        """Hard contact by a penalty, and friction by a stiffness; sliding is finite unless said otherwise."""
        law = interaction.law
        normal = f"*SURFACE BEHAVIOR, PENALTY=LINEAR\n{NUMBER % law.normal}\n"
        if math.isinf(law.friction):
            return normal + "*FRICTION, ROUGH\n"
        if law.friction == 0:
            return normal
        return (
            normal + f"*FRICTION, ELASTIC SLIP={NUMBER % interaction.elastic_slip}\n{NUMBER % law.friction}\n"
        )

    def steps(self, deck: Deck) -> tuple[Step, ...]:
        """Those of the deck."""
        return deck.steps

    def step(self, deck: Deck) -> str:
        """Parameters of every step; friction makes the tangent unsymmetric."""
        return ", UNSYMM=YES" if deck.contacts else ""

    def outputs(self, deck: Deck) -> str:
        """Energies and the total reaction of the driven set in every increment, fields at the end."""
        contact = "*CONTACT OUTPUT\nCSTRESS, CDISP\n" if deck.contacts else ""
        ending = "*OUTPUT, FIELD, NUMBER INTERVAL=1\n*NODE OUTPUT\nU, RF\n*ELEMENT OUTPUT\nS, LE\n" + contact
        always = "*OUTPUT, HISTORY, FREQUENCY=1\n*ENERGY OUTPUT\nALLIE, ALLSE, ALLAE, ALLWK, ALLFD\n"
        printed = f"*NODE PRINT, NSET={deck.driven}, TOTALS=YES, SUMMARY=NO\nRF\n"
        return (ending if deck.fields else "") + always + printed


class CalculiX:
    """CalculiX CrunchiX."""

    law = "Under NLGEOM *ELASTIC is St Venant-Kirchhoff's law in CalculiX."
    section_controls = ""

    def controls(self) -> str:
        """Nothing: the hourglass control of C3D8R is fixed."""
        return ""

    def tie(self, name: str, tolerance: float) -> str:
        """Line that opens a tie; slave nodes are moved onto the master unless that is switched off."""
        return f"*TIE, NAME={name}, POSITION TOLERANCE={NUMBER % tolerance}\n"

    def behaviour(self, interaction: Interaction) -> str:
        """Linear penalty and stick slope; the second number belongs to contact of nodes and must be positive."""
        law = interaction.law
        normal = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{NUMBER % law.normal}, 1.0\n"
        if law.friction == 0:
            return normal
        rough = math.isinf(law.friction)
        comment = "** Rough contact: no friction coefficient is that large, but see docs/calculix.md.\n"
        friction = f"*FRICTION\n{NUMBER % (ROUGH if rough else law.friction)}, {NUMBER % law.tangential}\n"
        return normal + (comment if rough else "") + friction

    def steps(self, deck: Deck) -> tuple[Step, ...]:
        """Those of the deck, with contact after a step in which nothing is driven.

        In the first step, and in no other, CalculiX takes what has penetrated at the beginning of an increment for
        an overlap of the mesh and lets it act in proportion to the time that has passed: contact pressures are too
        small until the step ends, and the more so the smaller the increments (docs/calculix.md).
        """
        if not (deck.contacts and deck.rests):
            return deck.steps
        still = tuple(replace(each, value=0.0) for each in deck.steps[0].prescribed)
        return (Step(still, 1), *deck.steps)

    def step(self, deck: Deck) -> str:
        """Nothing: it knows itself that friction makes the tangent unsymmetric."""
        return ""

    def outputs(self, deck: Deck) -> str:
        """Total reaction of the driven set, displacements and contact stresses, in every increment."""
        printed = f"*NODE PRINT, NSET={deck.driven}, TOTALS=ONLY\nRF\n"
        contact = "*CONTACT FILE\nCDIS, CSTR\n" if deck.contacts else ""
        return printed + ("*NODE FILE\nU\n" + contact if deck.fields else "")


DIALECTS: dict[str, Callable[[], Abaqus | CalculiX]] = {"abaqus": Abaqus, "calculix": CalculiX}


def write_inp(deck: Deck, path: Path | str, dialect: str) -> None:
    """Write a deck as a keyword file, whole or not at all.

    Parameters
    ----------
    deck : Deck
    path : Path or str
    dialect : {"abaqus", "calculix"}

    Raises
    ------
    ConfigurationError
        If the dialect is unknown.
    DataFileError
        If the file cannot be written.
    """
    if dialect not in DIALECTS:
        raise ConfigurationError(f"deck dialect: {dialect!r} is not allowed; one of {', '.join(DIALECTS)}")
    program = DIALECTS[dialect]()
    with replacing(path) as temporary, open(temporary, "w", encoding="ascii") as file:
        _write_heading(file, deck, program)
        _write_mesh(file, deck)
        _write_ties(file, deck, program)
        if deck.equations is not None:
            _write_equations(file, deck.equations)
        _write_material(file, deck, program)
        if deck.interaction is not None:
            _write_contacts(file, deck, program)
        for step in program.steps(deck):
            _write_step(file, deck, step, program)


def _write_heading(file: TextIO, deck: Deck, program: Abaqus | CalculiX) -> None:
    file.write(f"*HEADING\n{deck.title}\n")
    file.write(f"** knitstudy {code_version()}; m, N, Pa\n** {program.law}\n")


def _write_mesh(file: TextIO, deck: Deck) -> None:
    file.write("*NODE, NSET=ALL\n")
    number = np.arange(1, len(deck.nodes) + 1)
    np.savetxt(file, np.column_stack([number, deck.nodes]), fmt=["%d"] + 3 * [NUMBER], delimiter=", ")
    first = 1
    for name, corners in deck.elements.items():
        file.write(f"*ELEMENT, TYPE=C3D8R, ELSET={name}\n")
        number = np.arange(first, first + len(corners))
        np.savetxt(file, np.column_stack([number, corners + 1]), fmt="%d", delimiter=", ")
        first += len(corners)
    file.write("*ELSET, ELSET=SOLID\n" + "".join(f"{name}\n" for name in deck.elements))
    for name, nodes in deck.node_sets.items():
        file.write(f"*NSET, NSET={name}\n")
        file.writelines(_wrapped(nodes + 1))


def _write_ties(file: TextIO, deck: Deck, program: Abaqus | CalculiX) -> None:
    for pair in deck.ties:
        names = _write_surfaces(file, pair)
        file.write(program.tie(pair.name, pair.tolerance) + names)


def _write_contacts(file: TextIO, deck: Deck, program: Abaqus | CalculiX) -> None:
    names = [_write_surfaces(file, pair) for pair in deck.contacts]
    file.write(f"*SURFACE INTERACTION, NAME={INTERACTION}\n" + program.behaviour(deck.interaction))
    file.write(f"*CONTACT PAIR, INTERACTION={INTERACTION}, TYPE=SURFACE TO SURFACE\n" + "".join(names))


def _write_surfaces(file: TextIO, pair: TiedPair | ContactPair) -> str:
    """Write both surfaces of a pair; return the line that names slave and master."""
    names = {f"{pair.name}_SLAVE": pair.slave, f"{pair.name}_MASTER": pair.master}
    for name, surface in names.items():
        file.write(_surface(name, surface))
    return ", ".join(names) + "\n"


def _surface(name: str, surface: Surface) -> str:
    """Element sets, one for every face number that occurs, and the surface that they make up."""
    lines, faces = [], np.unique(surface.faces)
    for face in faces:
        lines.append(f"*ELSET, ELSET={name}_S{face}\n")
        lines.extend(_wrapped(surface.elements[surface.faces == face] + 1))
    lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
    lines.extend(f"{name}_S{face}, S{face}\n" for face in faces)
    return "".join(lines)


def _write_equations(file: TextIO, equations: Equations) -> None:
    """One equation for every slave and component; the slave's term comes first, which eliminates it."""
    nodes = np.column_stack([equations.slave, equations.master]) + 1  # (K, 5)
    factors = np.column_stack([-np.ones(len(nodes)), equations.weight])
    file.write("*EQUATION\n")
    for row, factor in zip(nodes.tolist(), factors.tolist(), strict=True):
        # A weight of zero would be a term that couples nothing.
        terms = [(node, value) for node, value in zip(row, factor, strict=True) if value]
        for component in (1, 2, 3):
            written = [f"{node}, {component}, {NUMBER % value}" for node, value in terms]
            file.write(f"{len(terms)}\n{', '.join(written[:4])}\n")
            file.writelines(f"{term}\n" for term in written[4:])


def _write_material(file: TextIO, deck: Deck, program: Abaqus | CalculiX) -> None:
    file.write("*MATERIAL, NAME=YARN\n*ELASTIC\n")
    file.write(f"{NUMBER % deck.youngs_modulus}, {NUMBER % deck.poisson_ratio}\n")
    file.write(program.controls())
    file.write(f"*SOLID SECTION, ELSET=SOLID, MATERIAL=YARN{program.section_controls}\n")


def _write_step(file: TextIO, deck: Deck, step: Step, program: Abaqus | CalculiX) -> None:
    direct = "" if deck.automatic else ", DIRECT"
    file.write(f"*STEP, NLGEOM, INC={100 * step.increments}{program.step(deck)}\n")
    if deck.tolerance is not None:
        file.write("*CONTROLS, PARAMETERS=FIELD, FIELD=DISPLACEMENT\n")
        file.write(f"{NUMBER % deck.tolerance}, {NUMBER % deck.tolerance}\n")
    # Whole numbers of time: increments of a rounded fraction would leave a last one of almost nothing.
    file.write(f"*STATIC{direct}\n1.0, {step.increments}.0\n*BOUNDARY\n")
    for item in step.prescribed:
        file.write(f"{item.node_set}, {item.first}, {item.last}, {NUMBER % item.value}\n")
    file.write(program.outputs(deck) + "*END STEP\n")


def _wrapped(numbers: np.ndarray) -> Iterator[str]:
    """Lines of at most ``ENTRIES_PER_LINE`` numbers."""
    texts = np.asarray(numbers).astype(str)
    for start in range(0, len(texts), ENTRIES_PER_LINE):
        yield ", ".join(texts[start : start + ENTRIES_PER_LINE]) + "\n"
