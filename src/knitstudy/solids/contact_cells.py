"""Cells of contact on the surfaces of solid yarns without hexahedra: small near crossings, few elsewhere."""

from __future__ import annotations

import numpy as np

from knitstudy.crossings.rings import Rings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.polynomial_yarn.space import Space
from knitstudy.study.scene import Scene

COARSE = 3.0
"""Length of cells away from crossings, over that near them."""


def contact_surfaces(scene: Scene, space: Space, specimen: Knit | YarnPair) -> tuple[Cylinders, Rings]:
    """Return the surfaces of yarns for contact, and where their rings lie; coarse where nothing touches.

    Raises
    ------
    ConfigurationError
        If crossings of a yarn are nearer to each other than the law of contact allows.
    """
    radius, crossings = specimen.radius, specimen.crossings
    keys = scene.contact if scene.kind.interaction.touches else None
    cell = (keys.cell if keys else 1.0) * radius
    window = (keys.window if keys else 0.0) * radius
    along = []
    for number, yarn in enumerate(space.yarns):
        stations = np.sort(crossings.arc_length[crossings.yarn == number])
        if keys and keys.law == "indentation":
            _require_apart(stations, window, radius)
        along.append(_edges(yarn.spline.knots[-1], stations, window, cell))
    surfaces = Cylinders(space, radius, along, int(np.ceil(2 * np.pi * radius / cell)))
    parameters = tuple(surfaces.edges(number)[0] for number in range(len(along)))
    return surfaces, Rings(parameters, tuple(along))


def _edges(length: float, stations: np.ndarray, window: float, cell: float) -> np.ndarray:
    """Return the arc lengths (m + 1,) of edges of cells on a yarn [m]."""
    bounds = np.stack([stations - window, stations + window], axis=1).clip(0.0, length)
    # Windows that meet are one.
    first = np.ones(len(bounds), dtype=bool)
    first[1:] = bounds[1:, 0] > np.maximum.accumulate(bounds[:-1, 1]) + cell
    low = bounds[first, 0]
    high = np.maximum.reduceat(bounds[:, 1], np.flatnonzero(first)) if len(bounds) else low
    stops = np.unique(np.concatenate([[0.0, length], low, high]))
    middle = 0.5 * (stops[1:] + stops[:-1])
    fine = np.any((middle[:, None] > low) & (middle[:, None] < high), axis=1)
    parts = np.ceil(np.diff(stops) / np.where(fine, cell, COARSE * cell) - 1e-9).astype(int)
    start = np.repeat(np.cumsum(parts) - parts, parts)
    share = (np.arange(parts.sum()) - start) / np.repeat(parts, parts)
    return np.append(np.repeat(stops[:-1], parts) + share * np.repeat(np.diff(stops), parts), length)


def _require_apart(stations: np.ndarray, window: float, radius: float) -> None:
    """Refuse crossings so near to each other that the areas of contact are not alone."""
    nearest = np.diff(stations).min(initial=np.inf)
    if nearest < window:
        raise ConfigurationError(
            f"contact.law is 'indentation', but two crossings of a yarn are {nearest / radius:.2f} yarn radii apart, "
            f"less than contact.window, {window / radius:.2f}: what each indents would count twice; use contact.law "
            "'penalty' or a smaller contact.window"
        )
