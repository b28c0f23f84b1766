"""Spans of solid yarns: elements in total Lagrangian form for any law, with the tangent from a few large products.

An element is one span of the splines of a yarn, its local nodes the coefficients of the d + 1 splines that do not
vanish there, spline by spline, k within. With parent coordinates xi = (x1, x2, s) and g_a = dx/dxi_a the tangent is

    K[ja, lb] = sum over points of  d_alpha(phi_a N_j) A[alpha, beta] d_beta(phi_b N_l),
    A[alpha, beta]_ik = g_gamma,i C^(alpha gamma beta delta) g_delta,k + S^(alpha beta) delta_ik.

Sums over the section come first, against tables that are the same for all spans: three matrices a point along the yarn,
for none, one and two derivatives along it. Sums along the yarn then weigh those with the splines. Spans whose splines
have the same degrees over the section are one batch (`span_groups`).
"""

from __future__ import annotations

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.batches import SCRATCH, determinant, inverse
from knitstudy.mechanics.elements import ElementGroup, ElementResponse, in_parts
from knitstudy.mechanics.elements.hexahedron import tangent_moduli
from knitstudy.mechanics.materials import FULL, VOIGT, Material, axes_along, rotate_strain
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mechanics.spline_yarn.dilatation import Dilatation, MeanDilatation
from knitstudy.mechanics.spline_yarn.space import Space

CACHE = 1500  # points whose moduli fit into a processor's cache together


