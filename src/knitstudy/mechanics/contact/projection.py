"""Closest points on smooth surfaces, for many points at once (section 6 of the formulation: tau_a . (x - y) = 0)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from knitstudy.mechanics.contact.surface import Surfaces
from knitstudy.mechanics.parallel import share

ITERATIONS = 40
"""Newton steps after which a point counts as having no closest point within the surface's edges."""

ACCURACY = 1e-11
"""Last Newton step, in units of the parameters, at which the closest point is found; the next one would be rounding."""

CHUNK = 2_000
"""Points that a thread projects at once; bounds the memory of stencils."""

QUADRATIC = 1e-6
"""Step between the same whole numbers after which the next one of a converging Newton's method would be rounding."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Points against the surfaces that they face.

    Attributes
    ----------
    xi : ndarray, shape (k, 2)
        Parameters of the closest points.
    found : ndarray of bool, shape (k,)
        Whether the closest point lies within the surface's edges; what else is here holds only then.
    tangent : ndarray, shape (k, 2, 3)
        tau_a [m].
    curvature : ndarray, shape (k, 3, 3)
        y,_ab for ab = 11, 12, 22 [m].
    normal : ndarray, shape (k, 3)
        Outward unit normal n.
    distance : ndarray, shape (k,)
        n . (x - y) [m]; the gap is larger by the offsets of the two contact surfaces.
    """

    xi: np.ndarray
    found: np.ndarray
    tangent: np.ndarray
    curvature: np.ndarray
    normal: np.ndarray
    distance: np.ndarray


def project(
    surfaces: Surfaces, carriers: np.ndarray, surface: np.ndarray, points: np.ndarray, guess: np.ndarray
) -> Projection:
    """Find the closest places on surfaces (k,) of current carriers (M, 3) to points (k, 3), from guesses (k, 2).

    Newton's method on the squared distance, with steps of at most one unit; where that is not convex, curvature is
    left out.
    """
    starts = range(0, max(len(points), 1), CHUNK)
    parts: list[Projection | None] = [None] * len(starts)

    def find(number: int) -> None:
        part = slice(starts[number], starts[number] + CHUNK)
        parts[number] = _project(surfaces, carriers, surface[part], points[part], guess[part])

    share(find, len(starts))
    if len(parts) == 1:
        return parts[0]
    columns = [[getattr(part, field.name) for part in parts] for field in fields(Projection)]
    return Projection(*map(np.concatenate, columns))


def _project(
    surfaces: Surfaces, carriers: np.ndarray, surface: np.ndarray, points: np.ndarray, guess: np.ndarray
) -> Projection:
    xi = surfaces.clamp(surface, guess)
    moving = np.arange(len(xi))
    found = np.zeros(len(xi), dtype=bool)
    for _ in range(ITERATIONS):
        if not len(moving):
            break
        here = surface[moving]
        step, exact = _step(surfaces, carriers, here, points[moving], xi[moving])
        aim = xi[moving] + step
        exact &= (np.floor(aim) == np.floor(xi[moving])).all(axis=1)
        xi[moving] = surfaces.clamp(here, aim)
        still = np.abs(step).max(axis=1) < np.where(exact, QUADRATIC, ACCURACY)
        # A step that goes on pushing over an edge never comes to rest.
        beyond = np.abs(xi[moving] - aim).max(axis=1) > ACCURACY
        still &= ~(beyond & exact)
        found[moving[still]] = True
        stuck = beyond & (np.abs(xi[moving] - (aim - step)).max(axis=1) < ACCURACY)
        moving = moving[~(still | stuck)]
    place, tangent, curvature = surfaces.places(surface, xi, carriers)
    normal = np.cross(tangent[:, 1], tangent[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Projection(
        xi=xi,
        found=found,
        tangent=tangent,
        curvature=curvature,
        normal=normal,
        distance=np.einsum("ki,ki->k", normal, points - place),
    )


def _step(
    surfaces: Surfaces, carriers: np.ndarray, surface: np.ndarray, points: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Newton's steps (k, 2) for the closest points, and where (k,) curvature is not left out."""
    place, tangent, curvature = surfaces.places(surface, xi, carriers)
    apart = points - place
    slope = np.einsum("kai,ki->ak", tangent, apart)
    metric = np.einsum("kai,kbi->abk", tangent, tangent)
    m11, m12, m22 = metric[0, 0], metric[0, 1], metric[1, 1]
    b11, b12, b22 = np.einsum("kai,ki->ak", curvature, apart)
    h11, h12, h22 = m11 - b11, m12 - b12, m22 - b22
    convex = (h11 > 0.05 * m11) & (h11 * h22 - h12**2 > 0.05 * (m11 * m22 - m12**2))
    h11, h12, h22 = np.where(convex, h11, m11), np.where(convex, h12, m12), np.where(convex, h22, m22)
    return np.clip(_solved(h11, h12, h22, slope), -1.0, 1.0), convex


def follows(tangent: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return how closest places with tangents (k, 2, 3) follow points that move by ways (k, 3): parameters (k, 2).

    To first order, of surfaces that are flat beside the way.
    """
    metric = np.einsum("kai,kbi->abk", tangent, tangent)
    return _solved(metric[0, 0], metric[0, 1], metric[1, 1], np.einsum("kai,ki->ak", tangent, way))


def _solved(h11: np.ndarray, h12: np.ndarray, h22: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solutions (k, 2) of symmetric 2 x 2 systems with right-hand sides (2, k)."""
    solution = np.stack([h22 * right[0] - h12 * right[1], h11 * right[1] - h12 * right[0]], axis=1)
    return solution / (h11 * h22 - h12**2)[:, None]
