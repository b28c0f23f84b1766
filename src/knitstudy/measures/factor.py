"""Size of the factor of a symmetric sparse matrix after nested dissection, counted without its numbers.

A direct solver eliminates the unknowns of a stiffness matrix in an order that creates few entries. Nested dissection
(George 1973, "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10) removes a set of vertices,
the separator, from the graph of the unknowns, so that the rest falls apart into parts of about the same size, and does
the same with each part. Separators are eliminated after the parts that they separate.

Before a separator of n unknowns is eliminated, its unknowns are coupled with each other and with the b unknowns of
larger separators that touch its part. Its front is a dense matrix of n + b rows, of which the factor keeps n columns:
n (n + 1) / 2 + n b entries. The sum over all separators is the size of the factor. A multifrontal solver needs memory
for the largest front at least, and memory for all of the factor where none of it goes to a disk.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

BYTES = 8  # of an entry, in double precision
OFF_MIDDLE = 1 / 6  # largest distance of a cut from the median, over the vertices of its part


@dataclass(frozen=True, eq=False)
class UnknownGraph:
    """Vertices that stand for one or more unknowns, and pairs of them whose unknowns have a common stiffness."""

    places: Floats  # (N, d) [m]
    unknowns: Ints  # (N,) of every vertex
    pairs: Ints  # (E, 2) of different vertices, in any order, each once or several times


@dataclass(frozen=True)
class FactorSize:
    """What the factor of a symmetric matrix takes; of each symmetric block one triangle is kept."""

    entries: int  # of the factor
    front: int  # rows of the largest front

    @property
    def factor_bytes(self) -> int:
        """Memory for all of the factor."""
        return BYTES * self.entries

    @property
    def front_bytes(self) -> int:
        """Memory for a triangle of the largest front."""
        return BYTES * (self.front * (self.front + 1) // 2)


def factor_size(graph: UnknownGraph) -> FactorSize:
    """Return the size of the factor after nested dissection by coordinates (`dissect`).

    Fronts count as dense, so the result is an upper bound of what elimination in this order takes.

    Examples
    --------
    >>> chain = np.arange(7)
    >>> graph = UnknownGraph(chain[:, None] * 1.0, np.ones(7, dtype=int), np.column_stack([chain[:-1], chain[1:]]))
    >>> factor_size(graph)  # by hand: 1 of the middle, 2 + 2 of the middles beside it, 2 + 3 + 3 + 2 of the rest
    FactorSize(entries=15, front=3)
    """
    entries = front = 0
    for _, own, boundary in dissect(graph):
        entries += int(np.sum(own * (own + 1) / 2 + own * boundary))
        front = max(front, int((own + boundary).max()))
    return FactorSize(entries, front)


def dissect(graph: UnknownGraph) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield the separators of nested dissection, the largest first: the last ones are eliminated first.

    Every connected part of the graph is cut across its longest side, where its separator has the fewest unknowns within
    `OFF_MIDDLE` of the median. All p parts are cut at once, then what is left of them, until no vertex is left.

    Yields the vertices (k,) of all p separators, the unknowns (p,) of each, and those (p,) of earlier separators that
    touch its part.
    """
    remaining = np.arange(len(graph.places))
    # Pairs of vertices that remain, and of one that remains with one of a separator
    inside = np.sort(graph.pairs, axis=1)
    outside = np.empty((0, 2), dtype=np.int64)
    while len(remaining):
        part, count = _parts(remaining, inside, len(graph.places))
        separates = _separators(graph, remaining, inside, part, count)
        separators = remaining[separates]
        own = np.bincount(part[separators], graph.unknowns[separators], count).astype(float)
        yield separators, own, _boundaries(graph, outside, part, count)
        gone = np.zeros(len(graph.places), dtype=bool)
        gone[separators] = True
        remaining = remaining[~separates]
        ends = gone[inside]
        first, second = inside[ends[:, 0] & ~ends[:, 1]], inside[ends[:, 1] & ~ends[:, 0]]
        outside = np.concatenate([outside[~gone[outside[:, 0]]], first[:, ::-1], second])
        inside = inside[~ends.any(axis=1)]


