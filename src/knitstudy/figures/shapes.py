"""Surfaces that pictures of solids are made of: tubes, spheres, arrows, meshes of yarns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knitstudy.figures.renderer import Surface
from knitstudy.geometry.fabric import Fabric
from knitstudy.mesh.sweep import SweptMesh, rotation_minimising

AROUND = 40  # facets around a tube
STEP = 0.15  # distance of the points that yarns are drawn through, in radii


def tube(centreline: np.ndarray, radius: float, colour: str, opacity: float = 1.0) -> Surface:
    """Return a closed tube about a curve through points (k, 3) [m]."""
    centreline = np.asarray(centreline, dtype=float)
    tangent = np.gradient(centreline, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = rotation_minimising(centreline, tangent)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    radial = np.einsum("ad,kdi->kai", np.stack([np.cos(angle), np.sin(angle)], axis=1), frame[:, :2])
    rings = centreline[:, None] + radius * radial
    # The caps are rings of radius zero.
    ends = [np.repeat(centreline[[k], None], AROUND, axis=1) for k in (0, -1)]
    return _grid(np.concatenate([ends[0], rings, ends[1]]), colour, opacity)


def yarn_tubes(fabric: Fabric, colours: Sequence[str]) -> list[Surface]:
    """Return the undeformed yarns of a fabric, whose colours follow each other again and again."""
    surfaces = []
    for number, curve in enumerate(fabric.centrelines):
        s = np.linspace(0, curve.length, round(curve.length / (STEP * fabric.radius)))
        surfaces.append(tube(curve.position(s), fabric.radius, colours[number % len(colours)]))
    return surfaces


def graded_tube(centreline: np.ndarray, radius: float, colours: Sequence[str]) -> list[Surface]:
    """Return a closed tube about a curve through points (k, 3) [m] whose colours (k,) change from point to point."""
    whole = tube(centreline, radius, colours[0])
    # Rings of facets: the first cap, k - 1 between the points, the last cap.
    ahead = np.concatenate([[colours[0]], colours[1:], [colours[-1]]])
    of_face = np.repeat(ahead, AROUND)
    return [
        Surface(whole.points, whole.faces[of_face == colour], str(colour)) for colour in np.unique(of_face)
    ]


def sphere(centre: np.ndarray, radius: float, colour: str, opacity: float = 1.0) -> Surface:
    """Return a sphere [m]."""
    angle = np.linspace(0, np.pi, 25)
    profile = radius * np.column_stack([-np.cos(angle), np.sin(angle)])
    return _revolution(centre, np.array([0.0, 0.0, 1.0]), profile, colour, opacity)


def arrow(start: np.ndarray, vector: np.ndarray, radius: float, colour: str) -> Surface:
    """Return an arrow whose shaft has a radius [m] and whose head is three times as thick."""
    length = np.linalg.norm(vector)
    neck = length - 8 * radius
    profile = [(0, 0), (0, radius), (neck, radius), (neck, 3 * radius), (length, 0)]
    return _revolution(start, np.asarray(vector) / length, np.array(profile), colour)


def yarn_of_mesh(mesh: SweptMesh, yarn: int, colour: str, opacity: float = 1.0) -> Surface:
    """Return the lateral surface of one yarn of a mesh, with the edges of its facets."""
    corners, faces = np.unique(mesh.surface_quads(yarn), return_inverse=True)
    return Surface(mesh.nodes[corners], faces.reshape(-1, 4), colour, opacity, edges=True)


def _revolution(
    origin: np.ndarray, axis: np.ndarray, profile: np.ndarray, colour: str, opacity: float = 1.0
) -> Surface:
    """Return the surface of revolution of a profile (k, 2) of height and radius [m] about an axis."""
    seed = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(seed, axis)
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    radial = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    height, radius = profile[:, 0, None, None], profile[:, 1, None, None]
    return _grid(np.asarray(origin) + height * axis + radius * radial, colour, opacity)


def _grid(rings: np.ndarray, colour: str, opacity: float) -> Surface:
    """Return the surface through rings (k, a, 3) of points, each closed."""
    number = np.arange(rings.shape[0] * rings.shape[1]).reshape(rings.shape[:2])
    ahead = np.roll(number, -1, axis=1)
    faces = np.stack([number[:-1], ahead[:-1], ahead[1:], number[1:]], axis=-1)
    return Surface(rings.reshape(-1, 3), faces.reshape(-1, 4), colour, opacity)
