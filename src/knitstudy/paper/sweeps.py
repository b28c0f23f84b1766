"""Sweeps of course spacing and yarn diameter (Fig. 11): out-of-plane motion of knits and its uncertainty.

Scenes go by their names: "sweep-{hold}-{value}-{interaction}-course", with "-p3" or "-hexahedra" for other
discretisations. ``hold`` is the reading of the fixed quantity (``pattern.keep``); a value begins with c (course
spacing) or d (diameter). Without a value the loop has the drawn spacing and diameter; of the reading "shape", these are
the knits of Fig. 15. The relative error of a discretisation is known from the reference of the drawn loop and from
polynomials of the next degree at other loops; the largest one counts for all points.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import nan

import pandas as pd

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import SOLID_YARNS, discretisation, reference_of
from knitstudy.measures.response import LARGEST_U_Z, largest_out_of_plane
from knitstudy.run.catalogue import Datasets, Scenes, several

SPACING, DIAMETER = "pattern.course_ratio", "yarn.diameter"  # Keys that are swept
LETTER = {SPACING: "c", DIAMETER: "d"}
FRICTION = 0.76  # Coefficient of friction of Table 1
# Readings of the fixed quantity, in words; needles hold the wale spacing.
HELD = {"wale_spacing": "wale spacing held", "length": "yarn in a loop held", "shape": "drawn shape held"}

SWEPT = re.compile(r"sweep-(wale|length|shape)(?:-([cd])\d+)?-(tie|isotropic)-course(?:-(p3|hexahedra))?")
# Names of knits with the drawn loop by interaction, and the end of the names of sweeps with the same yarns.
DRAWN = {"yarns-{}-course": None, "yarns-{}-course-p3": "p3", "dns-{}-course": "hexahedra"}
KNITS = {name.format(kind): (kind, end) for kind in ("tie", "isotropic") for name, end in DRAWN.items()}

RESULTS = {"drawn": several("simulation", *KNITS), "sweeps": several("simulation", "sweep-*")}
"""Results that displays of the sweeps are made from."""

NEXT_DEGREE = "-p3"


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


def sweeps_of(key: str, histories: Datasets, scenes: Scenes, reference: pd.DataFrame) -> list[Sweep]:
    """Return the sweeps of a key in the order of `HELD`, each of two values or more; with knits of the drawn loop."""
    moved = {name: largest_out_of_plane(history) for name, history in histories.items()}
    errors: dict[tuple, list[float]] = {}
    groups: dict[tuple, list[Scene]] = {}
    for name in histories:
        kind, letter = _place(name)
        if kind is not None:
            errors.setdefault(kind, []).extend(_errors(scenes[name], moved, reference))
            if letter in (None, LETTER[key]):
                groups.setdefault((scenes[name].pattern.keep, *kind), []).append(scenes[name])
    sweeps, most = [], {}
    for (keep, *kind), group in groups.items():
        error = max(errors[tuple(kind)], default=nan)
        points = [
            Point(scene, scene.value(key), Estimate(moved[scene.name], error * moved[scene.name]))
            for scene in sorted(group, key=lambda scene: scene.value(key))
        ]
        if len(points) > 1:
            sweeps.append(Sweep(keep, kind[0], _made_of(group[0]), False, tuple(points)))
            most[keep, kind[0]] = max(most.get((keep, kind[0]), 0), len(points))
    marked = [
        replace(sweep, main=len(sweep.points) == most[sweep.keep, sweep.interaction]) for sweep in sweeps
    ]
    return sorted(marked, key=lambda sweep: (list(HELD).index(sweep.keep), not sweep.main))


def _place(name: str) -> tuple[tuple[str, str | None] | None, str | None]:
    """Return interaction and end of the name of a scene, None of other scenes, and the letter of the swept value."""
    if parts := SWEPT.fullmatch(name):
        return (parts[3], parts[4]), parts[2]
    return KNITS.get(name), None


def _errors(scene: Scene, moved: Mapping[str, float], reference: pd.DataFrame) -> Iterator[float]:
    """Yield the relative errors of u_z that are known."""
    true = reference_of(reference, scene).at(LARGEST_U_Z, scene.load.strain)
    if true.known:
        yield abs(moved[scene.name] / true.value - 1) + true.uncertainty / true.value
    if (finer := scene.name + NEXT_DEGREE) in moved:
        yield abs(moved[finer] / moved[scene.name] - 1)


def _made_of(scene: Scene) -> str:
    """Return the discretisation in words, with element sizes relative to the diameter."""
    if discretisation(scene) == SOLID_YARNS:
        return f"{SOLID_YARNS} of degree {scene.mesh.crossing_degree}"
    near = scene.value("mesh.refinement") or 1
    finer = f", {near:g} times finer at crossings" if near != 1 else ""
    return f"{discretisation(scene)}, {2 / scene.mesh.size:.3g} across{finer}"
