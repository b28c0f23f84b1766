"""Displacements that a space shows under a patch of load: a straight yarn, held at its ends, in small strains.

Lengths are over the yarn's radius, stiffnesses over E times the radius. True values are known from a space with far
more functions, on a patch that it resolves, and from the half space, which is exact for the local part:

    C(a) = C_half(a) + C_far,   C_half(a) = 0.6 (1 - nu^2) / a for Hertz's pressure on a circle

C_far belongs to the yarn and to how it is held, and is the same for all shapes of patch: with degree 8 and spans of
0.3 it is constant within 0.5% for a from 0.3 to 0.5. C_half is the mean of Hertz's displacement, weighted with his
pressure (Johnson 1985, Contact Mechanics, sections 4.2 and 7.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from knitstudy.mechanics.assembly import stiffness_at_rest
from knitstudy.mechanics.contact.patch_compliance import NORMAL, straight
from knitstudy.mechanics.linear import factorise
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.spline_yarn.space import Space, YarnSpace, yarn_space
from knitstudy.mechanics.spline_yarn.span import span_groups

LENGTH = 6.0  # of the yarn; the part that a space misses does not depend on it
# Place of the patch within a span: under its ends a space shows as much more as it shows less under its middle.
PHASE = 0.25
# Degree of the space that shows true values on a patch of radius `RESOLVED`, with spans of `FINE` near the patch.
RICH = 8
FINE, RESOLVED, NEAR = 0.3, 0.5, 1.2


@dataclass(frozen=True)
class PatchResponse:
    """Displacement over force, on a patch: at its middle, its fall along the axes, and its weighted mean.

    The displacement is ``middle - fall[0] x^2 - fall[1] y^2`` on the patch's axes.
    """

    middle: float
    fall: tuple[float, float]
    mean: float


class PatchedYarn:
    """A straight yarn of unit radius and modulus, and its response to a patch of load in its middle."""

    def __init__(
        self,
        space: YarnSpace,  # over arc lengths from 0 to `LENGTH`
        poisson: float,
    ) -> None:
        self._space, nodes = Space((space,)), straight(space)
        stiffness = stiffness_at_rest(
            span_groups(self._space, nodes, Hencky(1.0, poisson)), len(nodes)
        ).tocsc()
        first = space.first_node
        held = np.concatenate([np.arange(first[1]), np.arange(*first[-2:])])
        self._free = np.setdiff1d(np.arange(nodes.size), 3 * held[:, None] + np.arange(3))
        self._factors = factorise(stiffness[self._free][:, self._free].tocsc())

    def response(
        self,
        semiaxes: tuple[float, float],
        turn: float = 0.0,  # angle between the first one and the yarn
        direction: int = NORMAL,  # of the force
    ) -> PatchResponse:
        """Return the displacement under a unit force with Hertz's distribution on an ellipse in the yarn's middle."""
        place, weight = _disc()
        x, y = (place * semiaxes).T
        along = np.cos(turn) * x - np.sin(turn) * y
        across = np.sin(turn) * x + np.cos(turn) * y
        section = np.stack([np.sqrt(1 - across**2), across], axis=1)
        weights = self._space.matrix(np.zeros(len(x), dtype=int), section, 0.5 * LENGTH + along)
        load = np.zeros((self._space.size, 3))
        load[:, direction] = weights.T @ weight
        moved = np.zeros(load.size)
        moved[self._free] = self._factors.solve(load.ravel()[self._free])
        displacement = weights @ moved.reshape(-1, 3)[:, direction]
        shape = np.stack([np.ones_like(x), -(x**2), -(y**2)], axis=1)
        weighted = weight[:, None] * shape
        middle, *fall = np.linalg.solve(shape.T @ weighted, weighted.T @ displacement).tolist()
        return PatchResponse(middle, (fall[0], fall[1]), float(weight @ displacement))


@lru_cache(maxsize=32)
def patched_yarn(degree: int, span: float, spline_degree: int, poisson: float) -> PatchedYarn:
    """Return a yarn of equal spans, whose patch lies at `PHASE` of one."""
    number = np.arange(-np.ceil(LENGTH / span), np.ceil(LENGTH / span) + 1)
    inner = 0.5 * LENGTH + span * (number - PHASE)
    inner = inner[(inner > 0.25 * span) & (inner < LENGTH - 0.25 * span)]
    breaks = np.concatenate([[0.0], inner, [LENGTH]])
    return PatchedYarn(yarn_space(breaks, degree, spline_degree), poisson)


@lru_cache(maxsize=2)
def _rich(poisson: float) -> PatchedYarn:
    """Return a yarn that shows true values on a patch of radius `RESOLVED`."""
    fine = np.linspace(-NEAR, NEAR, round(2 * NEAR / FINE) + 1)
    coarse = np.linspace(NEAR, 0.5 * LENGTH, round((0.5 * LENGTH - NEAR) / (2 * FINE)) + 1)[1:]
    breaks = 0.5 * LENGTH + np.concatenate([-coarse[::-1], fine, coarse])
    degrees = np.where(np.abs(0.5 * (breaks[1:] + breaks[:-1]) - 0.5 * LENGTH) < NEAR, RICH, RICH - 3)
    return PatchedYarn(yarn_space(breaks, degrees), poisson)


@lru_cache(maxsize=8)
def far_compliance(poisson: float, direction: int = NORMAL) -> float:
    """Return C_far, the compliance of a yarn beyond that of the half space, for a force in a direction."""
    response = _rich(poisson).response((RESOLVED, RESOLVED), direction=direction)
    return response.mean - half_space_compliance(RESOLVED, poisson, direction)


def half_space_compliance(radius: float, poisson: float, direction: int = NORMAL) -> float:
    """Return C_half: the weighted mean displacement of a half space under Hertz's distribution on a circle.

    Under a force along the surface the compliance is (2 - nu) / (2 (1 - nu)) times as large (Johnson 1985,
    section 7.2).

    Parameters
    ----------
    radius : float
        Radius of the circle, over the radius of the yarn.
    poisson : float
        Poisson's ratio.
    direction : int
        Direction of the force: `NORMAL`, `ALONG` or `ACROSS`.

    Examples
    --------
    >>> half_space_compliance(0.5, 0.0)
    1.2
    """
    normal = 0.6 * (1 - poisson**2) / radius
    return normal if direction == NORMAL else normal * (2 - poisson) / (2 * (1 - poisson))


@lru_cache(maxsize=1)
def _disc() -> tuple[np.ndarray, np.ndarray]:
    """Return places (k, 2) on the unit disc and weights (k,) of Hertz's pressure there, whose sum is 1."""
    height, weight = np.polynomial.legendre.leggauss(8)
    height = 0.5 * (height + 1)  # sqrt(1 - r^2)
    angle = 2 * np.pi * (np.arange(16) + 0.5) / 16
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    place = (np.sqrt(1 - height**2)[:, None, None] * ring).reshape(-1, 2)
    return place, np.repeat(1.5 * weight * height**2 / 16, 16)
