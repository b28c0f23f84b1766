"""Sweeps of course spacing and yarn diameter (Fig. 11): out-of-plane motion of knits and its uncertainty.

Scenes go by their names: "sweep-{hold}-{value}-{interaction}-course", with "-p3" or "-hexahedra" for other
discretisations. ``hold`` is the reading of what is held fixed (``pattern.keep``); a value begins with c (course
spacing) or d (diameter). Without a value the loop has the drawn spacing and diameter; of the reading "shape", these are
the knits of Fig. 15. The relative error of a discretisation is known from the reference of the drawn loop and from
polynomials of the next degree at other loops; the largest one counts for all points.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import nan

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.geometry.lay_out import FOUND
from knitstudy.measures.catalogue import Datasets, Scenes
from knitstudy.measures.discretisation import SOLID_YARNS, discretisation
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import reference_of
from knitstudy.measures.response import LARGEST_U_Z, largest_out_of_plane
from knitstudy.study.scene import Scene

SPACING, DIAMETER = "pattern.course_ratio", "yarn.diameter"  # Keys that are swept
LETTER = {SPACING: "c", DIAMETER: "d"}
FRICTION = 0.76  # Coefficient of friction of Table 1

# Readings of what is held fixed, in words; needles hold the wale spacing.
HELD = {"wale_spacing": "wale spacing held", "length": "yarn in a loop held", "shape": "drawn shape held"}

SWEPT = re.compile(r"sweep-(wale|length|shape)(?:-([cd])\d+)?-(tie|isotropic)-course(?:-(p3|hexahedra))?")

# Names of the knits with the drawn loop by interaction, and the end of the names of sweeps with the same
# yarns.
DRAWN = {"yarns-{}-course": None, "yarns-{}-course-p3": "p3", "dns-{}-course": "hexahedra"}

NEXT_DEGREE = "-p3"
LOOPS = ("course ratio [1]", "yarn diameter [m]")  # Columns of the table of loops that are swept
NEEDED = ("held fixed", "outcome", *LOOPS)


@dataclass(frozen=True)
class Point:
    """One simulation of a sweep: scene, swept value, and the largest |u_z| at full load [m]."""

    scene: Scene
    value: float
    u_z: Estimate

    @property
    def over_diameter(self) -> Estimate:
        """The largest |u_z| over the yarn's diameter."""
        return self.u_z.of(lambda value: value / self.scene.yarn.diameter)


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
    errors = _relative_errors([scenes[name] for name in histories], moved, reference)
    groups: dict[tuple, list[Scene]] = {}
    for name in histories:
        place = _place(name)
        if place and place[-1] in (None, LETTER[key]):
            groups.setdefault((scenes[name].pattern.keep, *place[:-1]), []).append(scenes[name])
    found = []
    for (keep, interaction, end), group in groups.items():
        error = errors.get((interaction, end), nan)
        points = (
            Point(scene, scene.value(key), Estimate(moved[scene.name], error * moved[scene.name]))
            for scene in group
        )
        points = tuple(sorted(points, key=lambda point: point.value))
        if len(points) > 1:
            found.append(Sweep(keep, interaction, _made_of(group[0]), False, points))
    marked = [replace(each, main=len(each.points) == _most_points(found, each)) for each in found]
    return sorted(marked, key=lambda each: (list(HELD).index(each.keep), not each.main))


def _place(name: str) -> tuple[str, str | None, str | None] | None:
    """Return interaction, end of the name, and letter of the swept value of a scene; None of other scenes."""
    if parts := SWEPT.fullmatch(name):
        return parts[3], parts[4], parts[2]
    for interaction in ("tie", "isotropic"):
        for drawn, end in DRAWN.items():
            if name == drawn.format(interaction):
                return interaction, end, None
    return None


def _most_points(sweeps: Iterable[Sweep], like: Sweep) -> int:
    return max(
        len(each.points) for each in sweeps if (each.keep, each.interaction) == (like.keep, like.interaction)
    )


def _relative_errors(
    scenes: Iterable[Scene], moved: Mapping[str, float], reference: pd.DataFrame
) -> dict[tuple, float]:
    """Return the largest known relative error of u_z by interaction and end of the names of scenes."""
    errors: dict[tuple, float] = {}

    def include(interaction: str, end: str | None, error: float) -> None:
        errors[interaction, end] = max(errors.get((interaction, end), 0.0), error)

    for scene in scenes:
        place = _place(scene.name)
        if place is None:
            continue
        true = reference_of(reference, scene).at(LARGEST_U_Z, scene.load.strain)
        if true.known:
            off = abs(moved[scene.name] / true.value - 1) + true.uncertainty / true.value
            include(*place[:2], off)
        if (finer := scene.name + NEXT_DEGREE) in moved:
            include(*place[:2], abs(moved[finer] / moved[scene.name] - 1))
    return errors


def _made_of(scene: Scene) -> str:
    """Return the discretisation in words, with element sizes relative to the diameter."""
    if discretisation(scene) == SOLID_YARNS:
        return f"{SOLID_YARNS} of degree {scene.mesh.crossing_degree}"
    near = scene.value("mesh.refinement") or 1
    finer = f", {near:g} times finer at crossings" if near != 1 else ""
    return f"{discretisation(scene)}, {scene.yarn.diameter / scene.mesh.size:.3g} across{finer}"


def refused(loops: pd.DataFrame, column: str, scale: float) -> pd.DataFrame:
    """Return the loops that cannot be made along a sweep: ``held fixed``, and the swept value as ``at``.

    `loops` is ``resources/reference/loops.csv``; `column`, one of `LOOPS`, is swept, the other one as drawn.
    Raises DataFileError when a column is missing.
    """
    missing = [name for name in NEEDED if name not in loops]
    if missing:
        raise DataFileError(
            f"the table of loops has no column {missing[0]!r}; make it again with "
            "`python -m knitstudy.geometry.lay_out`"
        )
    (other,) = (name for name in LOOPS if name != column)
    along = loops[loops[other] == loops[other].mode()[0]]
    lost = along[along["outcome"] != FOUND]
    return pd.DataFrame({"held fixed": lost["held fixed"], "at": scale * lost[column]})
