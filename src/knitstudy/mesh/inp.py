"""Keyword files (.inp) in the dialects of Abaqus and CalculiX."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.io import code_version, replacing
from knitstudy.mesh.deck import Deck, Equations, Surface

NUMBER = "%.12e"
"""At most 19 characters: CalculiX reads no more than 20 of a number."""

ENTRIES_PER_LINE = 12


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

    def outputs(self, driven: str, fields: bool) -> str:
        """Energies and the total reaction of the driven set in every increment, fields at the end."""
        ending = "*OUTPUT, FIELD, NUMBER INTERVAL=1\n*NODE OUTPUT\nU, RF\n*ELEMENT OUTPUT\nS, LE\n"
        always = "*OUTPUT, HISTORY, FREQUENCY=1\n*ENERGY OUTPUT\nALLIE, ALLSE, ALLAE, ALLWK\n"
        return (
            (ending if fields else "") + always + f"*NODE PRINT, NSET={driven}, TOTALS=YES, SUMMARY=NO\nRF\n"
        )


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

    def outputs(self, driven: str, fields: bool) -> str:
        """Total reaction of the driven set, and displacements, in every increment."""
        return f"*NODE PRINT, NSET={driven}, TOTALS=ONLY\nRF\n" + ("*NODE FILE\nU\n" if fields else "")


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
        _write_step(file, deck, program)


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
        names = {f"{pair.name}_SLAVE": pair.slave, f"{pair.name}_MASTER": pair.master}
        for name, surface in names.items():
            file.write(_surface(name, surface))
        file.write(program.tie(pair.name, pair.tolerance))
        file.write(", ".join(names) + "\n")


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


def _write_step(file: TextIO, deck: Deck, program: Abaqus | CalculiX) -> None:
    direct = "" if deck.automatic else ", DIRECT"
    file.write(f"*STEP, NLGEOM, INC={100 * deck.increments}\n")
    if deck.tolerance is not None:
        file.write("*CONTROLS, PARAMETERS=FIELD, FIELD=DISPLACEMENT\n")
        file.write(f"{NUMBER % deck.tolerance}, {NUMBER % deck.tolerance}\n")
    # Whole numbers of time: increments of a rounded fraction would leave a last one of almost nothing.
    file.write(f"*STATIC{direct}\n1.0, {deck.increments}.0\n*BOUNDARY\n")
    for item in deck.prescribed:
        file.write(f"{item.node_set}, {item.first}, {item.last}, {NUMBER % item.value}\n")
    file.write(program.outputs(deck.driven, deck.fields))
    file.write("*END STEP\n")


def _wrapped(numbers: np.ndarray) -> Iterator[str]:
    """Lines of at most ``ENTRIES_PER_LINE`` numbers."""
    texts = np.asarray(numbers).astype(str)
    for start in range(0, len(texts), ENTRIES_PER_LINE):
        yield ", ".join(texts[start : start + ENTRIES_PER_LINE]) + "\n"
