"""Solids that repeat themselves: unknowns out of fewer ones, and spline yarns that wrap around."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import MeshError
from knitstudy.mechanics.contact.solid import SolidModel
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.basis import Spline
from knitstudy.mechanics.core.linear import factorise
from knitstudy.mechanics.core.model import Response
from knitstudy.mechanics.solids.spline_yarn.space import YarnSpace


class PeriodicModel:
    """A model whose unknowns are weighted sums of fewer ones, u = T v.

    The last three of v are the lattice: the strains in the plane times `Lattice.lengths` [m]. Forces on the edges of
    the cell are conjugate to them.
    """

    block = 3

    def __init__(
        self,
        model: SolidModel,  # of all nodes, images included; every element, tie and contact once
        spread: sp.csr_matrix,  # (model.size, size), T, of full rank
    ) -> None:
        self.model, self.spread = model, spread
        self._collect = sp.csr_matrix(spread.T)
        self.size = spread.shape[1]
        self.scale = np.ones(self.size)
        self.length = model.length
        # Its states are the states of the model.
        self.start, self.begin = model.start, model.begin
        self.settle, self.commit = model.settle, model.commit
        last = sp.eye(self.size, 3, k=3 - self.size).toarray()
        self._measure = (spread @ factorise(self._collect @ spread).solve(last)).T

    @property
    def lattice(self) -> Ints:
        """Unknowns (3,) of the lattice."""
        return self.size + np.arange(-3, 0)

    def stretched(self, displacement: Floats) -> Floats:
        """Return the unknowns (3,) of the lattice in a displacement (model.size,) of the model [m]."""
        return self._measure @ displacement

    def advance(self, state: Any, step: Floats) -> Any:
        """Return the state displaced by `step` (size,) [m]."""
        return self.model.advance(state, self.spread @ step)

    def motion_of_neighbours(self, state: Any, step: Floats) -> float:
        """Return the largest motion against each other of what is near each other, images included [m]."""
        return self.model.motion_of_neighbours(state, self.spread @ step)

    def respond(self, state: Any, stiffness: bool) -> Response:
        """Return T^T of the model's forces and, if asked, T^T K T: as a whole, for a direct solver."""
        answer = self.model.respond(state, stiffness)
        return replace(
            answer,
            force=self._collect @ answer.force,
            stiffness=self.collected(answer.stiffness) if stiffness else None,
            unsymmetric=None,
            moved=None,
            touching=np.empty(0, dtype=np.int64),
        )

    def collected(self, stiffness: sp.spmatrix) -> sp.csr_matrix:
        """Return T^T K T (size, size)."""
        total = sp.csr_matrix(self._collect @ sp.csr_matrix(stiffness) @ self.spread)
        total.sort_indices()
        return total


def condensed(
    stiffness: sp.spmatrix,  # (size, size), symmetric
    fields: Floats,  # (size, m)
    spread: sp.csr_matrix,  # (size, n), S
    held: Ints,  # (k,), of the n: they stay 0, so that nothing can move for nothing
) -> Floats:
    """Return the symmetric stiffness (m, m) against the amounts of fields, u = S q + fields a, with q in balance.

    Raises ConvergenceError if something else moves without any stiffness.

    Examples
    --------
    >>> springs = sp.csr_matrix([[1.0, -1.0, 0.0], [-1.0, 3.0, -2.0], [0.0, -2.0, 2.0]])  # 1 and 2 N/m in a row
    >>> ends, middle = np.array([[0.0], [0.0], [1.0]]), sp.csr_matrix([[0.0], [1.0], [0.0]])
    >>> condensed(springs, ends, middle, np.array([], dtype=int)).round(9).tolist()
    [[0.666666667]]
    """
    free = np.ones(spread.shape[1], dtype=bool)
    free[held] = False
    kept = sp.csr_matrix(spread[:, free])
    pull = sp.csr_matrix(stiffness) @ fields
    across = kept.T @ pull
    answer = factorise(kept.T @ stiffness @ kept).solve(across)
    condensed_stiffness = fields.T @ pull - across.T @ answer
    return 0.5 * (condensed_stiffness + condensed_stiffness.T)


