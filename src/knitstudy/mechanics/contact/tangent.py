"""Contact stiffness: quadrature points and the consistent tangent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.friction import FrictionPoints
from knitstudy.mechanics.contact.surface import Kinematics, Stencil, Surfaces, metric
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Reserve, by_parts, share

# Gauss points on smooth surfaces: where contact is checked, and the area that each point stands for

CHUNK = 20_000  # points evaluated at once; bounds the memory of stencils


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Gauss points of all surfaces, numbered surface by surface, row of cells by row of cells.

    Points of a cell lie alike within it, and cells between edges, so that only areas are kept by points: large knits
    have 30 million of them.
    """

    cells: Ints  # (G, 2), cells of every surface, along and around
    first_cell: Ints  # (G + 1,), first cell of every surface, then the number of all cells
    edges: tuple[np.ndarray, np.ndarray]  # parameters of edges of cells along and around, surface by surface
    local: Floats  # (p, 2), places of the points in a cell, in shares of it
    area: Floats  # (P,), undeformed area of the contact surface that a point stands for [m2]

    @property
    def per_cell(self) -> int:
        """Points in one cell; they follow each other."""
        return len(self.local)

    def points(self, part: slice) -> Ints:
        """Return the numbers (k,) of some of all points."""
        return np.arange(*part.indices(len(self.area)))

    def surface(self, point: Ints) -> Ints:
        """Return the surfaces (k,) that points (k,) lie on."""
        return self.surface_of(point // self.per_cell)

    def places(self, point: Ints) -> tuple[Ints, Floats]:
        """Return the surfaces (k,) that points (k,) lie on, and their parameters (k, 2) there."""
        cell, within = np.divmod(point, self.per_cell)
        return self.within(cell, self.local[within])

    def surface_of(self, cell: Ints) -> Ints:
        """Return the surfaces (k,) that cells (k,) lie on."""
        return np.searchsorted(self.first_cell, cell, side="right") - 1

    def row_and_column(self, cell: Ints) -> tuple[Ints, Ints]:
        """Return the surfaces (k,) of cells (k,), and their rows and columns (k, 2) there."""
        surface = self.surface_of(cell)
        place = np.divmod(cell - self.first_cell[surface], self.cells[surface, 1])
        return surface, np.stack(place, axis=1)

    def within(self, cell: Ints, share: Floats) -> tuple[Ints, Floats]:
        """Return the surfaces (k,) of cells (k,), and the parameters (k, 2) at shares (k, 2) of them."""
        surface, place = self.row_and_column(cell)
        # The edges of a surface are one more than its cells.
        first = np.cumsum(self.cells + 1, axis=0) - self.cells - 1
        number = (first[surface] + place).T
        start, end = (
            np.stack([e[n + i] for e, n in zip(self.edges, number, strict=True)], axis=1) for i in (0, 1)
        )
        return surface, start + (end - start) * share

    def cell_area(self, point: Ints) -> Floats:
        """Return the undeformed areas (k,) of the cells that points (k,) lie in [m2]."""
        return self.area.reshape(-1, self.per_cell)[point // self.per_cell].sum(axis=1)

    @classmethod
    def on(cls, surfaces: Surfaces, carriers: Floats, points: int) -> Quadrature:
        """Place ``points`` x ``points`` Gauss points in every cell of surfaces with undeformed carriers (M, 3)."""
        position, weight = np.polynomial.legendre.leggauss(points)
        position = 0.5 * (position + 1)
        weight = 0.5 * weight
        edges = [surfaces.edges(number) for number in range(len(surfaces.cells))]
        sizes = [np.outer(np.diff(along), np.diff(around)).ravel() for along, around in edges]
        along, around = (np.concatenate(parts) for parts in zip(*edges, strict=True))
        quadrature = cls(
            cells=surfaces.cells,
            first_cell=np.concatenate([[0], np.cumsum(surfaces.cells.prod(axis=1))]),
            edges=(along, around),
            local=np.stack(np.meshgrid(position, position, indexing="ij"), axis=-1).reshape(-1, 2),
            area=np.outer(np.concatenate(sizes), np.outer(weight, weight)).ravel(),
        )

        def stretch(part: slice) -> Floats:
            point = quadrature.points(part)
            return _stretch(surfaces, *quadrature.places(point), carriers)

        quadrature.area[:] *= by_parts(stretch, len(quadrature.area), CHUNK)
        return quadrature


def _stretch(surfaces: Surfaces, surface: Ints, xi: Floats, carriers: Floats) -> Floats:
    """Return the area (k,) of the contact surface a unit of the parameters' area [m2].

    At a depth o below the interpolated surface it is (1 + o tr(m^-1 k)) times as large, k the curvature form.
    """
    _, tangent, second = surfaces.places(surface, xi, carriers)
    normal = np.cross(tangent[:, 1], tangent[:, 0])
    area = np.linalg.norm(normal, axis=1)
    curvature = np.einsum("kai,ki->ka", second, normal / area[:, None])
    m11, m12, m22 = metric(tangent)
    k11, k12, k22 = curvature.T
    trace = (m22 * k11 - 2 * m12 * k12 + m11 * k22) / (m11 * m22 - m12**2)
    return area * (1 + surfaces.offset[surface] * trace)


# The derivative of contact's forces: points' tangents, summed over the carriers of both surfaces

BLOCKS = 9  # entries of a block of two carriers
# Numbers in the products of pairs of cells that are formed at once; bounds the memory.
TANGENT_CHUNK = 1_000_000
SIZES = 8  # batches of pairs of cells with about as many points: zeros fill up the others


class CellPairs:
    """Pairs of cells that touch each other, and the pattern (CSR) of the matrix that couples runs of their carriers."""

    def __init__(
        self,
        key: Ints,  # (g, 2), keys of the stencils on both sides
        nodes: Ints,  # (g, c), carriers of both sides
        block: int,  # carriers of a run; c is a multiple
        count: int,  # number of all carriers
    ) -> None:
        self.key, self.block = key, block
        runs = nodes[:, ::block] // block
        total = count // block
        self.width = runs.shape[1]  # r
        wanted = (runs[:, :, None] * np.int64(total) + runs[:, None, :]).reshape(len(key), self.width**2)
        pattern, place = np.unique(wanted, return_inverse=True)
        place = place.reshape(wanted.shape)
        self.indptr = np.searchsorted(pattern, total * np.arange(total + 1, dtype=np.int64)).astype(np.int32)
        self.indices = (pattern % max(total, 1)).astype(np.int32)
        most = max(1, TANGENT_CHUNK // (BLOCKS * nodes.shape[1] ** 2))
        # Pairs of cells whose products are formed at once, and the sum of their blocks to some rows of the matrix.
        self._chunks: list[tuple[slice, np.ndarray, sp.csr_matrix]] = []
        for low in range(0, len(key), most):
            targets, row = np.unique(place[low : low + most], return_inverse=True)
            ones = np.ones(row.size), (row.ravel(), np.arange(row.size))
            total = sp.csr_matrix(ones, shape=(len(targets), row.size))
            self._chunks.append((slice(low, low + most), targets, total))

    def sum(
        self,
        rows: Floats,  # (a, m, c), V of every point
        inner: Floats,  # (a, m, 9, m), B, for every entry of a block
        pair: Ints,  # (a,), the pair of cells that every point belongs to
        data: Floats,  # (nnz, b b, 9)
    ) -> Floats:
        """Return `data` with the sum over points of V^T B V, as blocks of the pattern."""
        m, c, r, b = *rows.shape[1:], self.width, self.block
        order = np.argsort(pair, kind="stable")
        many = np.bincount(pair, minlength=len(self.key))
        start = np.cumsum(many) - many
        data[:] = 0
        flat = data.reshape(-1, b * b * BLOCKS)
        for here, targets, total in self._chunks:
            product = np.empty((len(many[here]), c, BLOCKS * c))  # ((i, j), c)
            for some in filter(len, np.array_split(np.argsort(many[here], kind="stable"), SIZES)):
                first, count = start[here][some, None], many[here][some, None]
                within = np.arange(count.max())
                filled = within < count  # (g, most): beside each other for every pair of cells
                point = order[np.where(filled, first + within, 0)]
                left = np.where(filled[..., None, None], rows[point], 0.0)  # (g, most, m, c)
                right = inner[point].reshape(*point.shape, m * BLOCKS, m) @ left
                right = right.reshape(len(point), -1, BLOCKS * c)
                product[some] = left.reshape(len(point), -1, c).swapaxes(1, 2) @ right
            blocks = product.reshape(-1, r, b, BLOCKS, r, b).transpose(0, 1, 4, 2, 5, 3)
            flat[targets] += total @ blocks.reshape(-1, b * b * BLOCKS)
        return data


def stiffness(
    points: FrictionPoints,
    weight: Floats,  # (a,), area that each touching point stands for in its pass [m2]
    own: Stencil,  # of the touching points on their own surfaces and of their closest points
    other: Stencil,  # likewise
    block: int,  # as of `CellPairs`
    count: int,  # as of `CellPairs`
    before: CellPairs | None,  # pattern of an earlier tangent, used again if the same cells touch
    reserve: Reserve,  # where the blocks are
    wanted: int = 2,  # 1: the tangent alone
) -> tuple[list[Floats], CellPairs]:
    """Return the tangent and its symmetric positive part as blocks (nnz, b b, 9), and the pattern of both.

    Points of one cell that face one cell share their carriers: the rows of all of them, one below the other, make one
    product V^T (B V) a pair of cells.
    """
    active = points.active
    inner, positive = _point_tangents(points, active)
    inner *= weight[:, None, None]
    positive *= weight[:, None, None]
    width = own.nodes.shape[1]
    rows = np.zeros((len(active), 3, 2 * width))  # V
    rows[:, 0, :width] = own.value
    rows[:, 0, width:] = -other.value
    rows[:, 1:, width:] = other.first
    keys = np.stack([own.key, other.key], axis=1)
    keys, first, pair = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    pair = pair.ravel()
    pairs = before if before is not None and np.array_equal(before.key, keys) else None
    if pairs is None:
        nodes = np.concatenate([own.nodes[first], other.nodes[first]], axis=1)
        pairs = CellPairs(keys, nodes, block, count)
    full = inner.reshape(-1, 9, 3, 3).swapaxes(2, 3).reshape(-1, 3, BLOCKS, 3)
    lines = (rows, rows[:, :1])
    inners = (full, positive.reshape(-1, 1, BLOCKS, 1))
    data = reserve.arrays(*wanted * [(len(pairs.indices), block**2, BLOCKS)])
    return share(lambda n: pairs.sum(lines[n], inners[n], pair, data[n]), wanted), pairs


def _point_tangents(points: FrictionPoints, active: Ints) -> tuple[Floats, Floats]:
    """Return B (a, 9, 9) of R's derivative V^T B V, and the symmetric stiffness (a, 3, 3), without weights."""
    projection, law = points.projection[active], points.law[active]
    kinematics = Kinematics.of(projection)
    pressure, status = points.pressure[active], points.status[active]
    normal = projection.normal
    change = np.reshape(law.normal, (-1, 1, 1)) * normal[:, :, None] * kinematics.gap[:, None, :]
    change -= pressure[:, None, None] * kinematics.normal
    if law.friction > 0:
        slip = points.slip_share[active, None, None] * kinematics.xi
        slip += points.slip_rate[active][:, :, None] * kinematics.gap[:, None, :]
        trial = np.einsum("kai,kaz->kiz", projection.tangent, slip)
        trial += np.einsum("ka,kaiz->kiz", points.slip[active], kinematics.tangent)
        change += law.tangent(
            points.trial[active],
            np.reshape(law.tangential, (-1, 1, 1)) * trial,
            kinematics.gap,
            pressure,
            status,
        )
    traction = points.traction[active] - pressure[:, None] * normal
    inner = np.empty((len(active), 9, 9))
    inner[:, :3] = change
    for a in range(2):
        inner[:, 3 + 3 * a : 6 + 3 * a] = -traction[:, :, None] * kinematics.xi[:, a, None, :]
    return inner, law.symmetric_stiffness(points.trial[active], normal, pressure, status)
