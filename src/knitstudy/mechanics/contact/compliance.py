"""Local compliance of a loaded patch on a yarn, beyond the resolution of a low-order model (docs/theory/theory.md).

Of ties of spline yarns (`missing_tie_compliance`) and of their contact (`PatchedYarn`); of joints of beams see
`core.cylinder`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import chebyshev

from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.assembly import Assembly
from knitstudy.mechanics.core.cylinder import ACROSS, ALONG, NORMAL, cylinder_patch, patch_rule
from knitstudy.mechanics.core.linear import factorise
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.spline_yarn.space import Space, YarnSpace, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

# The part of a patch's compliance that a space of solid yarns shows, and the missing part
# Forces spread over a small disc on the side of a straight yarn, with the weights of its moments (the mean and both
# linear ones), move the same moments of its displacement: a compliance. That of the yarn is known in closed form, that
# of the space from its own stiffness. Their difference is positive, since the space is a part of all displacements, and
# local. Both are taken of endless yarns with patches at least `APART_IN_PATCH` radii apart, whose forces alternate in
# sign: nothing has to be held, and waves are independent of each other.

APART_IN_PATCH = 6.0  # least distance of patches along the yarn, in radii
DIGITS = 2  # of the length of a span over the radius: spans that differ by less are one


def missing_tie_compliance(
    space: Space,
    radius: float,  # of the yarns [m]
    youngs_modulus: float,
    poisson_ratio: float,
    yarn: Ints,  # (k,)
    arc_length: Floats,  # (k,), where the patches lie [m]
    patch: float,  # their radius [m]
) -> Floats:
    """Return the compliance (k, 2) of the mean and of the linear moments of patches that yarns do not show [m/N].

    The same for every direction of the force, and for both linear moments: means over all that differs, so that a tie
    with this compliance does not notice how the yarns have turned.
    """
    compliance = np.empty((len(yarn), 2))
    for number in np.unique(yarn):
        here = np.flatnonzero(yarn == number)
        own = space.yarns[number]
        spline = own.spline
        span = spline.span_at(arc_length[here])
        first = spline.first[span]
        degree = own.degrees[first[:, None] + np.arange(spline.degree + 1)].min(axis=1)
        low, high = spline.spans[span].T
        place = (arc_length[here] - low) / (high - low)
        length = np.round((high - low) / radius, DIGITS)
        size = round(patch / radius, DIGITS + 1)
        for p, of_span in set(zip(degree.tolist(), length.tolist(), strict=True)):
            these = (degree == p) & (length == of_span)
            shape = _along_a_span(p, spline.degree, of_span, size, poisson_ratio)
            compliance[here[these]] = np.cos(2 * np.pi * place[these, None] * np.arange(3)) @ shape
    return compliance / (youngs_modulus * radius)


@cache
def _along_a_span(degree: int, spline_degree: int, span: float, patch: float, poisson_ratio: float) -> Floats:
    """Return the missing compliance over its place in a span as amplitudes (3, 2) of cosines, times E R."""
    places = 0.0, 0.25, 0.5
    full = [missing_compliance(degree, spline_degree, span, place, patch, poisson_ratio) for place in places]
    diagonal = np.diagonal(full, axis1=1, axis2=2).reshape(3, 3, 3).mean(axis=2)  # over the components
    values = np.stack([diagonal[:, 0], diagonal[:, 1:].mean(axis=1)], axis=1)
    return np.array([[1, 2, 1], [2, 0, -2], [1, -2, 1]]) / 4 @ values


def missing_compliance(
    degree: int,  # p
    spline_degree: int,  # d
    span: float,  # length of the spans around the patch, over the yarn's radius
    place: float,  # of the patch's middle in its span, 0 to 1
    radius: float,  # of the patch, over the yarn's
    poisson_ratio: float,
) -> Floats:
    """Return the compliance (9, 9) that a space does not show of a patch, times E R.

    Rows and columns are moments, and for each the components along the normal, along the yarn and across it.
    """
    spans = int(np.ceil(APART_IN_PATCH / span))
    exact = cylinder_patch(radius, spans * span, poisson_ratio)
    return exact - space_patch(degree, spline_degree, span, place, radius, poisson_ratio)


@cache
def space_patch(
    degree: int, spline_degree: int, span: float, place: float, radius: float, poisson_ratio: float
) -> Floats:
    """Return the compliance (9, 9) of patches as a space shows it, times E R; arguments of `missing_compliance`."""
    spans = int(np.ceil(APART_IN_PATCH / span))
    d = spline_degree
    angle, along, weight = patch_rule(radius, rings=degree + d + 2)
    across = disc.values(degree, np.stack([np.cos(angle), np.sin(angle)], axis=-1))  # (q, n)
    size = 3 * across.shape[1]
    # Span number d of so many is as if the yarn had no ends; spline 0 begins the span of place 0.
    yarn = yarn_space(span * np.arange(2 * d + 2), degree, d)
    along = along + place * span
    layer = np.floor(along / span)
    spline = yarn.spline.basis(d * span + along - layer * span)[1][0]
    phase = np.pi * np.arange(1, 2 * spans, 2) / spans  # between neighbouring spans, (w,)
    offset = np.arange(d + 1)
    turn = np.exp(-1j * phase[:, None, None] * (layer[:, None] + offset))  # (w, q, d + 1)
    wave = np.einsum("wqo,qo->wq", turn, spline)
    load = np.einsum("wq,jq,qn->wnj", wave, weight, across)  # the same for each component
    (group,) = span_groups(Space((yarn,)), straight(yarn), Hencky(1.0, poisson_ratio))
    rest = np.zeros((1, group.connectivity.shape[1], 3))
    blocks = group.elements.respond(slice(d, d + 1), rest, stiffness=True).tangent
    blocks = blocks.reshape(d + 1, size // 3, d + 1, size // 3, 3, 3)
    apart = np.exp(1j * phase[:, None, None] * (offset - offset[:, None]))
    stiffness = np.einsum("wij,injmab->wnamb", apart, blocks, optimize=True).reshape(-1, size, size)
    right = np.einsum("wnj,ab->wnajb", load, np.eye(3)).reshape(-1, size, 9)
    solution = np.linalg.solve(stiffness, right)
    compliance = np.real(np.einsum("wia,wib->ab", right.conj(), solution)) / spans
    order = (3 * np.arange(3)[:, None] + [NORMAL, ALONG, ACROSS]).ravel()
    return compliance[np.ix_(order, order)]


def straight(yarn: YarnSpace) -> Floats:
    """Return the nodes (N, 3) of a straight yarn of radius 1 along the third axis."""
    spline = yarn.spline
    middle = sliding_window_view(spline.knots[1:-1], spline.degree).mean(axis=1)  # of the functions
    d1, d2, axis = (np.tile(d, (spline.size, 1)) for d in np.eye(3))
    return yarn.coefficients(middle[:, None] * axis, d1, d2, 1.0)


# Displacements that a space shows under a patch of load: a straight yarn, held at its ends, in small strains.
#
# Lengths are over the yarn's radius, stiffnesses over E times the radius. True values are known from a space with far
# more functions, on a patch that it resolves, and from the half space, which is exact for the local part:
#
#     C(a) = C_half(a) + C_far,   C_half(a) = 0.6 (1 - nu^2) / a for Hertz's pressure on a circle
#
# C_far belongs to the yarn and to how it is held, and is the same for all shapes of patch: with degree 8 and spans of
# 0.3 it is constant within 0.5% for a from 0.3 to 0.5. C_half is the mean of Hertz's displacement, weighted with his
# pressure (Johnson 1985, Contact Mechanics, sections 4.2 and 7.2).

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
        self._last: tuple[Any, ...] = (None,)

    def response(
        self,
        semiaxes: tuple[float, float],
        turn: float = 0.0,  # angle between the first one and the yarn
        direction: int = NORMAL,  # of the force
    ) -> PatchResponse:
        """Return the displacement under a unit force with Hertz's distribution on an ellipse in the yarn's middle."""
        shape, (nodes, weights) = self._patch(semiaxes, turn)
        weight = _disc()[1]
        load = np.zeros((self._space.size, 3))
        load[:, direction] = np.bincount(nodes.ravel(), (weight[:, None] * weights).ravel(), len(load))
        moved = np.zeros(load.size)
        moved[self._free] = self._factors.solve(load.ravel()[self._free])
        displacement = (weights * moved[3 * nodes + direction]).sum(axis=1)
        weighted = weight[:, None] * shape
        middle, *fall = np.linalg.solve(shape.T @ weighted, weighted.T @ displacement).tolist()
        return PatchResponse(middle, (fall[0], fall[1]), float(weight @ displacement))

    def _patch(self, semiaxes: tuple[float, float], turn: float) -> tuple[Floats, tuple[Ints, Floats]]:
        """Return 1, -x^2, -y^2 (k, 3) on the patch's axes, and nodes and weights (k, c) of its places; kept for one."""
        if self._last[0] != (semiaxes, turn):
            x, y = (_disc()[0] * semiaxes).T
            along = np.cos(turn) * x - np.sin(turn) * y
            across = np.sin(turn) * x + np.cos(turn) * y
            section = np.stack([np.sqrt(1 - across**2), across], axis=1)
            (own,) = self._space.yarns
            first, splines = own.spline.basis(0.5 * LENGTH + along)
            weights = own.weights(first, splines[0], disc.values(own.degree, section))
            self._last = (semiaxes, turn), np.stack([np.ones_like(x), -(x**2), -(y**2)], axis=1), weights
        return self._last[1:]


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


