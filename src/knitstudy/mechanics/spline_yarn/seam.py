"""The seam of a yarn that goes on as its own image: B-splines that wrap around, out of those with two ends.

With E spans of degree d there are E functions that wrap around, and E + d on the open knot vector of the same spans.
Number the wrapped ones on beyond the end: function i + E is the image of function i, and of a yarn it carries the
coefficient of i plus the jump from a yarn to its image. The open functions span all of them,

    U_open = R U,    U_i+E = U_i + jump_i,    i = 0 .. d - 1,

so that the yarn is as smooth over the seam as it is within: d - 1 derivatives, not only the value, go on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import MeshError
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mechanics.spline_yarn.basis import Spline
from knitstudy.mechanics.spline_yarn.space import YarnSpace

ROUNDING = 1e-12
"""Entries of R below are none."""


@dataclass(frozen=True, eq=False)
class Seam:
    """Coefficients of one yarn out of those that wrap around, X_open = W X + S jump."""

    wrapped: sp.csr_matrix  # (n, p) W: nodes of the yarn with two ends from those that wrap around
    beyond: sp.csr_matrix  # (n, p) S: how much of the jump of each its nodes carry
    order: np.ndarray  # int (p,), function over the section of every node that wraps around

    @property
    def unity(self) -> np.ndarray:
        """Coefficients (p,) of the constant 1."""
        return (self.order == 0).astype(float)

    def nodes(self, wrapped: np.ndarray, period: np.ndarray) -> np.ndarray:
        """Return the undeformed nodes (n, 3) from those that wrap around (p, 3), the image `period` (3,) away [m]."""
        return self.wrapped @ wrapped + self.beyond @ np.multiply.outer(self.unity, period)


def seam(yarn: YarnSpace) -> Seam:
    """Return the seam of a yarn's space.

    Of functions over the section a wrapped spline has those that all open splines have which it is made of.

    Raises
    ------
    MeshError
        If there are fewer spans than the degree of the splines.
    """
    spline = yarn.spline
    open_from_wrapped = conversion(spline)  # (J, E + d)
    spans = spline.size - spline.degree
    column = np.arange(spline.size) % spans
    touched = sp.coo_matrix(open_from_wrapped)
    counts = np.full(spans, disc.size(yarn.degree))
    np.minimum.at(counts, column[touched.col], disc.size(yarn.degrees)[touched.row])
    first = np.concatenate([[0], np.cumsum(counts)])
    wrapped, beyond = (
        _spread(touched, yarn, counts, first, here, column)
        for here in (touched.col >= 0, touched.col >= spans)
    )
    order = np.arange(first[-1]) - np.repeat(first[:-1], counts)
    return Seam(wrapped, beyond, order)


def conversion(spline: Spline) -> sp.csr_matrix:
    """Return R (J, E + d): open splines' coefficients from those of splines that go on beyond both ends.

    Both are bases of the same functions on the yarn: R is found from their values at J places.

    Raises
    ------
    MeshError
        If there are fewer spans than the degree.
    """
    d, low, high = spline.degree, *spline.spans.T
    if len(low) < d:
        raise MeshError(
            f"{len(low)} spans of a yarn cannot wrap around with splines of degree {d}; use more spans"
        )
    period = high[-1] - low[0]
    breaks = np.append(low, high[-1])
    along = Spline.on(np.concatenate([breaks[:-1] - period, breaks, breaks[1:] + period]), d)
    first = np.searchsorted(
        along.spans[:, 0], low[0] - 1e-9 * period
    )  # its number of splines before the yarn
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1))
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    goal = along.matrix(s)[:, first : first + spline.size].toarray()
    found = np.linalg.lstsq(spline.matrix(s).toarray(), goal, rcond=None)[0]
    found[np.abs(found) < ROUNDING] = 0.0
    return sp.csr_matrix(found)


def _spread(
    touched: sp.coo_matrix,
    yarn: YarnSpace,
    counts: np.ndarray,
    first: np.ndarray,
    here: np.ndarray,
    column: np.ndarray,
) -> sp.csr_matrix:
    """Return chosen entries of R for all functions over the section (n, p)."""
    row, to, value = touched.row[here], column[touched.col[here]], touched.data[here]
    k = np.concatenate([np.arange(count) for count in counts[to]]) if len(to) else np.empty(0, dtype=int)
    each = np.repeat(np.arange(len(to)), counts[to])
    matrix = sp.csr_matrix(
        (value[each], (yarn.first_node[row[each]] + k, first[to[each]] + k)), shape=(yarn.size, first[-1])
    )
    matrix.sum_duplicates()
    return matrix
