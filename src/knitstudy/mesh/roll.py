"""Roll of a yarn's frames about its tangent: facets turn towards given points (the contacts at crossings)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from knitstudy.mesh.spacing import SAME

TIE_DIGITS = 6
"""Digits of a facet step to which two ways round are equally far, so that rounding does not choose."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Points that the middles of facets of one yarn shall face.

    Attributes
    ----------
    arc_length : ndarray (T,)
        Increasing; where the yarn is nearest to the points, m.
    point : ndarray (T, 3)
        The points, off the centreline, m.
    """

    arc_length: np.ndarray = field(default_factory=lambda: np.empty(0))
    point: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def without(self, arc_length: np.ndarray) -> Targets:
        """Return all but those at arc lengths (k,) [m]."""
        near = np.abs(self.arc_length[:, None] - arc_length) <= SAME * self.arc_length.max(initial=0.0)
        others = ~near.any(axis=1)
        return Targets(self.arc_length[others], self.point[others])


def roll_towards(
    targets: Targets, arc_length: np.ndarray, centres: np.ndarray, frames: np.ndarray, angles: np.ndarray
) -> np.ndarray:
    """Roll of every slice after which every target lies over the middle line of a facet.

    At the first target the roll is the smallest possible, at every other one the nearest to that before it:
    at most half a facet step more or less, which keeps the twist of the elements between them small. It is
    constant over the layer that a target lies in the middle of, and beyond the outermost ones; in between it
    follows the cubic smooth step. A symmetric yarn gets a symmetric roll.

    Parameters
    ----------
    targets : Targets
        Every one of them in the middle between two slices.
    arc_length : ndarray (S,)
        Of the slices, m.
    centres : ndarray (S, 3)
        Centres of the slices, m.
    frames : ndarray (S, 3, 3)
        Rows d1, d2, tangent of the slices, before the roll.
    angles : ndarray (a,)
        Angles of the surface nodes from d1 towards d2, at equal steps, rad.

    Returns
    -------
    ndarray (S,)
        Angles from d1 towards d2, rad.
    """
    if not targets.arc_length.size:
        return np.zeros_like(arc_length)
    layer = _layers(targets, arc_length)
    bearing = bearings(targets, arc_length, centres, frames)
    step = 2 * np.pi / angles.size
    excess = (bearing - angles[0]) / step - 0.5  # facet steps beyond the middle of the first facet
    whole = np.round(np.round(np.diff(excess, prepend=0.0), TIE_DIGITS))
    roll = step * (excess - np.cumsum(whole))
    bounds = np.stack([arc_length[layer], arc_length[layer + 1]], axis=-1).ravel()
    return _smooth_steps(arc_length, bounds, np.repeat(roll, 2))


def rolled(frames: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Frames (S, 3, 3), rows d1, d2, tangent, turned about the tangent by ``roll`` (S,) in rad."""
    d1, d2, tangent = np.moveaxis(frames, 1, 0)
    cosine, sine = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return np.stack([cosine * d1 + sine * d2, cosine * d2 - sine * d1, tangent], axis=1)


def _layers(targets: Targets, arc_length: np.ndarray) -> np.ndarray:
    """Lower slices (T,) of the layers that the targets lie in the middle of."""
    return np.searchsorted(arc_length, targets.arc_length) - 1


def bearings(targets: Targets, arc_length: np.ndarray, centres: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Angles (T,) at which targets are seen from the middles of layers, where facets have their middles.

    Parameters
    ----------
    targets : Targets
    arc_length, centres, frames : ndarray
        Of the slices, as in `roll_towards`.

    Returns
    -------
    ndarray (T,)
        From d1 towards d2, rad.
    """
    layer = _layers(targets, arc_length)
    seen = targets.point - 0.5 * (centres[layer] + centres[layer + 1])
    directors = 0.5 * (frames[layer] + frames[layer + 1])[:, :2]  # (T, 2, 3)
    # Where the yarn bends the mean directors are not quite orthonormal: components by their Gram matrix.
    gram = directors @ directors.transpose(0, 2, 1)
    x, y = np.linalg.solve(gram, directors @ seen[..., None])[..., 0].T
    return np.arctan2(y, x)


def _smooth_steps(s: np.ndarray, knots: np.ndarray, values: np.ndarray) -> np.ndarray:
    """C1 interpolation (k,) by cubic smooth steps between knots, constant beyond the outer ones."""
    part = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, knots.size - 2)
    t = np.clip((s - knots[part]) / (knots[part + 1] - knots[part]), 0.0, 1.0)
    return values[part] + (values[part + 1] - values[part]) * t**2 * (3 - 2 * t)
