"""Grading of cross-sections: near crossings their nodes are drawn towards the other yarn.

The section keeps its topology along the yarn, so what is finer on one side has to be coarser on the other. A Moebius
map of the disc onto itself,

    f(z) = (z + a) / (1 + conj(a) z) ,   |a| = (m - 1) / (m + 1) ,

does that without shearing anything: it is conformal, so elements keep their angles, and takes the circle to the circle.
Elements are m times as small at a / |a|, angles and rings alike, and m times as large on the other side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError


@dataclass(frozen=True)
class Grading:
    """How much finer a mesh is near crossings.

    Attributes
    ----------
    refinement : float
        Element size over the size at crossings, at least 1.
    reach, ramp : float
        Full refinement lasts up to the distance ``reach`` from a crossing, and is gone beyond ``reach + ramp``, along
        the yarn, m.
    """

    refinement: float = 1.0
    reach: float = 0.0
    ramp: float = 1.0

    def __post_init__(self):
        if not self.refinement >= 1:
            raise MeshError(f"mesh.refinement: {self.refinement} is not allowed; it must be at least 1")

    def share(self, distance: np.ndarray) -> np.ndarray:
        """Share of the refinement that is left at distances (k,) in m from a crossing: 1 at it, 0 far away."""
        t = np.clip((distance - self.reach) / self.ramp, 0.0, 1.0)
        return 1 - t**2 * (3 - 2 * t)

    def finer(self, distance: np.ndarray) -> np.ndarray:
        """Return the factor (k,) on the spacing along the yarn at distances (k,) in m from the nearest crossing.

        It grows geometrically over the ramp, so that neighbours differ by the same ratio.
        """
        return self.refinement ** -self.share(distance)

    def pull(self, s: np.ndarray, crossings: np.ndarray, bearing: np.ndarray) -> np.ndarray:
        """Return a (k, 2) of sections at arc lengths ``s`` (k,) [m]: how far, and where to, they are drawn.

        Parameters
        ----------
        s : ndarray (k,)
        crossings : ndarray (c,)
            Increasing arc lengths of crossings, m.
        bearing : ndarray (c,)
            Angle from d1 towards d2 at which the other yarn lies there, rad.

        Raises
        ------
        MeshError
            If a section would be drawn to two crossings at once.
        """
        if self.refinement == 1 or not crossings.size:
            return np.zeros((s.size, 2))
        room = np.diff(crossings).min(initial=np.inf)
        if room < 2 * (self.reach + self.ramp):
            raise MeshError(
                f"mesh.refinement: crossings {room:.4g} m apart along a yarn are too near for {self.refinement:g}, "
                f"which takes {self.reach + self.ramp:.4g} m on both sides of each; use 1"
            )
        distance = np.abs(s[:, None] - crossings)
        nearest = distance.argmin(axis=1)
        finer = self.refinement ** self.share(distance[np.arange(s.size), nearest])
        towards = bearing[nearest]
        return ((finer - 1) / (finer + 1))[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=-1)


UNIFORM = Grading()
"""No refinement anywhere."""


def drawn(points: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """Return points (k, q, 2) of sections: points (q, 2) in the circle of the outermost ones, drawn by pull (k, 2)."""
    radius = np.linalg.norm(points, axis=-1).max()
    z, a = (points @ [1, 1j])[None] / radius, (pull @ [1, 1j])[:, None]
    image = radius * (z + a) / (1 + a.conj() * z)
    still = np.broadcast_to(points, (*image.shape, 2))
    return np.where((a == 0)[..., None], still, np.stack([image.real, image.imag], axis=-1))


def shrinkage(points: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """Return |f'| (k, q) at points (q, 2) of sections drawn by pull (k, 2): lengths there, over those not drawn."""
    z = points @ [1, 1j] / np.linalg.norm(points, axis=-1).max()
    a = (pull @ [1, 1j])[:, None]
    return (1 - np.abs(a) ** 2) / np.abs(1 + a.conj() * z) ** 2


def drawn_angles(angles: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """Return angles (k, a) on the circle, in rad and increasing: angles (a,) of the section, drawn by pull (k, 2)."""
    z, a = np.exp(1j * angles), (pull @ [1, 1j])[:, None]
    return angles - 2 * np.angle(1 + a.conj() * z)  # |z| = 1: z + a = z conj(1 + conj(a) z)