# C_far of every direction for 0 <= nu <= 1/2, as a Chebyshev series in (3 nu - 1) / (1 - nu): this goes from -1 to 1,
# and the series converges fastest in it. `python tests/verification/test_contact_indentation.py` makes it.
# fmt: off
FAR = np.array([
    [1.99343980859, 0.03425445129, -0.00149001226, -0.0001590229, -0.00011631792, 9.099527e-05, -4.004536e-05,
     1.400194e-05, -4.35217e-06, 1.25823e-06, -3.4722e-07, 9.281e-08, -2.427e-08, 6.25e-09, -1.59e-09, 4e-10],
    [4.54767802976, 0.73270865681, -0.13156074771, 0.02283501007, -0.00399699693, 0.00070434088, -0.00012715317,
     2.367853e-05, -4.59121e-06, 9.2944e-07, -1.964e-07, 4.309e-08, -9.75e-09, 2.26e-09, -5.3e-10, 1.3e-10],
    [0.36642321829, -0.02427163483, 0.01004011496, -0.00279894683, 0.00055840788, -0.00010237664, 1.210415e-05,
     -1.02219e-06, -5.2883e-07, 1.6829e-07, -9.193e-08, 1.72e-08, -8.69e-09, 9.9e-10, -7.6e-10, 1e-11],
])
# fmt: on


