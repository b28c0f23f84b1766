"""Independent ways to one result: simulations of a problem by discretisation, each with rising resolution."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import nan

from knitstudy.measures.discretisation import SOLID_YARNS, discretisation, resolution
from knitstudy.measures.extrapolation import Limit, limit_like, limit_of_degrees, limit_of_sizes
from knitstudy.measures.problem import PHYSICS, loops_of, problem_of
from knitstudy.study.scene import Scene, digest

ORDER = 2.0
"""At which forces are taken to converge in the element size. Quadratic elements could do better on smooth problems, but
the edges of ties and contacts lie inside elements, where stresses have kinks: that leaves second order to all."""


TIE = "tie"
"""Interaction of knits that any other may borrow corrections from: its outer rows or columns are tied."""

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
    like : tuple of Way
        Of smaller knits, where there is one resolution alone: what that lacks is taken to be what it lacks there.
    """

    name: str
    scenes: tuple[Scene, ...]
    like: tuple[Way, ...] = ()

    @property
    def simulated(self) -> list[str]:
        """Names of all scenes that its limit is drawn from."""
        return [scene.name for way in (self, *self.like) for scene in way.scenes]

    @property
    def resolutions(self) -> list[float]:
        """Element sizes [m], or degrees of polynomials."""
        return [resolution(scene) for scene in self.scenes]

    @property
    def said(self) -> str:
        """Resolutions in words."""
        if self.name == SOLID_YARNS:
            own = "p = " + ", ".join(f"{degree:g}" for degree in self.resolutions)
        else:
            own = ", ".join(f"{1e3 * size:g}" for size in self.resolutions) + " mm"
        like = " and ".join(f"{_size(way.scenes[0])} {way.scenes[0].interaction}" for way in self.like)
        return f"{own} as {like}" if like else own

    @property
    def order(self) -> float:
        """Of convergence in the element size, as assumed; nan of polynomials."""
        return nan if self.name == SOLID_YARNS else ORDER

    def limit(self, values: Mapping[str, float]) -> Limit:
        """Return where values, by scene, tend; nan where values that are nothing tell no correction."""
        if self.like:
            (scene,) = self.scenes
            like = [(values[way.at(scene).name], way.limit(values)) for way in self.like]
            return limit_like(values[scene.name], like)
        found = [values[scene.name] for scene in self.scenes]
        if self.name == SOLID_YARNS:
            return limit_of_degrees(self.resolutions, found)
        return limit_of_sizes(self.resolutions, found, self.order)

    def at(self, scene: Scene) -> Scene:
        """Return its scene of the resolution of another."""
        return next(each for each in self.scenes if resolution(each) == resolution(scene))


def ways_of(scenes: Iterable[Scene]) -> dict[str, list[Way]]:
    """Return the ways to each problem, by its digest.

    A discretisation of one resolution alone is none, unless smaller knits of the same loops under the same load have
    more, this one among them (`Way.like`): of the same interaction, and tied.

    Parameters
    ----------
    scenes : iterable of Scene
        Direct simulations, in the order of the families.
    """
    groups: dict[str, dict[str, dict[float, Scene]]] = {}
    for scene in scenes:
        of = groups.setdefault(problem_of(scene), {}).setdefault(_all_but_resolution(scene), {})
        of.setdefault(resolution(scene), scene)
    ways = {problem: [_way(of) for of in found.values()] for problem, found in groups.items()}
    complete = [way for found in ways.values() for way in found if len(way.scenes) > 1]
    return {problem: list(_usable(found, complete)) for problem, found in ways.items()}


def _usable(ways: Iterable[Way], complete: list[Way]) -> Iterator[Way]:
    """Yield the ways that have more resolutions than one, and those that smaller knits complete."""
    for way in ways:
        if len(way.scenes) > 1:
            yield way
        elif like := tuple(other for other in complete if _completes(other, way.scenes[0])):
            yield replace(way, like=like)


def _completes(way: Way, scene: Scene) -> bool:
    """Return whether a way is of a smaller knit of a scene's loops, and has its resolution."""
    first = way.scenes[0]
    same = first.interaction == scene.interaction
    sections = NUMERICAL if same else NUMERICAL[:-1]
    return (
        first.specimen == scene.specimen == "knit"
        and (same or first.interaction == TIE)
        and loops_of(first) == loops_of(scene)
        and first.pattern.loops * first.pattern.rows < scene.pattern.loops * scene.pattern.rows
        and _all_but_resolution(first, sections) == _all_but_resolution(scene, sections)
        and resolution(scene) in way.resolutions
    )


def _size(scene: Scene) -> str:
    return f"{scene.pattern.loops} x {scene.pattern.rows}"


def _all_but_resolution(scene: Scene, sections: tuple[str, ...] = NUMERICAL) -> str:
    """Return a digest of all that the simulations of one way share beside their problem."""
    numbers = {
        f"{section}.{key}": value
        for section, keys in scene.read(sections).items()
        for key, value in keys.items()
        if key not in RESOLUTION and f"{section}.{key}" not in PHYSICS
    }
    return digest({"discretisation": discretisation(scene)} | numbers)


def _way(by_resolution: Mapping[float, Scene]) -> Way:
    name = discretisation(next(iter(by_resolution.values())))
    order = sorted(by_resolution, reverse=name != SOLID_YARNS)
    return Way(name, tuple(by_resolution[each] for each in order))
