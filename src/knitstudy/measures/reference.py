"""The reference: all models are compared with the values to which independent discretisations converge.

Reference values are limits of direct simulations (`paper.tables.reference`), each with its uncertainty, kept in
``resources/reference/reference.csv`` by the digest of the physical problem. docs/notes/reference.md describes them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.measures import response
from knitstudy.measures.estimate import UNKNOWN, Estimate, Limit, limit_of_degrees, limit_of_sizes

NEEDED = ("problem", "quantity", "strain [1]", "value", "uncertainty")  # Columns of the file that are read
TRANSFERRED = (response.FORCE, response.LARGEST_U_Z, response.RMS_U_Z)  # Estimated for other problems too


@dataclass(frozen=True)
class Reference:
    """Estimates of one problem by quantity and strain; none where there is no reference."""

    estimates: Mapping[tuple[str, float], Estimate] = field(default_factory=dict)

    @property
    def known(self) -> bool:
        """Whether there is any."""
        return bool(self.estimates)

    def at(self, quantity: str, strain: float) -> Estimate:
        """Return a quantity at a strain, unknown where there is no reference value."""
        for (name, at), estimate in self.estimates.items():
            if name == quantity and abs(strain - at) <= response.SAME_STRAIN * at:
                return estimate
        return UNKNOWN

    def strains(self, quantity: str, up_to: float = np.inf) -> list[float]:
        """Return the strains at which a quantity is known, rising, up to a strain."""
        known = {at for name, at in self.estimates if name == quantity}
        return sorted(at for at in known if at <= up_to * (1 + response.SAME_STRAIN))

    def curve(
        self, up_to: float = np.inf, quantity: str = response.FORCE
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return strains, values of a quantity that begins at zero, and their uncertainties, from no load on."""
        strains = self.strains(quantity, up_to)
        estimates = [Estimate(0.0, 0.0), *(self.at(quantity, strain) for strain in strains)]
        return (
            np.array([0.0, *strains]),
            np.array([estimate.value for estimate in estimates]),
            np.array([estimate.uncertainty for estimate in estimates]),
        )

    def ratio(self, history: xr.Dataset, quantity: str, values: np.ndarray) -> Estimate:
        """Return values (I,) of a history over the reference value, at the largest strain that has both."""
        strains = self.strains(quantity, float(history["strain"][-1]))
        if not strains:
            return UNKNOWN
        here = float(np.interp(strains[-1], history["strain"], values))
        return self.at(quantity, strains[-1]).of(lambda value: here / value)

    def force_ratio(self, history: xr.Dataset) -> Estimate:
        """Return the force, and so the secant stiffness, over the reference value."""
        return self.ratio(history, response.FORCE, history["force"].to_numpy())

    def force_distance(self, history: xr.Dataset) -> Estimate:
        """Return the relative L2 distance of the curve of force against strain.

        Both curves are polygons through the strains of the reference that the history reaches; the reference may be
        off by its uncertainty at all strains alike.
        """
        distances = self._distances(history)
        if not distances:
            return UNKNOWN
        value, *ends = distances
        return Estimate(value, max(abs(end - value) for end in ends))

    def nearer(self, one: xr.Dataset, other: xr.Dataset, share: float) -> bool | None:
        """Whether the force of one history is at most a share as far away as another's; None where that is open."""
        pairs = list(zip(self._distances(one), self._distances(other), strict=True))
        if not pairs:
            return None
        holds = {near <= share * far for near, far in pairs}
        return holds.pop() if len(holds) == 1 else None

    def _distances(self, history: xr.Dataset) -> list[float]:
        """Return the distances from the reference, and from the reference less and plus its uncertainty."""
        knots, force, off = self.curve(float(history["strain"][-1]))
        if len(knots) < 2:
            return []
        ours = np.interp(knots, history["strain"], history["force"])
        return [response.distance_of_curves(knots, ours, force + sign * off) for sign in (0, -1, 1)]


def reference_of(table: pd.DataFrame, scene: Scene) -> Reference:
    """Return the reference of the problem that a scene simulates; empty where there is none.

    Raises DataFileError when a column is missing or holds no numbers.
    """
    missing = [name for name in NEEDED if name not in table]
    if missing:
        raise DataFileError(
            f"the reference has no column {missing[0]!r}; make it again with `make reference`"
        )
    rows = table[table["problem"] == problem_of(scene)]
    try:
        return Reference(
            {
                (str(quantity), float(strain)): Estimate(float(value), float(uncertainty))
                for _, quantity, strain, value, uncertainty in rows[list(NEEDED)].itertuples(index=False)
            }
        )
    except ValueError as error:
        raise DataFileError(
            f"the reference holds a value that is not a number ({error}); make it again with `make reference`"
        ) from error


def transferred_uncertainty(known: Reference, base: xr.Dataset, history: xr.Dataset) -> Reference:
    """Return force and motion of a history, as uncertain as its discretisation is for a problem with reference.

    `base` and `history` are of one discretisation and interaction and differ by an input. The relative error of the
    base, plus the relative uncertainty of the reference, is taken to be the same, at the strains that both reach.
    """
    reached = response.common_strain([base, history])
    estimates = {}
    for quantity in TRANSFERRED:
        _, values = response.QUANTITIES[quantity]
        here, there = (values(curve, curve) for curve in (history, base))
        for strain in known.strains(quantity, reached):
            true = known.at(quantity, strain)
            off = (abs(response.at_strain(base, strain, there) - true.value) + true.uncertainty) / true.value
            value = response.at_strain(history, strain, here)
            estimates[quantity, strain] = Estimate(value, off * value)
    return Reference(estimates)