# The seam of a yarn that goes on as its own image: B-splines that wrap around, out of B-splines with two ends
# With E spans of degree d there are E functions that wrap around, and E + d on the open knot vector of the same spans.
# Number the wrapped ones on beyond the end: function i + E is the image of function i, and of a yarn it carries the
# coefficient of i plus the jump from a yarn to its image. The open functions span all of them,
#
#     U_open = R U,    U_i+E = U_i + jump_i,    i = 0 .. d - 1,
#
# so that the yarn is as smooth over the seam as it is within: d - 1 derivatives, not only the value, go on. A yarn with
# spans of its images before and after its own (`YarnSpace.beyond`) has functions of several periods:
#
#     U_i+mE = U_i + m jump_i.

ROUNDING = 1e-12  # entries of R below are none


@dataclass(frozen=True, eq=False)
class Seam:
    """Coefficients of one yarn out of coefficients that wrap around, X_open = W X + S jump."""

    wrapped: sp.csr_matrix  # (n, p) W: nodes of the yarn with two ends from nodes that wrap around
    beyond: sp.csr_matrix  # (n, p) S: how much of the jump of each its nodes carry
    order: Ints  # (p,), function over the section of every node that wraps around

    @property
    def unity(self) -> Floats:
        """Coefficients (p,) of the constant 1."""
        return (self.order == 0).astype(float)

    def nodes(self, wrapped: Floats, period: Floats) -> Floats:
        """Return the undeformed nodes (n, 3) from nodes that wrap around (p, 3), the image `period` (3,) away [m]."""
        return self.wrapped @ wrapped + self.beyond @ np.multiply.outer(self.unity, period)


def seam(yarn: YarnSpace) -> Seam:
    """Return the seam of a yarn's space.

    Over the section, a wrapped spline has only the functions that all its open splines have.

    Raises MeshError if there are fewer spans than the degree of the splines.
    """
    spline, beyond = yarn.spline, yarn.beyond
    spans = spline.size - spline.degree - 2 * beyond
    number = np.arange(spline.size)
    periods, wrapped_number = np.divmod(number - beyond, spans)
    around = sp.csr_matrix((np.ones(spline.size), (number, wrapped_number)))  # (E + d, E)
    open_from_wrapped = conversion(spline, beyond)
    has = disc.size(yarn.degrees)
    made_of = abs(open_from_wrapped) @ around
    # At the ends of images splines reach over fewer spans.
    whole = slice(beyond, spline.size - beyond)
    counts = np.where(made_of[whole].toarray() > 0, has[whole, None], yarn.stride).min(axis=0)
    k = np.arange(yarn.stride)
    wrapped = k < counts[:, None]

    def of_functions(splines: sp.csr_matrix) -> sp.csr_matrix:
        """The same of all functions over the section: (n, p) of (J, E)."""
        every = sp.kron(splines, sp.identity(yarn.stride), format="csr")
        return every[(k < has[:, None]).ravel()][:, wrapped.ravel()]

    jumps = open_from_wrapped @ sp.diags(periods.astype(float)) @ around
    return Seam(of_functions(open_from_wrapped @ around), of_functions(jumps), np.nonzero(wrapped)[1])


def conversion(spline: Spline, beyond: int = 0) -> sp.csr_matrix:
    """Return R (J, E + d): open splines' coefficients from coefficients of splines that go on beyond both ends.

    Both are bases of the same functions on the yarn: R is found from their values at J places. So many spans `beyond`
    at either end are of images of the yarn.

    Raises MeshError if there are fewer spans than the degree.

    Examples
    --------
    >>> from knitstudy.mechanics.solids.spline_yarn.space import yarn_space
    >>> matrix = conversion(yarn_space(np.linspace(0, 1, 5), 2).spline)
    >>> matrix.shape, matrix.sum(axis=1).round(12).tolist() == 7 * [[1.0]]  # both represent the constant 1
    ((7, 7), True)
    """
    d, low, high = spline.degree, *spline.spans.T
    if len(low) < d:
        raise MeshError(
            f"{len(low)} spans of a yarn cannot wrap around with splines of degree {d}; use more spans"
        )
    spans = len(low) - 2 * beyond
    period = low[beyond + spans - 1] + (high - low)[beyond + spans - 1] - low[beyond]
    breaks = np.append(low, high[-1])
    along = Spline.on(np.concatenate([breaks[:spans] - period, breaks, breaks[-spans:] + period]), d)
    # Number of splines of `along` that begin before the yarn.
    first = np.searchsorted(along.spans[:, 0], low[0] - 1e-9 * period)
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1))
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    goal = along.matrix(s)[:, first : first + spline.size].toarray()
    solution = np.linalg.lstsq(spline.matrix(s).toarray(), goal, rcond=None)[0]
    solution[np.abs(solution) < ROUNDING] = 0.0
    return sp.csr_matrix(solution)
