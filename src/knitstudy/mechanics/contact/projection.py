"""Closest points on smooth surfaces, for many points at once (section 6 of the formulation: tau_a . (x - y) = 0)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.contact.surface import Stencil, Surfaces, interpolate

ITERATIONS = 40
"""Newton steps after which a point counts as having no closest point within the surface's edges."""

ACCURACY = 1e-11
"""Last Newton step, in cells, at which the closest point is found; the next one would be rounding."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Points against the surfaces that they face.

    Attributes
    ----------
    xi : ndarray, shape (k, 2)
        Parameters of the closest points.
    found : ndarray of bool, shape (k,)
        Whether the closest point lies within the surface's edges; what else is here holds only then.
    stencil : Stencil
        Of the closest points.
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
    stencil: Stencil
    tangent: np.ndarray
    curvature: np.ndarray
    normal: np.ndarray
    distance: np.ndarray


def project(
    surfaces: Surfaces, nodes: np.ndarray, surface: np.ndarray, points: np.ndarray, guess: np.ndarray
) -> Projection:
    """Find the closest places on surfaces (k,) of current nodes (N, 3) to points (k, 3), from guesses (k, 2).

    Newton's method on the squared distance, with steps of at most one cell; where that is not convex, curvature is
    left out.
    """
    xi = surfaces.clamp(surface, guess)
    moving = np.arange(len(xi))
    found = np.zeros(len(xi), dtype=bool)
    for _ in range(ITERATIONS):
        if not len(moving):
            break
        here = surface[moving]
        step = _step(surfaces, nodes, here, points[moving], xi[moving])
        aim = xi[moving] + step
        xi[moving] = surfaces.clamp(here, aim)
        still = np.abs(step).max(axis=1) < ACCURACY
        found[moving[still]] = True
        # A step that goes on pushing over an edge never comes to rest.
        beyond = np.abs(xi[moving] - aim).max(axis=1) > ACCURACY
        stuck = beyond & (np.abs(xi[moving] - (aim - step)).max(axis=1) < ACCURACY)
        moving = moving[~(still | stuck)]
    stencil = surfaces.stencil(surface, xi)
    tangent = interpolate(stencil.first, stencil.nodes, nodes)
    normal = np.cross(tangent[:, 1], tangent[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    apart = points - interpolate(stencil.value, stencil.nodes, nodes)
    return Projection(
        xi=xi,
        found=found,
        stencil=stencil,
        tangent=tangent,
        curvature=interpolate(stencil.second, stencil.nodes, nodes),
        normal=normal,
        distance=np.einsum("ki,ki->k", normal, apart),
    )


def _step(
    surfaces: Surfaces, nodes: np.ndarray, surface: np.ndarray, points: np.ndarray, xi: np.ndarray
) -> np.ndarray:
    """Return Newton's step (k, 2) for the closest points."""
    stencil = surfaces.stencil(surface, xi)
    tangent = interpolate(stencil.first, stencil.nodes, nodes)
    apart = points - interpolate(stencil.value, stencil.nodes, nodes)
    slope = np.einsum("kai,ki->ka", tangent, apart)
    metric = np.einsum("kai,kbi->kab", tangent, tangent)
    bend = np.einsum("kai,ki->ka", interpolate(stencil.second, stencil.nodes, nodes), apart)
    hessian = metric - bend[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    convex = (hessian[:, 0, 0] > 0.05 * metric[:, 0, 0]) & (
        np.linalg.det(hessian) > 0.05 * np.linalg.det(metric)
    )
    hessian[~convex] = metric[~convex]
    step = np.linalg.solve(hessian, slope[..., None])[..., 0]
    return np.clip(step, -1.0, 1.0)
