"""Symmetries of a plain loop, and the motions of its control points that keep them.

A plain loop is its own mirror image about the plane through head and sinker (x = w/2). Where head and sinker
have the same shape, a half turn about the z axis through the middle of a leg maps the yarn onto itself too.
"""

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError

TOLERANCE = 1e-9
"""Distance over the wale spacing by which an image may miss its point."""


@dataclass(frozen=True)
class Symmetry:
    """One symmetry: control point k goes to ``image[k]``, its displacement is multiplied by ``sign``."""

    image: np.ndarray  # (P,) int
    sign: np.ndarray  # (3,)


def symmetries(curve):
    """Symmetries that a loop has.

    Parameters
    ----------
    curve : CatmullRom
        Its first control point is the sinker's centre; its advance is (w, 0, 0).

    Returns
    -------
    tuple of Symmetry
        The mirror, and the half turn if the loop has it.

    Raises
    ------
    GeometryError
        When the loop is not its own mirror image.
    """
    count, wale = curve.period, curve.advance[0]
    k = np.arange(count)
    points = curve.control_points
    mirrored = curve.points(count - k) * [-1, 1, 1] + [wale + 2 * points[0, 0], 0, 0]
    miss = np.abs(mirrored - points).max()
    if count % 2 or miss > TOLERANCE * wale:
        raise GeometryError(
            f"pattern.control_points: {count} points that miss their mirror images about the loop's middle "
            f"by {miss / wale:.2e} wale spacings: allowed is an even number of points, mirrored within "
            f"{TOLERANCE:g}, the first one at the sinker's centre"
        )
    found = [Symmetry((count - k) % count, np.array([-1.0, 1.0, 1.0]))]
    if count % 4 == 0:
        centre = 2 * points[count // 4]
        turned = centre * [1, 1, 0] - curve.points(count // 2 - k) * [1, 1, -1]
        if np.abs(turned - points).max() <= TOLERANCE * wale:
            found.append(Symmetry((count // 2 - k) % count, np.array([-1.0, -1.0, 1.0])))
    return tuple(found)


def symmetric_motions(free, group):
    """Basis of the displacements of free components that keep the symmetries.

    Parameters
    ----------
    free : ndarray of bool (P, 3)
        Which components of which control points may move.
    group : tuple of Symmetry

    Returns
    -------
    ndarray (P, 3, n)
        One displacement field a free parameter; the parameter is the displacement of one component of one
        point.

    Raises
    ------
    GeometryError
        When nothing may move, or a component is free and its image is not.
    """
    count = len(free)
    average = np.eye(3 * count)
    for symmetry in group:
        average = 0.5 * (average + _matrix(symmetry) @ average)
    moved = (np.abs(average) > 0).any(axis=1)
    reach = average[~free.ravel()][:, free.ravel()]
    if np.abs(reach).any():
        point = int(np.flatnonzero(~free.ravel())[np.abs(reach).any(axis=1)][0] // 3)
        raise GeometryError(
            f"geometry.free: control point {point} is held, its image by a symmetry of the loop is free: "
            "allowed is both or none"
        )
    columns = average[:, free.ravel() & moved]
    peak = np.abs(columns).max(axis=0)
    columns = columns[:, peak > 0] / peak[peak > 0]
    # Points of one orbit give the same field up to its sign: keep the first.
    leading = np.take_along_axis(columns, (columns != 0).argmax(axis=0)[None], axis=0)
    fields = np.unique(columns * np.sign(leading), axis=1)
    if fields.shape[1] == 0:
        raise GeometryError(
            "geometry.free lists no component that may move: name at least one of x, y, z of a point"
        )
    return fields.reshape(count, 3, -1)


def _matrix(symmetry):
    """Action of a symmetry on displacements: (3 P, 3 P)."""
    count = len(symmetry.image)
    action = np.zeros((count, 3, count, 3))
    k, axis = np.arange(count)[:, None], np.arange(3)
    action[symmetry.image[k], axis, k, axis] = symmetry.sign
    return action.reshape(3 * count, 3 * count)
