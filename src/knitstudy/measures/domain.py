"""How cost and response of a square knit go with the number of its cells (section 3.3, Fig. 12a, Table 3)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
import xarray as xr

from knitstudy.measures.discretisation import INTERACTIONS, NAMES, is_cut, is_direct, made_of
from knitstudy.measures.response import NORMAL, QUANTITIES, largest_out_of_plane
from knitstudy.measures.windows import is_window
from knitstudy.study.scene import LABELS, Scene, digest

FEWEST = 3
"""Sizes that make a series."""

OF_SIZE = ("pattern.loops", "pattern.rows", "rom.contacts_from")
"""Keys by which the knits of a series differ."""

KNOBS = ("mesh", "solver", "rom")
"""Sections by which several series may differ that show the same model: how finely, and its variants."""

SMALLEST = 3
"""Cells in a row from which on growth is fitted: a knit of one cell is all edges."""


@dataclass(frozen=True)
class Series:
    """Simulations of square knits that differ in nothing but their number of cells.

    Attributes
    ----------
    scenes : tuple of Scene
        From the smallest to the largest.
    """

    scenes: tuple[Scene, ...]

    @property
    def cells(self) -> np.ndarray:
        """Cells (k,) in a row of each."""
        return np.array([scene.pattern.loops for scene in self.scenes])

    @property
    def model(self) -> str:
        """What it is computed with, in words."""
        scene = self.scenes[0]
        if is_cut(scene):
            return f"{made_of(scene)}, cells cut out"
        return made_of(scene) if is_direct(scene) else NAMES[scene.fidelity]

    @property
    def interaction(self) -> str:
        """How yarns act on each other, in words."""
        return INTERACTIONS[self.scenes[0].interaction] + (", no row tied" if self.free else "")

    @property
    def free(self) -> bool:
        """Whether yarns touch and no row is tied."""
        scene = self.scenes[0]
        return scene.kind.interaction.touches and scene.value("contact.tied_edges") == "none"

    def growth(self, values: Sequence[float]) -> PowerLaw:
        """Return the law that values (k,), one a scene, follow from `SMALLEST` cells on."""
        large = self.cells >= SMALLEST
        return PowerLaw.through(self.cells[large], np.asarray(values)[large])

    def unknowns(self, dof: Sequence[float]) -> SumOfPowers:
        """Return the law of degrees of freedom (k,) in cells in a row: so many a cell, and some of the edges."""
        large = self.cells >= SMALLEST
        return SumOfPowers.through(self.cells[large], np.asarray(dof)[large], (2, 1))

    def memory(self, dof: Sequence[float], memory: Sequence[float]) -> SumOfPowers:
        """Return the law of memory (k,) in degrees of freedom (k,): so much for each, and what any model takes."""
        large = self.cells >= SMALLEST
        return SumOfPowers.through(np.asarray(dof)[large], np.asarray(memory)[large], (1, 0))


@dataclass(frozen=True)
class PowerLaw:
    """factor n^exponent of cells n in a row."""

    factor: float
    exponent: float

    @classmethod
    def through(cls, cells: np.ndarray, values: np.ndarray) -> PowerLaw:
        """Return the law (least squares of logarithms) of values (k,) that are positive."""
        exponent, start = np.polyfit(np.log(cells), np.log(values), 1)
        return cls(float(np.exp(start)), float(exponent))

    def at(self, cells: np.ndarray | float) -> np.ndarray | float:
        """Return the values at numbers of cells in a row."""
        return self.factor * cells**self.exponent


@dataclass(frozen=True)
class SumOfPowers:
    """Sum of factor x^exponent over two terms."""

    factors: tuple[float, float]
    exponents: tuple[int, int]

    @classmethod
    def through(cls, sizes: np.ndarray, values: np.ndarray, exponents: tuple[int, int]) -> SumOfPowers:
        """Return the law (least squares of relative distances) of values (k,) that are positive at sizes (k,)."""
        terms = np.stack([np.asarray(sizes, dtype=float) ** exponent for exponent in exponents], axis=1)
        factors, *_ = np.linalg.lstsq(terms / values[:, None], np.ones(len(values)))
        return cls(tuple(map(float, factors)), exponents)

    def at(self, sizes: np.ndarray | float) -> np.ndarray | float:
        """Return the values at sizes."""
        return sum(
            factor * sizes**exponent for factor, exponent in zip(self.factors, self.exponents, strict=True)
        )


def series_of(scenes: Iterable[Scene]) -> list[Series]:
    """Return the series among scenes, in the order of their first scenes: each of `FEWEST` sizes or more.

    Of several that differ by `KNOBS` alone, as where each knob is turned, the first stands for the model.
    """
    groups: dict[str, dict[int, Scene]] = {}
    for scene in scenes:
        knit = scene.specimen in ("knit", "cut_knit")
        square = knit and scene.pattern.loops == scene.pattern.rows
        if square and not is_window(scene):  # what a window costs is not what a size costs
            groups.setdefault(_all_but_size(scene), {}).setdefault(scene.pattern.loops, scene)
    found: dict[str, Series] = {}
    for group in groups.values():
        if len(group) >= FEWEST:
            series = Series(tuple(group[size] for size in sorted(group)))
            found.setdefault(_all_but_size(series.scenes[0], but=KNOBS), series)
    return list(found.values())


def force_per_width(history: xr.Dataset, scene: Scene, increment: int = -1) -> float:
    """Return the force of the driven side, at full load or an increment, over the width of knit that it pulls [N/m]."""
    spacing, count = scene.pattern.course_spacing, scene.pattern.rows
    if scene.load.direction == "wale":
        spacing, count = scene.pattern.wale_spacing, scene.pattern.loops
    return float(history["force"][increment]) / (spacing * count)


def seconds_a_newton_iteration(history: xr.Dataset) -> float:
    """Return the time of a path over its Newton iterations [s]."""
    return float(history["seconds"].sum()) / max(int(history["newton_iterations"].sum()), 1)


def contact_over_ties(
    series: Iterable[Series], histories: Mapping[str, xr.Dataset], quantity: str
) -> dict[str, dict[int, float]]:
    """Return what contact costs over ties, by model and cells in a row, for an attribute of histories."""
    values: dict[tuple[str, str], dict[int, float]] = {}
    for each in series:
        values[each.model, each.interaction] = {
            int(cells): histories[scene.name].attrs[quantity]
            for cells, scene in zip(each.cells, each.scenes, strict=True)
        }
    return {
        model: {cells: found[cells] / tied[cells] for cells in found if cells in tied}
        for (model, interaction), found in values.items()
        if interaction == INTERACTIONS["isotropic"] and (tied := values.get((model, INTERACTIONS["tie"])))
    }


def _all_but_size(scene: Scene, but: Sequence[str] = ()) -> str:
    """Return what tells a scene from others, but for its size and some sections."""
    document = {
        name: {key: value for key, value in inside.items() if f"{name}.{key}" not in OF_SIZE}
        if isinstance(inside, Mapping)
        else inside
        for name, inside in scene.to_dict().items()
        if name not in (*LABELS, *but)
    }
    return digest(document)


# ---- What a square knit answers at full load, so that knits of different size can be compared: what of them is edge


@dataclass(frozen=True)
class DomainResponse:
    """At full load: force over the width [N/m], largest |u_z| [m], mean normal force in the centre cell [N] or nan."""

    force: float
    out_of_plane: float
    normal: float


def domain_response(
    scene: Scene, histories: Mapping[str, xr.Dataset], contacts: Mapping[str, xr.Dataset]
) -> DomainResponse:
    """Return the response of a scene; `contacts` are those of direct simulations."""
    history = histories[scene.name]
    normal = nan
    if scene.name in contacts:
        _, values = QUANTITIES[NORMAL]
        normal = float(values(history, contacts[scene.name])[-1])
    return DomainResponse(force_per_width(history, scene), largest_out_of_plane(history), normal)