class Spans:
    """Spans of yarns whose splines have the same degrees over the section.

    Raises MeshError if a span is folded at a quadrature point, as where a yarn is bent tighter than its radius.
    """

    def __init__(
        self,
        corners: np.ndarray,  # (E, a, 3), undeformed nodes [m]
        # (2, E, g, d + 1), splines and their derivatives [1/m] at the Gauss points along the spans
        along: np.ndarray,
        weight: np.ndarray,  # (E, g), weights of these points [m]
        degrees: np.ndarray,  # int (d + 1,), p of the splines
        material: Material,
    ) -> None:
        self.material = material
        self._along = along
        degree = int(degrees.max())
        self._full = disc.size(degree)
        points, section = disc.quadrature(degree)
        value, gradient = disc.gradients(degree, points)
        self._table = np.stack([gradient[..., 0], gradient[..., 1], value], axis=1)  # (m, alpha, k)
        self._pairs = _pair_tables(self._table)
        fewer = [j * self._full + np.arange(disc.size(p)) for j, p in enumerate(degrees)]
        kept = np.concatenate(fewer)
        self._kept = None if len(kept) == len(degrees) * self._full else kept
        count, few = len(corners), max(1, CACHE // self.points)
        self._inverse, size = np.empty((count * self.points, 3, 3)), np.empty(count * self.points)
        for first in range(0, count, few):
            spans = slice(first, min(first + few, count))
            at = slice(spans.start * self.points, spans.stop * self.points)
            self._inverse[at], size[at] = inverse(self._parent_gradient(corners[spans], spans))
        if not np.all(size > 0):
            raise MeshError(
                f"span {int(np.argmin(size)) // self.points} of {count} of the yarns is folded: its Jacobian is "
                f"{size.min():.3g} and has to be positive; the yarn is bent tighter than its radius, or spans are "
                "too long for its bends: use a thinner yarn or shorter spans"
            )
        self._weight = (weight[..., None] * section).reshape(-1) * size
        self.volume = self._weight.reshape(count, -1).sum(axis=1)
        self._rest, lame = material.without_dilatation()
        means = disc.values(max(int(degrees.min()) - 1, 0), points)  # (m, r)
        self._mean_table = (means[:, None, :, None] * self._table[:, :, None]).reshape(len(means), 3, -1)
        over_span = np.tile(means, (weight.shape[1], 1))
        self._dilatation = MeanDilatation(
            lame, material.logarithmic, over_span, self._weight.reshape(count, -1)
        )

    @property
    def points(self) -> int:
        """Number of quadrature points a span."""
        return self._along.shape[2] * len(self._table)

    def node_volume(self) -> np.ndarray:
        """Return the integrals (E, a) of N_j phi_k^2, of which those with k = 0 add up to the volume [m3]."""
        value = self._along[0]  # (E, g, d + 1)
        weight = self._weight.reshape(*value.shape[:2], -1)
        across = weight @ self._table[:, 2] ** 2  # (E, g, k)
        found = (np.swapaxes(value, 1, 2) @ across).reshape(len(value), -1)
        return found if self._kept is None else found[:, self._kept]

    def respond(
        self,
        batch: slice,
        displacement: np.ndarray,
        stiffness: bool,
        out: np.ndarray | None = None,
        step: np.ndarray | None = None,
    ) -> ElementResponse:
        """Return the response of the spans `batch` to the displacements (e, a, 3) of their nodes [m].

        With the `step` (e, a, 3) that they came by straight from where a tangent was formed, the stress in the tangent
        is what that tangent foresaw, without stretches of second order: as in Newton's method with stresses as unknowns
        of their own (Magisano et al. 2017). A straight step stretches what turns, by half the square of the angle. In
        slender yarns that would be most of the stress, in the very step that takes it away.
        """
        few = max(1, CACHE // self.points)
        return in_parts(self._respond, few, batch, displacement, stiffness, out, step)

    def _respond(
        self, spans: slice, displacement: np.ndarray, out: np.ndarray | None, step: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return force (e, a, 3) and energy (e,) of a few spans; put their stiffness into `out`."""
        at = slice(spans.start * self.points, spans.stop * self.points)
        to_parent, weight = self._inverse[at], self._weight[at]
        covariant = inverse(to_parent)[0]
        h = self._parent_gradient(displacement, spans)  # columns d u / d xi_alpha
        gradient = h @ to_parent
        transposed = np.swapaxes(gradient, 1, 2)
        strain = 0.5 * (gradient + transposed + transposed @ gradient)
        axes = axes_along(covariant[:, :, 2]) if self.material.directional else None
        answer = self._rest.respond(strain, out is not None, axes)
        current = covariant + h
        dilatation = self._dilatation.at(spans, weight, to_parent, gradient, current)
        stress = (weight[:, None, None] * to_parent) @ answer.stress @ np.swapaxes(to_parent, 1, 2)
        stress += dilatation.stress()
        # A span turned inside out has no energy in terms of E: let the load path see it.
        flux = current @ stress
        flux[determinant(gradient + np.eye(3)) <= 0] = np.nan
        if out is not None:
            turn = rotate_strain(to_parent)  # engineering strains in parent coordinates to Cartesian ones
            moduli = np.swapaxes(turn, 1, 2) @ (weight[:, None, None] * answer.tangent) @ turn
            moduli += dilatation.moduli()
            if step is not None:
                stress = stress - self._second_order(spans, step, moduli, dilatation)
            tensor = SCRATCH.array("parent moduli", len(weight), 9, 9)
            tangent_moduli(current, stress, moduli, tensor)
            self._sum_stiffness(spans, tensor, out)
            self._add_products(spans, dilatation, out)
        energy = (weight * answer.energy).reshape(len(displacement), -1).sum(axis=1) + dilatation.energy
        return self._sum_force(spans, flux), energy

    def _second_order(
        self, spans: slice, step: np.ndarray, moduli: np.ndarray, dilatation: Dilatation
    ) -> np.ndarray:
        """Return the stress (points, 3, 3) of the strain that is quadratic in a step, all in parent coordinates."""
        h = self._parent_gradient(step, spans)
        strain = 0.5 * np.swapaxes(h, 1, 2) @ h
        i, j = VOIGT.T
        engineering = np.where(i == j, 1.0, 2.0) * strain[:, i, j]
        return (moduli @ engineering[..., None])[:, FULL, 0] + dilatation.foreseen(strain)

    def _parent_gradient(self, nodes: np.ndarray, spans: slice) -> np.ndarray:
        """Return the derivatives (points, 3, 3) of a sum over nodes (e, a, 3), columns by parent coordinate."""
        along = self._along[:, spans]
        _, e, g, d = along.shape
        if self._kept is not None:
            every = np.zeros((e, d * self._full, 3))
            every[:, self._kept] = nodes
            nodes = every
        rows = np.swapaxes(along, 0, 1).reshape(e, 2 * g, d)
        sums = (rows @ nodes.reshape(e, d, -1)).reshape(e, 2, g, self._full, 3)
        m = len(self._table)
        across = self._table[:, :2].reshape(2 * m, self._full) @ sums[:, 0]  # (e, g, m alpha, 3)
        found = np.empty((e, g, m, 3, 3))
        found[..., :2] = np.swapaxes(across.reshape(e, g, m, 2, 3), 3, 4)
        found[..., 2] = self._table[:, 2] @ sums[:, 1]
        return found.reshape(-1, 3, 3)

    def _sum_force(self, spans: slice, flux: np.ndarray) -> np.ndarray:
        """Return forces (e, a, 3) of weighted stresses (points, i, alpha)."""
        force = self._sums(spans, flux, self._table).reshape(-1, self._along.shape[3] * self._full, 3)
        return force if self._kept is None else force[:, self._kept]

    def _sums(self, spans: slice, flux: np.ndarray, table: np.ndarray) -> np.ndarray:
        """Return sums (e, d + 1, n, 3) of fluxes (points, i, alpha) with a table (m, alpha, n) over the section."""
        along = self._along[:, spans]
        _, e, g, d = along.shape
        m, _, n = table.shape
        flux = np.swapaxes(flux, 1, 2).reshape(e, g, m, 3, 3)  # alpha, i
        sums = np.empty((e, 2, g, n, 3))
        across = table[:, :2].reshape(2 * m, -1).T
        sums[:, 0] = across @ flux[..., :2, :].reshape(e, g, 2 * m, 3)
        sums[:, 1] = table[:, 2].T @ flux[..., 2, :]
        columns = along.transpose(1, 3, 0, 2).reshape(e, d, 2 * g)
        return (columns @ sums.reshape(e, 2 * g, -1)).reshape(e, d, n, 3)

    def _add_products(self, spans: slice, dilatation: Dilatation, out: np.ndarray) -> None:
        """Add the products lame d theta_r d theta_r to the stiffness `out` (e, a a, 9) of a few spans."""
        rows = self._sums(spans, dilatation.flux, self._mean_table)
        e, d, _, _ = rows.shape
        rows = rows.reshape(e, d, -1, self._full, 3).swapaxes(1, 2).reshape(e, -1, d * self._full, 3)
        if self._kept is not None:
            rows = rows[:, :, self._kept]
        _, r, a, _ = rows.shape
        rows = dilatation.orthonormal @ rows.reshape(e, r, 3 * a)
        products = (dilatation.lame * np.swapaxes(rows, 1, 2)) @ rows
        out.reshape(e, a, a, 3, 3)[:] += products.reshape(e, a, 3, a, 3).swapaxes(2, 3)

    def _sum_stiffness(self, spans: slice, tensor: np.ndarray, out: np.ndarray) -> None:
        """Put the stiffness of a few spans into `out` (e, a a, 9), from A (points, alpha beta, i k)."""
        along = self._along[:, spans]
        _, e, g, d = along.shape
        m, n = len(self._table), self._full
        points = tensor.reshape(e * g, m, 9, 9)
        sums = SCRATCH.array("section sums", 4, n * n, e * g, 9)
        for kind, (table, parts) in enumerate(self._pairs):
            gathered = SCRATCH.array("gathered moduli", m, len(parts), e * g, 9)
            for place, part in enumerate(parts):
                np.copyto(gathered[:, place], np.swapaxes(points[:, :, part], 0, 1))
            np.matmul(table, gathered.reshape(m * len(parts), -1), out=sums[kind].reshape(n * n, -1))
        # The transposed of what has its derivative in the column.
        mixed = sums[1].reshape(n, n, e * g, 3, 3)
        np.copyto(sums[3].reshape(n, n, e * g, 3, 3), mixed.transpose(1, 0, 2, 4, 3))
        orders = ((0, 0), (0, 1), (1, 1), (1, 0))  # of the derivatives of row and column
        weights = np.stack([along[i][..., None] * along[j][..., None, :] for i, j in orders], axis=1)
        weights = weights.reshape(e, 4 * g, d * d).swapaxes(1, 2)
        by_span = SCRATCH.array("section sums by span", e, 4, g, n * n, 9)
        np.copyto(by_span, sums.reshape(4, n * n, e, g, 9).transpose(2, 0, 3, 1, 4))
        blocks = SCRATCH.array("blocks of splines", e, d * d, n * n * 9)
        np.matmul(weights, by_span.reshape(e, 4 * g, -1), out=blocks)
        blocks = blocks.reshape(e, d, d, n, n, 9).transpose(0, 1, 3, 2, 4, 5)
        if self._kept is None:
            np.copyto(out.reshape(e, d, n, d, n, 9), blocks)
        else:
            full = blocks.reshape(e, d * n, d * n, 9)
            kept = self._kept
            out.reshape(e, len(kept), len(kept), 9)[:] = full[:, kept[:, None], kept]


def _pair_tables(table: np.ndarray) -> tuple[tuple[np.ndarray, tuple[int, ...]], ...]:
    """Return products (n n, m r) of functions over the section, and which r of the 9 pairs (alpha, beta) they meet.

    Of no derivative along the yarn, of one in the column, and of two.
    """
    found = []
    for rows, columns in (((0, 1), (0, 1)), ((0, 1), (2,)), ((2,), (2,))):
        pairs = [(alpha, beta) for alpha in rows for beta in columns]
        product = np.stack([table[:, a, :, None] * table[:, b, None, :] for a, b in pairs], axis=1)
        m, r, n, _ = product.shape
        flat = np.ascontiguousarray(product.reshape(m * r, n * n).T)
        found.append((flat, tuple(3 * a + b for a, b in pairs)))
    return tuple(found)


def span_groups(
    space: Space,
    nodes: np.ndarray,  # (N, 3), undeformed coefficients [m]
    material: Material,
) -> tuple[ElementGroup, ...]:
    """Return all spans of yarns, in groups of equal local size, by rising size; raises MeshError as `Spans` does."""
    rows: dict[tuple[int, ...], list] = {}
    for number, yarn in enumerate(space.yarns):
        spline = yarn.spline
        d = spline.degree
        point, gauss = np.polynomial.legendre.leggauss(d + 1)
        low, high = spline.spans.T[..., None]
        s = 0.5 * (low + high) + 0.5 * (high - low) * point
        span = np.repeat(np.arange(len(s)), d + 1)
        _, along = spline.basis(s.ravel(), 1, span)
        along = along.reshape(2, len(s), d + 1, d + 1)
        weight = 0.5 * (high - low) * gauss
        splines = spline.first[:, None] + np.arange(d + 1)
        kinds, kind = np.unique(yarn.degrees[splines], axis=0, return_inverse=True)
        for i, degrees in enumerate(kinds):
            here = np.flatnonzero(kind.ravel() == i)
            first = space.first_node[number] + yarn.first_node[spline.first[here]]
            local = first[:, None] + np.arange(disc.size(degrees).sum())
            rows.setdefault(tuple(degrees.tolist()), []).append((local, along[:, here], weight[here]))
    groups = []
    for degrees, parts in sorted(rows.items(), key=lambda item: (sum(item[0]), item[0])):
        connectivity = np.concatenate([local for local, _, _ in parts])
        along = np.concatenate([each for _, each, _ in parts], axis=1)
        weight = np.concatenate([each for _, _, each in parts])
        elements = Spans(nodes[connectivity], along, weight, np.array(degrees), material)
        groups.append(ElementGroup(connectivity.astype(np.int32), elements, mixed=True))
    return tuple(groups)