def _parts(remaining: Ints, inside: Ints, size: int) -> tuple[Ints, int]:
    """Return the connected part of every vertex (N,) that remains, -1 of the others, and the number of parts."""
    number = np.full(size, -1)
    number[remaining] = np.arange(len(remaining))
    joined = coo_array(
        (np.ones(len(inside), dtype=np.int8), tuple(number[inside].T)), shape=2 * (len(remaining),)
    )
    count, labels = connected_components(joined, directed=False)
    part = np.full(size, -1)
    part[remaining] = labels
    return part, count


def _separators(graph: UnknownGraph, remaining: Ints, inside: Ints, part: Ints, count: int) -> Bools:
    """Return which (k,) of the vertices that remain (k,) separate their parts; a part of one vertex is its own.

    A cut between two neighbours in the order along the longest side leaves vertices below it that are paired with one
    above it, and the other way round. The fewer unknowns of the two are its separator.
    """
    own = part[remaining]
    size = np.bincount(own, minlength=count)
    order = np.lexsort((_along_longest_side(graph.places[remaining], own, count), own))
    position = np.empty(len(part), dtype=np.int64)  # of a vertex in this order, part by part
    position[remaining[order]] = np.arange(len(order))
    # Positions of the first and the last vertex that a vertex is paired with, itself among them
    nearest, farthest = position.copy(), position.copy()
    for one, other in (inside.T, inside.T[::-1]):
        np.minimum.at(nearest, one, position[other])
        np.maximum.at(farthest, one, position[other])
    position, nearest, farthest = (each[remaining] for each in (position, nearest, farthest))
    weight = graph.unknowns[remaining]
    below = _sum_of_ranges(position, farthest, weight)  # (k,) unknowns below a cut before every position
    above = _sum_of_ranges(nearest, position, weight)

    first = np.cumsum(size) - size
    in_order = own[order]
    off = np.abs(np.arange(len(order)) - first[in_order] - 0.5 * size[in_order])
    allowed = off <= OFF_MIDDLE * size[in_order]
    best = np.lexsort((off, np.where(allowed, np.minimum(below, above), np.inf), in_order))[first]  # (count,)
    cut = best[own]
    lower = (position < cut) & (farthest >= cut)
    upper = (position >= cut) & (nearest < cut)
    return np.where((below <= above)[cut], lower, upper) | (size[own] == 1)


def _sum_of_ranges(low: Ints, high: Ints, weight: Ints) -> Floats:
    """Return the sum (k,) at every position of the weights (k,) whose ranges, above low and up to high, hold it."""
    change = np.zeros(len(low) + 1)
    np.add.at(change, low + 1, weight)
    np.subtract.at(change, high + 1, weight)
    return np.cumsum(change)[:-1]


def _along_longest_side(places: Floats, part: Ints, count: int) -> Floats:
    """Return the coordinate (k,) of places (k, d) along the longest side of their part."""
    by_part = np.argsort(part, kind="stable")
    size = np.bincount(part, minlength=count)
    first = np.cumsum(size) - size
    extent = np.maximum.reduceat(places[by_part], first) - np.minimum.reduceat(places[by_part], first)
    along: Floats = places[np.arange(len(part)), extent.argmax(axis=1)[part]]
    return along


def _boundaries(graph: UnknownGraph, outside: Ints, part: Ints, count: int) -> Floats:
    """Return the unknowns (count,) of earlier separators that touch every part."""
    size = len(graph.places)
    touching = np.unique(part[outside[:, 0]] * size + outside[:, 1])
    return np.bincount(touching // size, graph.unknowns[touching % size], count).astype(float)
