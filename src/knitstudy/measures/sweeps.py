"""Sweeps of course spacing and yarn diameter (Fig. 11): how far knits move out of their plane, and how certain that is.

A series is of one reading of what is held fixed (``pattern.keep``), one interaction and one discretisation. Its
points are off by what their discretisation is, as far as that is known: from the reference of the loop as it is drawn,
and from polynomials of the next degree at other loops; the largest relative error found counts for all points.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import nan
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.geometry.lay_out import FOUND
from knitstudy.measures.discretisation import SOLID_YARNS, discretisation, is_direct
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import reference_of
from knitstudy.measures.response import LARGEST_U_Z, largest_out_of_plane
from knitstudy.study.scene import Scene, digest

SPACING, DIAMETER = "pattern.course_ratio", "yarn.diameter"
"""Keys that are swept."""

BESIDE = (
    "pattern.loops",
    "pattern.rows",
    "pattern.clearance",
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
)
"""Keys that no sweep changes."""

FRICTION = 0.76
"""Coefficient of friction of Table 1."""

HELD = {"wale_spacing": "wale spacing held", "length": "yarn in a loop held", "shape": "drawn shape held"}
"""Readings of what is held fixed, in words, the one that needles give first."""


@dataclass(frozen=True)
class Point:
    """One simulation of a sweep: its scene, the swept value, and the largest |u_z| at the end [m]."""

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

    Attributes
    ----------
    keep, interaction : str
    made_of : str
        Of what the yarns are made.
    main : bool
        Whether no other series of that reading and interaction has more points.
    points : tuple of Point
    """

    keep: str
    interaction: str
    made_of: str
    main: bool
    points: tuple[Point, ...]


