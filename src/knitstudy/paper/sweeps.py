"""Sweeps of course spacing and yarn diameter (Fig. 11).

Scenes of sweeps go by their names: "sweep-{hold}-{value}-{interaction}-course", with "-p3" or "-hexahedra" for other
discretisations. ``hold`` is the reading of the fixed quantity (``pattern.keep``); a value begins with c (course
spacing) or d (diameter). Without a value the loop has the drawn spacing and diameter; of the reading "shape", these are
the knits of Fig. 15. The relative error of a discretisation is known from the reference of the drawn loop and from
polynomials of the next degree at other loops; the largest one counts for all points.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import nan
from typing import Any

import pandas as pd

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import SOLID_YARNS, discretisation, reference_of, refined
from knitstudy.measures.response import LARGEST_U_Z
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
            sweeps.append(Sweep(keep, kind, _made_of(group[0].scene.value("mesh")), main, points))
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


def _made_of(mesh: Any) -> str:
    """Return the discretisation of a section ``mesh`` in words, with element sizes relative to the diameter."""
    if discretisation(mesh) == SOLID_YARNS:
        return f"{SOLID_YARNS} of degree {mesh.crossing_degree}"
    return f"{discretisation(mesh)}, {2 / mesh.size:.3g} across{refined(mesh)}"