def reference_by(history: xr.Dataset) -> Reference:
    """Return force and motion of a history as the reference of others, without uncertainty, at all its strains."""
    estimates = {}
    for quantity in TRANSFERRED:
        _, values = response.QUANTITIES[quantity]
        strains = history["strain"].to_numpy()[1:]
        for strain, value in zip(strains, values(history, history)[1:], strict=True):
            estimates[quantity, float(strain)] = Estimate(float(value), 0.0)
    return Reference(estimates)


# Assumed order of convergence of forces in the element size. Quadratic elements do better on smooth problems,
# but the edges of ties and contacts lie inside elements, where stresses have kinks: that leaves second order
# to all elements.
ORDER = 2.0


@dataclass(frozen=True)
class RefinementSeries:
    """Simulations of one problem that differ in their resolution alone, from the coarsest to the finest."""

    name: str
    scenes: tuple[Scene, ...]

    @classmethod
    def of(cls, by_resolution: Mapping[float, Scene]) -> RefinementSeries:
        """Return the series of scenes by their resolutions."""
        name = discretisation(next(iter(by_resolution.values())).value("mesh"))
        order = sorted(by_resolution, reverse=name != SOLID_YARNS)
        return cls(name, tuple(by_resolution[resolution] for resolution in order))

    @property
    def resolutions(self) -> list[float]:
        """Element sizes in yarn radii, or degrees of polynomials."""
        return [resolution(scene.value("mesh")) for scene in self.scenes]

    @property
    def described(self) -> str:
        """Resolutions in words."""
        if self.name == SOLID_YARNS:
            return "p = " + ", ".join(f"{degree:g}" for degree in self.resolutions)
        return (
            ", ".join(f"{1e3 * scene.value('mesh.size') * scene.yarn.radius:.3g}" for scene in self.scenes)
            + " mm"
        )

    @property
    def order(self) -> float:
        """Assumed order of convergence in the element size; nan of polynomials."""
        return nan if self.name == SOLID_YARNS else ORDER

    def limit(self, values: Mapping[str, float]) -> Limit:
        """Return the limit of values by scene."""
        ordered = [values[scene.name] for scene in self.scenes]
        if self.name == SOLID_YARNS:
            return limit_of_degrees(self.resolutions, ordered)
        return limit_of_sizes(self.resolutions, ordered, self.order)


def refinement_series_of(scenes: Iterable[Scene]) -> dict[str, list[RefinementSeries]]:
    """Return the refinement series of direct simulations by the digest of their problem.

    A discretisation with one resolution alone is no series; of scenes with the same resolution the first counts.
    """
    groups: dict[str, dict[str, dict[float, Scene]]] = {}
    for scene in scenes:
        mesh = scene.value("mesh")
        shared = digest({"discretisation": discretisation(mesh)} | scene.values_of("numerics"))
        alike = groups.setdefault(problem_of(scene), {}).setdefault(shared, {})
        alike.setdefault(resolution(mesh), scene)
    return {
        problem: [RefinementSeries.of(alike) for alike in of_problem.values() if len(alike) > 1]
        for problem, of_problem in groups.items()
    }


# Names of discretisations of direct simulations, and digests of physical problems.


# By ``mesh.element``; elements of plugins go by their own names.
HEXAHEDRA = {
    "one_point": "one-point hexahedra",
    "quadratic": "quadratic hexahedra",
    "eight_point": "fully integrated hexahedra",
}

SOLID_YARNS = "solid yarns"


def discretisation(mesh: Any) -> str:
    """Return the discretisation of solids by a section ``mesh`` in words, without its resolution."""
    element = getattr(mesh, "element", None)
    return SOLID_YARNS if element is None else HEXAHEDRA.get(element, element)


def resolution(mesh: Any) -> float:
    """Return the element size in yarn radii, or the degree of polynomials near crossings, of a section ``mesh``."""
    return float(getattr(mesh, "crossing_degree", None) or mesh.size)


def refined(mesh: Any) -> str:
    """Return in words how much finer the elements of a section ``mesh`` are at crossings; empty where they are not."""
    times = getattr(mesh, "refinement", None) or 1
    return f", {times:g} times finer at crossings" if times != 1 else ""


def made_of(scene: Scene) -> str:
    """Return discretisation and resolution in words."""
    mesh = scene.value("mesh")
    if (near := getattr(mesh, "crossing_degree", None)) is None:
        return f"{discretisation(mesh)} of {1e3 * (mesh.size * scene.yarn.radius):.2f} mm{refined(mesh)}"
    return f"{SOLID_YARNS} of degree {near}" + (f", {mesh.degree} on legs" if mesh.degree != near else "")


# Simulations of one problem may be pulled to different strains: their results are compared at the same
# strain.
HOW_FAR = "load.strain"


def physics_of(scene: Scene) -> dict[str, Any]:
    """Return the physical problem: the values of all keys whose role is physics, but for the largest strain."""
    labels = {"specimen": scene.specimen, "interaction": scene.interaction}
    return labels | {key: value for key, value in scene.values_of("physics").items() if key != HOW_FAR}


def problem_of(scene: Scene) -> str:
    """Return a digest of the physical problem of a scene, the same for all models and discretisations."""
    return digest(physics_of(scene))