def swept(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the scenes of all sweeps, and those of the same discretisations with the loop as it is drawn."""
    scenes = [scene for scene in scenes if _may_be_swept(scene)]
    inside = {
        scene.name for key in (SPACING, DIAMETER) for found in groups(scenes, key) for scene in found.values()
    }
    discretisations = {_numerical(scene) for scene in scenes if scene.name in inside}
    return [
        scene
        for scene in scenes
        if scene.name in inside or (_is_as_drawn(scene) and _numerical(scene) in discretisations)
    ]


def groups(scenes: Iterable[Scene], key: str) -> list[dict[float, Scene]]:
    """Return scenes that differ in one key and in nothing else that moves them, by its values in rising order.

    Parameters
    ----------
    scenes : iterable of Scene
        Direct simulations of knits in course tension; of equal ones the first is taken.
    key : str
        `SPACING` or `DIAMETER`.
    """
    found: dict[tuple, dict[float, Scene]] = {}
    for scene in scenes:
        other = scene.value(DIAMETER if key == SPACING else SPACING)
        alike = (_numerical(scene), scene.pattern.keep, scene.geometry.free, other)
        found.setdefault(alike, {}).setdefault(scene.value(key), scene)
    return [dict(sorted(values.items())) for values in found.values() if len(values) > 1]


def sweeps_of(
    key: str, histories: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> list[Sweep]:
    """Return the series of a sweep in the order of `HELD`.

    Parameters
    ----------
    key : str
        `SPACING` or `DIAMETER`.
    histories : mapping of str to Dataset
        Of the scenes that `swept` returns, by name.
    scenes : mapping of str to Scene
        Their scenes.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    known = [scenes[name] for name in histories]
    moved = {name: largest_out_of_plane(history) for name, history in histories.items()}
    errors = _relative_errors(known, moved, reference)
    found = []
    for values in groups(known, key):
        first = next(iter(values.values()))
        error = errors.get(_numerical(first), nan)
        points = tuple(
            Point(scene, value, Estimate(moved[scene.name], error * moved[scene.name]))
            for value, scene in values.items()
        )
        found.append(Sweep(first.pattern.keep, first.interaction, _made_of(first), False, points))
    most = {}
    for each in found:
        alike = (each.keep, each.interaction)
        most[alike] = max(most.get(alike, 0), len(each.points))
    marked = [
        Sweep(s.keep, s.interaction, s.made_of, len(s.points) == most[s.keep, s.interaction], s.points)
        for s in found
    ]
    return sorted(marked, key=lambda each: (list(HELD).index(each.keep), not each.main))


def _relative_errors(
    scenes: list[Scene], moved: Mapping[str, float], reference: pd.DataFrame
) -> dict[tuple, float]:
    """Return the largest relative error of u_z that is known of every discretisation and interaction."""
    errors: dict[tuple, float] = {}
    by_geometry: dict[tuple, list[Scene]] = {}
    for scene in scenes:
        true = reference_of(reference, scene).at(LARGEST_U_Z, scene.load.strain)
        if true.known:
            off = abs(moved[scene.name] / true.value - 1) + true.uncertainty / true.value
            _raise(errors, scene, off)
        if discretisation(scene) == SOLID_YARNS:
            by_geometry.setdefault((scene.interaction, scene.geometry_key), []).append(scene)
    for alike in by_geometry.values():
        *coarser, finest = sorted(alike, key=lambda scene: scene.mesh.crossing_degree)
        for scene in coarser:
            if scene.mesh.crossing_degree < finest.mesh.crossing_degree:
                _raise(errors, scene, abs(moved[finest.name] / moved[scene.name] - 1))
    return errors


def _raise(errors: dict[tuple, float], scene: Scene, error: float) -> None:
    errors[_numerical(scene)] = max(errors.get(_numerical(scene), 0.0), error)


def _may_be_swept(scene: Scene) -> bool:
    """Whether a scene is a direct simulation of a knit as in Fig. 11: in course tension, tied or with friction."""
    return (
        scene.specimen == "knit"
        and is_direct(scene)
        and scene.load.direction == "course"
        and scene.interaction in ("tie", "isotropic")
        and scene.value("contact.friction") in (FRICTION, None)
        and scene.value("contact.tied_edges") in ("outer", None)
    )


def _is_as_drawn(scene: Scene) -> bool:
    return scene.value(SPACING) == 1 and scene.pattern.keep == "shape"


def _numerical(scene: Scene) -> tuple[Any, ...]:
    """Return what simulations share beside the loop: yarn, interaction, size, load, and elements across or degrees."""
    section = scene.read(("interaction", "load", "tie", "contact", *BESIDE))
    section["load"].pop("stops", None)
    return _made_of(scene), scene.interaction, digest(section)


def _made_of(scene: Scene) -> str:
    """Return what yarns are made of: elements in sizes that go with the diameter."""
    if discretisation(scene) == SOLID_YARNS:
        return f"{SOLID_YARNS} of degree {scene.mesh.crossing_degree}"
    near = scene.value("mesh.refinement") or 1
    finer = f", {near:g} times finer at crossings" if near != 1 else ""
    return f"{discretisation(scene)}, {scene.yarn.diameter / scene.mesh.size:.3g} across{finer}"


# ---- Loops that cannot be made, from the kept table of `knitstudy.geometry.lay_out`


SWEPT = ("course ratio [1]", "yarn diameter [m]")
NEEDED = ("held fixed", "outcome", *SWEPT)


def refused(loops: pd.DataFrame, column: str, scale: float) -> pd.DataFrame:
    """Return the loops that cannot be made along one sweep: what is held fixed, and the swept value as ``at``.

    Parameters
    ----------
    loops : DataFrame
        ``resources/reference/loops.csv``.
    column : str
        One of `SWEPT`; the other one is as drawn.
    scale : float
        Factor of its values.

    Raises
    ------
    DataFileError
        When a column is missing.
    """
    missing = [name for name in NEEDED if name not in loops]
    if missing:
        raise DataFileError(
            f"the table of loops has no column {missing[0]!r}; make it again with "
            "`python -m knitstudy.geometry.lay_out`"
        )
    (other,) = (name for name in SWEPT if name != column)
    along = loops[loops[other] == loops[other].mode()[0]]
    lost = along[along["outcome"] != FOUND]
    return pd.DataFrame({"held fixed": lost["held fixed"], "at": scale * lost[column]})
