"""Keyword files (.inp) in the dialects of Abaqus and CalculiX."""

from __future__ import annotations

import logging
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
import xarray as xr

from knitstudy.exchange.deck import ContactPair, Deck, Equations, Step, Surface, specimen_deck
from knitstudy.exchange.dialects.dialect import DIALECTS, NUMBER, Dialect, Element, Wording
from knitstudy.files import code_version, replacing
from knitstudy.geometry.lay_out import read_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.hexahedra import divide
from knitstudy.models.ties import tie_of
from knitstudy.study.scene import Scene

ENTRIES_PER_LINE = 12

COMMENT = 120
"""Characters a line of comments; CalculiX reads 132."""

INTERACTION = "YARNS"
"""Name of the surface interaction of all contact pairs."""

log = logging.getLogger(__name__)


def write_inp(deck: Deck, path: Path | str, dialect: str) -> None:
    """Write a deck as a keyword file, whole or not at all.

    What the dialect's words leave unsaid of the scene stands in the file's head as comments, and is logged as
    warnings.

    Parameters
    ----------
    deck : Deck
    path : Path or str
    dialect : str
        Name of a dialect: "abaqus" or "calculix".

    Raises
    ------
    ConfigurationError
        If the dialect is unknown, or has no word for the deck's element, material or interaction.
    DataFileError
        If the file cannot be written.
    """
    program = DIALECTS.find(dialect)()
    element, material = program.element(deck), program.material(deck.material)
    behaviour = Wording("") if deck.interaction is None else program.behaviour(deck.interaction)
    departures = (*element.departures, *material.departures, *behaviour.departures, *deck.departures)
    with replacing(path) as temporary, open(temporary, "w", encoding="ascii") as file:
        _write_heading(file, deck, departures)
        _write_mesh(file, deck, element)
        if deck.equations is not None:
            _write_equations(file, deck.equations)
        _write_section(file, material, element)
        if deck.interaction is not None:
            _write_contacts(file, deck, behaviour)
        for step in program.steps(deck):
            _write_step(file, deck, step, program)
    for sentence in departures:
        log.warning("%s: not quite the scene: %s", path, sentence)


def _write_heading(file: TextIO, deck: Deck, departures: tuple[str, ...]) -> None:
    file.write(f"*HEADING\n{deck.title}\n** knitstudy {code_version()}; m, N, Pa\n")
    for sentence in departures:
        lines = textwrap.wrap(f"NOT QUITE THE SCENE: {sentence}", COMMENT, break_on_hyphens=False)
        file.writelines(f"** {line}\n" for line in lines)


def _write_mesh(file: TextIO, deck: Deck, element: Element) -> None:
    file.write("*NODE, NSET=ALL\n")
    number = np.arange(1, len(deck.nodes) + 1)
    np.savetxt(file, np.column_stack([number, deck.nodes]), fmt=["%d"] + 3 * [NUMBER], delimiter=", ")
    first = 1
    for name, corners in deck.elements.items():
        file.write(f"*ELEMENT, TYPE={element.type}, ELSET={name}\n")
        number = np.arange(first, first + len(corners))
        np.savetxt(file, np.column_stack([number, corners + 1]), fmt=_numbers(1 + corners.shape[1]))
        first += len(corners)
    file.write("*ELSET, ELSET=SOLID\n" + "".join(f"{name}\n" for name in deck.elements))
    for name, nodes in deck.node_sets.items():
        file.write(f"*NSET, NSET={name}\n")
        file.writelines(_wrapped(nodes + 1))


def _write_contacts(file: TextIO, deck: Deck, behaviour: Wording) -> None:
    names = [_write_surfaces(file, pair) for pair in deck.contacts]
    file.write(f"*SURFACE INTERACTION, NAME={INTERACTION}\n" + behaviour.cards)
    file.write(f"*CONTACT PAIR, INTERACTION={INTERACTION}, TYPE=SURFACE TO SURFACE\n" + "".join(names))


def _write_surfaces(file: TextIO, pair: ContactPair) -> str:
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
    nodes = np.column_stack([equations.slave, equations.master]) + 1  # (K, 1 + c)
    factors = np.column_stack([-np.ones(len(nodes)), equations.weight])
    file.write("*EQUATION\n")
    for row, factor in zip(nodes.tolist(), factors.tolist(), strict=True):
        # A weight of zero would be a term that couples nothing.
        terms = [(node, value) for node, value in zip(row, factor, strict=True) if value]
        for component in (1, 2, 3):
            written = [f"{node}, {component}, {NUMBER % value}" for node, value in terms]
            file.write(f"{len(terms)}\n")
            file.writelines(f"{', '.join(written[i : i + 4])}\n" for i in range(0, len(written), 4))


def _write_section(file: TextIO, material: Wording, element: Element) -> None:
    file.write(f"*MATERIAL, NAME=YARN\n{material.cards}{element.controls}")
    file.write(f"*SOLID SECTION, ELSET=SOLID, MATERIAL=YARN{element.section}\n")


def _write_step(file: TextIO, deck: Deck, step: Step, dialect: Dialect) -> None:
    file.write(f"*STEP, NLGEOM, INC={100 * step.increments}{dialect.step(deck)}\n")
    if deck.tolerance is not None:
        file.write("*CONTROLS, PARAMETERS=FIELD, FIELD=DISPLACEMENT\n")
        file.write(f"{NUMBER % deck.tolerance}, {NUMBER % deck.tolerance}\n")
    # Whole numbers of time: increments of a rounded fraction would leave a last one of almost nothing.
    file.write(f"*STATIC, DIRECT\n1.0, {step.increments}.0\n*BOUNDARY\n")
    for item in step.prescribed:
        file.write(f"{item.node_set}, {item.first}, {item.last}, {NUMBER % item.value}\n")
    file.write(dialect.outputs(deck) + "*END STEP\n")


def _numbers(count: int) -> str:
    """Format of ``count`` numbers, a comma at the end of every line that another one continues."""
    return ",\n".join(
        ", ".join(["%d"] * min(ENTRIES_PER_LINE, count - start))
        for start in range(0, count, ENTRIES_PER_LINE)
    )


def _wrapped(numbers: np.ndarray) -> Iterator[str]:
    """Lines of at most ``ENTRIES_PER_LINE`` numbers."""
    texts = np.asarray(numbers).astype(str)
    for start in range(0, len(texts), ENTRIES_PER_LINE):
        yield ", ".join(texts[start : start + ENTRIES_PER_LINE]) + "\n"


# ---- The deck of a scene, as a stage leaves it


def write_abaqus(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the deck of a scene for Abaqus."""
    _write(scene, path, geometry, mesh, "abaqus")


def write_calculix(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset) -> None:
    """Write the deck of a scene for CalculiX."""
    _write(scene, path, geometry, mesh, "calculix")


def _write(scene: Scene, path: Path | str, geometry: xr.Dataset, mesh: xr.Dataset, dialect: str) -> None:
    specimen, swept = read_specimen(geometry), SweptMesh.from_dataset(mesh)
    tie = tie_of(scene, divide(scene, swept, specimen), specimen)
    write_inp(specimen_deck(scene, specimen, swept, tie), path, dialect)
