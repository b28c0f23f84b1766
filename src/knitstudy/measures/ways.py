"""Independent ways to one result: simulations of a problem by discretisation, each with rising resolution."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import nan

from knitstudy.measures.discretisation import SOLID_YARNS, discretisation, resolution
from knitstudy.measures.estimate import Limit, limit_of_degrees, limit_of_sizes
from knitstudy.measures.problem import PHYSICS, problem_of
from knitstudy.study.scene import Scene, digest

ORDER = 2.0
"""At which forces are taken to converge in the element size. Quadratic elements could do better on smooth problems, but
the edges of ties and contacts lie inside elements, where stresses have kinks: that leaves second order to all."""

NUMERICAL = ("mesh", "tie", "contact")
RESOLUTION = ("size", "degree", "crossing_degree", "span", "crossing_span")
"""Sections that the simulations of a way share, but for these keys of their meshes."""


@dataclass(frozen=True)
class Way:
    """Simulations of one problem that differ in nothing but their resolution.

    Attributes
    ----------
    name : str
        Of the discretisation.
    scenes : tuple of Scene
        From the coarsest to the finest.
    """

    name: str
    scenes: tuple[Scene, ...]

    @property
    def simulated(self) -> list[str]:
        """Names of all scenes that its limit is drawn from."""
        return [scene.name for scene in self.scenes]

    @property
    def resolutions(self) -> list[float]:
        """Element sizes [m], or degrees of polynomials."""
        return [resolution(scene) for scene in self.scenes]

    @property
    def said(self) -> str:
        """Resolutions in words."""
        if self.name == SOLID_YARNS:
            return "p = " + ", ".join(f"{degree:g}" for degree in self.resolutions)
        return ", ".join(f"{1e3 * size:g}" for size in self.resolutions) + " mm"

    @property
    def order(self) -> float:
        """Of convergence in the element size, as assumed; nan of polynomials."""
        return nan if self.name == SOLID_YARNS else ORDER

    def limit(self, values: Mapping[str, float]) -> Limit:
        """Return where values, by scene, tend."""
        found = [values[scene.name] for scene in self.scenes]
        if self.name == SOLID_YARNS:
            return limit_of_degrees(self.resolutions, found)
        return limit_of_sizes(self.resolutions, found, self.order)


def ways_of(scenes: Iterable[Scene]) -> dict[str, list[Way]]:
    """Return the ways to each problem, by its digest.

    A discretisation of one resolution alone is none.

    Parameters
    ----------
    scenes : iterable of Scene
        Direct simulations, in the order of the families.
    """
    groups: dict[str, dict[str, dict[float, Scene]]] = {}
    for scene in scenes:
        of = groups.setdefault(problem_of(scene), {}).setdefault(_all_but_resolution(scene), {})
        of.setdefault(resolution(scene), scene)
    return {problem: [_way(of) for of in found.values() if len(of) > 1] for problem, found in groups.items()}


def _all_but_resolution(scene: Scene) -> str:
    """Return a digest of all that the simulations of one way share beside their problem."""
    numbers = {
        f"{section}.{key}": value
        for section, keys in scene.read(NUMERICAL).items()
        for key, value in keys.items()
        if key not in RESOLUTION and f"{section}.{key}" not in PHYSICS
    }
    return digest({"discretisation": discretisation(scene)} | numbers)


def _way(by_resolution: Mapping[float, Scene]) -> Way:
    name = discretisation(next(iter(by_resolution.values())))
    order = sorted(by_resolution, reverse=name != SOLID_YARNS)
    return Way(name, tuple(by_resolution[each] for each in order))
