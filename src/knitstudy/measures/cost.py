"""Cost of simulations: memory, time and size, and their growth in square knits (Fig. 12a, Table 3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.specimens import Looped
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import INTERACTIONS, is_direct, made_of

MEGABYTE = 1e6
NO_GROWTH = 1e3  # Least growth of memory in ratios and logarithms [bytes]


def memory_growth(history: xr.Dataset) -> float:
    """Return the growth of memory above that of the bare process, at least `NO_GROWTH` [bytes]."""
    return max(float(history.attrs["memory_growth"]), NO_GROWTH)


def effort(history: xr.Dataset) -> dict[str, float]:
    """Return increments, Newton and Krylov iterations and wall-clock time of a simulation, by column."""
    return {
        "increments [1]": history.sizes["increment"] - 1,
        "Newton iterations [1]": int(history["newton_iterations"].sum()),
        "Krylov iterations [1]": int(history["krylov_iterations"].sum()),
        "time [s]": history.attrs.get("wall_seconds", nan),
    }


def element_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())


# Stems of the names of square knits, "{stem}-{n}x{n}", with the scene of 3 x 3 cells if it is one of another name.
SERIES = {
    "domain-yarns-tie-course": "yarns-tie-course",
    "domain-yarns-tie-wale": "yarns-tie-wale",
    "domain-rom3d-tie-course": "rom3d-tie-course",
    "domain-rom2d-tie-course": "rom2d-tie-course",
    "domain-beams-isotropic-course": "beam-hertz-patch-isotropic-course",
    "domain-hexahedra-tie-course": None,
    "domain-hexahedra-isotropic-course": None,
    "domain-yarns-isotropic-course": None,
}

FEWEST = 3  # Sizes that make a series
SMALLEST = 3  # Cells in a row from which on growth is fitted: a knit of one cell is all edges


@dataclass(frozen=True)
class Series:
    """Simulations of square knits, from the smallest to the largest, that differ in their number of cells alone."""

    stem: str
    scenes: tuple[Looped, ...]

    @property
    def cells(self) -> np.ndarray:
        """Cells (k,) in a row."""
        return np.array([scene.pattern.loops for scene in self.scenes])

    @property
    def large(self) -> np.ndarray:
        """Whether the growth is fitted to a size (k,)."""
        return self.cells >= SMALLEST

    @property
    def freedom(self) -> int:
        """Degrees of freedom that a power law leaves to the sizes, at least 1."""
        return max(int(self.large.sum()) - 2, 1)

    @property
    def model(self) -> str:
        """Model in words."""
        scene = self.scenes[0]
        return made_of(scene) if is_direct(scene) else scene.kind.fidelity.label

    @property
    def interaction(self) -> str:
        """Interaction in words."""
        return INTERACTIONS[self.scenes[0].interaction]

    def growth(self, values: Sequence[float]) -> Estimate:
        """Return the exponent of a power law of values (k,) in cells in a row, with its standard error."""
        logs = np.log([self.cells[self.large], np.asarray(values)[self.large]])
        x, y = logs - logs.mean(axis=1, keepdims=True)
        slope = x @ y / (x @ x)
        square = np.sum((y - slope * x) ** 2) / self.freedom
        return Estimate(float(slope), float(np.sqrt(square / (x @ x))))

    def memory(self, dof: np.ndarray, memory: np.ndarray) -> Polynomial:
        """Return the law of memory (k,): a d + b in degrees of freedom d (k,), with the least relative squares."""
        terms = np.vander(dof[self.large], 2, increasing=True) / memory[self.large, None]
        return Polynomial(np.linalg.lstsq(terms, np.ones(len(terms)))[0])


def series_of(scenes: Iterable[Scene]) -> list[Series]:
    """Return the series (`SERIES`) among scenes, each of `FEWEST` sizes or more."""
    knits = [scene for scene in scenes if isinstance(scene, Looped)]
    series = []
    for stem, three in SERIES.items():
        group = [scene for scene in knits if scene.name == three or scene.name.startswith(f"{stem}-")]
        if len(group) >= FEWEST:
            series.append(Series(stem, tuple(sorted(group, key=lambda scene: scene.pattern.loops))))
    return series