def far_compliance(poisson: float, direction: int = NORMAL) -> float:
    """Return C_far, the compliance of a yarn beyond that of the half space, for a force in a direction.

    Examples
    --------
    >>> round(far_compliance(0.4), 3)
    2.006
    """
    if 0 <= poisson <= 0.5:
        return float(chebyshev.chebval((3 * poisson - 1) / (1 - poisson), FAR[direction]))
    return computed_far_compliance(poisson, direction)


@lru_cache(maxsize=8)
def computed_far_compliance(poisson: float, direction: int = NORMAL) -> float:
    """Return C_far from the yarn itself."""
    response = _rich(poisson).response((RESOLVED, RESOLVED), direction=direction)
    return response.mean - half_space_compliance(RESOLVED, poisson, direction)


def half_space_compliance(radius: float, poisson: float, direction: int = NORMAL) -> float:
    """Return C_half: the weighted mean displacement of a half space under Hertz's distribution on a circle.

    The radius of the circle is over that of the yarn. Under a force along the surface, in the direction `ALONG` or
    `ACROSS`, the compliance is (2 - nu) / (2 (1 - nu)) times as large (Johnson 1985, section 7.2).

    Examples
    --------
    >>> half_space_compliance(0.5, 0.0)
    1.2
    """
    normal = 0.6 * (1 - poisson**2) / radius
    return normal if direction == NORMAL else normal * (2 - poisson) / (2 * (1 - poisson))


@lru_cache(maxsize=1)
def _disc() -> tuple[Floats, Floats]:
    """Return places (k, 2) on the unit disc and weights (k,) of Hertz's pressure there, whose sum is 1."""
    height, weight = np.polynomial.legendre.leggauss(8)
    height = 0.5 * (height + 1)  # sqrt(1 - r^2)
    angle = 2 * np.pi * (np.arange(16) + 0.5) / 16
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    place = (np.sqrt(1 - height**2)[:, None, None] * ring).reshape(-1, 2)
    return place, np.repeat(1.5 * weight * height**2 / 16, 16)


def stiffness_at_rest(groups: Sequence[ElementGroup], nodes: int) -> sp.bsr_matrix:
    """Return the stiffness (3 N, 3 N) [N/m] of groups of elements between N nodes that have not moved."""
    assembly = Assembly([group.connectivity for group in groups], nodes)
    total = assembly.begin_stiffness()
    for number, batch in enumerate(assembly.batches):
        group = groups[batch.group]
        rest = np.zeros((batch.count, group.connectivity.shape[1], 3))
        total.put(number, group.elements.respond(batch.part, rest, stiffness=True).tangent)
    return assembly.matrix(total)
