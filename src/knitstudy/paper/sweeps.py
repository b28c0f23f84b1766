"""Series of knits: sweeps of course spacing and yarn diameter (Fig. 11), and unknowns of square knits by their size.

Scenes of sweeps go by their names: "sweep-{hold}-{value}-{interaction}-course", with "-p3" or "-hexahedra" for other
discretisations. ``hold`` is the reading of the fixed quantity (``pattern.keep``); a value begins with c (course
spacing) or d (diameter). Without a value the loop has the drawn spacing and diameter; of the reading "shape", these are
the knits of Fig. 15. The relative error of a discretisation is known from the reference of the drawn loop and from
polynomials of the next degree at other loops; the largest one counts for all points.

Degrees of freedom of square knits (Tables 3 and 5) are counted without a solution, beside the paper's law of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import nan
from typing import Any

import pandas as pd
from numpy.polynomial import Polynomial

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.specimens import KNITS
from knitstudy.knit.mesh.mesher import slices_of
from knitstudy.knit.mesh.section import Section
from knitstudy.knit.models.rom2d.build import planar_network
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns.joints import contacts_of_crossings, joint_points
from knitstudy.knit.yarns.network import spatial_network
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import SOLID_YARNS, discretisation, reference_of
from knitstudy.measures.response import LARGEST_U_Z
from knitstudy.paper.cases import number
from knitstudy.paper.columns import U_Z, Rows, Simulation
from knitstudy.run.catalogue import several

SPACING, DIAMETER = "pattern.course_ratio", "yarn.diameter"  # Keys that are swept
LETTER = {SPACING: "c", DIAMETER: "d"}
FRICTION = 0.76  # Coefficient of friction of Table 1
# Readings of the fixed quantity, in words; needles hold the wale spacing.
HELD = {"wale_spacing": "wale spacing held", "length": "yarn in a loop held", "shape": "drawn shape held"}

SWEPT = re.compile(r"sweep-(wale|length|shape)(?:-([cd])\d+)?-(tie|isotropic)-course(?:-(p3|hexahedra))?")
# Names of knits with the drawn loop by interaction, and the end of the names of sweeps with the same yarns.
DRAWN = {"yarns-{}-course": None, "yarns-{}-course-p3": "p3", "dns-{}-course": "hexahedra"}
DRAWN_KNITS = {name.format(kind): (kind, end) for kind in ("tie", "isotropic") for name, end in DRAWN.items()}

RESULTS = {"drawn": several("simulation", *DRAWN_KNITS), "sweeps": several("simulation", "sweep-*")}
"""Results that displays of the sweeps are made from."""


@dataclass(frozen=True)
class Point:
    """One simulation of a sweep: scene, swept value, and the largest |u_z| at full load [m]."""

    scene: Scene
    value: float
    u_z: Estimate


@dataclass(frozen=True)
class Sweep:
    """Points of one reading, interaction and discretisation, in rising order of the swept value.

    It is a main one if no other sweep of this reading and interaction has more points.
    """

    keep: str
    interaction: str
    made_of: str
    main: bool
    points: tuple[Point, ...]


def sweeps_of(key: str, rows: Rows, reference: pd.DataFrame) -> list[Sweep]:
    """Return the sweeps of a key in the order of `HELD`, each of two values or more; with knits of the drawn loop."""
    errors: dict[tuple[Any, ...], list[float]] = {}
    groups: dict[tuple[Any, ...], list[Simulation]] = {}
    for name, row in rows.items():
        kind, letter = _place(name)
        if kind is not None and "simulation" in row.results:
            errors.setdefault(kind, []).extend(_errors(row, rows, reference))
            if letter in (None, LETTER[key]):
                groups.setdefault((row.scene.value("pattern.keep"), *kind), []).append(row)
    most: dict[tuple[Any, ...], int] = {}
    for (*held, _), group in groups.items():
        most[*held,] = max(most.get((*held,), 0), len(group))
    sweeps = []
    for (keep, kind, end), group in groups.items():
        error = max(errors[kind, end], default=nan)
        points = tuple(
            Point(row.scene, row.scene.value(key), Estimate(row[U_Z], error * row[U_Z]))
            for row in sorted(group, key=lambda row: row.scene.value(key))
        )
        if len(points) > 1:
            main = len(points) == most[keep, kind]
            sweeps.append(Sweep(keep, kind, _made_of(group[0].scene), main, points))
    return sorted(sweeps, key=lambda sweep: (list(HELD).index(sweep.keep), not sweep.main))


def _place(name: str) -> tuple[tuple[str, str | None] | None, str | None]:
    """Return interaction and end of the name of a scene, None of other scenes, and the letter of the swept value."""
    if parts := SWEPT.fullmatch(name):
        return (parts[3], parts[4]), parts[2]
    return DRAWN_KNITS.get(name), None


def _errors(row: Simulation, rows: Rows, reference: pd.DataFrame) -> Iterator[float]:
    """Yield the relative errors of u_z that are known."""
    true = reference_of(reference, row.scene).at(LARGEST_U_Z, row.scene.value("load.strain"))
    if true.known:
        yield abs(row[U_Z] / true.value - 1) + true.uncertainty / true.value
    finer = rows.get(f"{row.scene.name}-p3")  # of the next degree
    if finer is not None and "simulation" in finer.results:
        yield abs(finer[U_Z] / row[U_Z] - 1)


def _made_of(scene: Scene) -> str:
    """Return the discretisation in words, with element sizes relative to the diameter."""
    if discretisation(scene) == SOLID_YARNS:
        return f"{SOLID_YARNS} of degree {scene.value('mesh.crossing_degree')}"
    near = scene.value("mesh.refinement") or 1
    finer = f", {near:g} times finer at crossings" if near != 1 else ""
    return f"{discretisation(scene)}, {2 / scene.value('mesh.size'):.3g} across{finer}"


# ---- Degrees of freedom of square knits

SIZES = (3, 6, 8, 20, 30)  # cells in a row of Table 3
NONE = Polynomial([nan])


@dataclass(frozen=True)
class Counted:
    """A model of square knits of n cells in a row, with its degrees of freedom as polynomials of n."""

    name: str
    stem: str  # middle of the names of its scenes
    unknowns: Polynomial
    case: str  # of printed numbers, with a place for n
    # With three multipliers at every surface node of one yarn of each pair in contact
    multiplied: Polynomial
    law: Polynomial  # the paper's


def law_of(count: Callable[[Fabric], int], knit: Fabric) -> Polynomial:
    """Return the law a n^2 + b n of counts in knits of n x n cells like a given one, from n = 1 and n = 2."""
    assert knit.loop is not None, "a knit has a loop"
    more = knit.cells[1] - knit.cells[0]
    single, four = (count(KNITS[knit.specimen](knit.loop, n, n + more)) for n in (1, 2))
    return Polynomial([0.0, 2 * single - four / 2, four / 2 - single])


def nodes_2d(fabric: Fabric) -> int:
    """Return the number of nodes of the 2D network."""
    return planar_network(fabric, contacts_of_crossings(fabric)).beam_nodes


def nodes_3d(fabric: Fabric, size: float) -> int:
    """Return the number of nodes of the 3D network with elements of a size in yarn radii."""
    return spatial_network(fabric, joint_points(fabric, contacts_of_crossings(fabric)), size).beam_nodes


def counted_solids(knit: Fabric, scene: Scene, paper: pd.DataFrame) -> tuple[Counted, Counted]:
    """Return hexahedra with the mesh of a scene, tied and in contact, of knits like one of them.

    Counts are a n^2 + b n: n x n cells have n^2 times the yarn of a cell, in 3 n pieces. The paper's solver adds
    c n (n - 2) unknowns for the rows in contact; penalties add none.
    """
    section = Section.for_size(2, scene.value("mesh.size"))
    slices = law_of(
        lambda fabric: slices_of(fabric, scene.value("mesh.size"), scene.value("mesh.growth")), knit
    )
    touching, solid = Polynomial([0, -2, 1]), 3 * section.size * slices
    multiplied = solid + 3 * len(section.ring) * slices.coef[2] * touching
    tied = number(paper, "5", "dns-tie 3x3", "degrees of freedom") / 9 * Polynomial([0, 0, 1])
    contact = (number(paper, "3", "c3w3", "degrees of freedom") - tied(3)) / 3 * touching
    return (
        Counted("hexahedra, ties", "hexahedra-tie", solid, "dns-tie {n}x{n}", NONE, tied),
        Counted("hexahedra, contact", "hexahedra-isotropic", solid, "c{n}w{n}", multiplied, tied + contact),
    )


def counted_models(knit: Fabric, scene: Scene, paper: pd.DataFrame) -> tuple[Counted, ...]:
    """Return `counted_solids` and the networks with the paper's elements."""
    beam = number(paper, "5", "rom3d 3x3", "mesh size") / scene.yarn.radius
    spatial, planar = (6 * law_of(count, knit) for count in (lambda fabric: nodes_3d(fabric, beam), nodes_2d))
    return (
        *counted_solids(knit, scene, paper),
        Counted("3D network, ties", "rom3d-tie", spatial, "rom3d {n}x{n}", NONE, NONE),
        Counted("2D network, ties", "rom2d-tie", planar, "rom2d {n}x{n}", NONE, NONE),
    )
