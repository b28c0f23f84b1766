"""Spans of solid yarns: elements in total Lagrangian form for any law, with the tangent from a few large products.

An element is one span of the splines of a yarn, its local nodes the coefficients of the d + 1 splines that do not
vanish there, spline by spline, k within. With parent coordinates xi = (x1, x2, s) and g_a = dx/dxi_a the tangent is

    K[ja, lb] = sum over points of  d_alpha(phi_a N_j) A[alpha, beta] d_beta(phi_b N_l),
    A[alpha, beta]_ik = g_gamma,i C^(alpha gamma beta delta) g_delta,k + S^(alpha beta) delta_ik.

Sums over the section come first, against tables that are the same for all spans: three matrices a point along the yarn,
for none, one and two derivatives along it. Sums along the yarn then weigh them with the splines. Spans whose splines
have the same degrees over the section are one batch (`span_groups`). Tensors at points have their components first and
the points (m, e, g), points of the section first, in the last axis: a component of all points is one run of memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import SCRATCH, determinant, inverse
from knitstudy.mechanics.materials import FULL, VOIGT, Material, axes_along
from knitstudy.mechanics.solids.elements import ElementGroup, Elements
from knitstudy.mechanics.solids.spline_yarn.space import Space

# Mean dilatation of spans, which keeps low degrees over the section from locking as Poisson's ratio nears 1/2.
#
# The energy lame/2 theta^2 of the dilatation theta = ln det F is that of its mean over a span: the projection, in the
# L2 norm of the undeformed span, onto functions M_r that are polynomials of degree p - 1 over the section and constant
# along the yarn,
#
#     theta_r = int M_r theta dV,   int M_r M_s dV = delta_rs,   W = lame/2 sum over r of theta_r^2,
#
# a B-bar and F-bar projection (Elguedj et al. 2008, doi:10.1016/j.cma.2008.01.012) span by span. Displacements of
# degree p over the section have every divergence of degree p - 1, so that no strain along the yarn is locked there;
# along it, means ask one thing of each span, and splines have one unknown to answer it. The rest of the law, with a
# first Lame constant of zero, resists every strain with twice the shear modulus: no mode becomes soft. The mean
# pressure lame sum of theta_r M_r acts pointwise; the products lame d theta_r d theta_r are the rest of the tangent.


@dataclass(frozen=True, eq=False)
class Dilatation:
    """The mean dilatation of a few spans in one configuration."""

    deformation: Floats  # (3, 3, points), F
    volume_ratio: Floats  # (points,), det F
    slope: Floats  # (3, 3, points), d theta / d F
    pressure: Floats  # (points,), of the means [Pa]
    energy: Floats  # (e,), stored [J]


class MeanDilatation:
    """The energy lame/2 theta^2 of the mean dilatation of all spans of a batch; tensors have their components first."""

    def __init__(
        self,
        lame: float,  # [Pa]
        logarithmic: bool,  # whether theta is ln det F; else the trace of Green's strain
        functions: Floats,  # (m, r), at the points of a section
        weight: Floats,  # (m, E, g), volumes of the points [m3]
    ) -> None:
        self.lame, self._logarithmic = lame, logarithmic
        self._functions, self._weight = functions, weight
        gram = functions.T @ (weight.sum(axis=2).T[..., None] * functions)
        self.orthonormal = np.linalg.inv(np.linalg.cholesky(gram))  # (E, r, r), from given functions to M_r

    def at(self, spans: slice, gradient: Floats) -> Dilatation:
        """Return the mean dilatation of a few spans with displacement gradients (3, 3, points)."""
        deformation = gradient + np.eye(3)[..., None]
        trace = np.einsum("iip->p", gradient)
        if self._logarithmic:
            # det F - 1 of all its digits
            minors = 0.5 * (trace**2 - np.einsum("ijp,jip->p", gradient, gradient))
            change = trace + minors + determinant(gradient.transpose(2, 0, 1))
            theta = np.log1p(np.where(change > -1, change, np.nan))
            back, ratio = inverse(deformation.transpose(2, 0, 1))
            slope = back.transpose(2, 1, 0)
        else:
            theta = trace + 0.5 * np.einsum("ijp,ijp->p", gradient, gradient)
            slope = deformation
            ratio = determinant(deformation.transpose(2, 0, 1))
        mean = self._means(spans, theta)
        energy = 0.5 * self.lame * (mean**2).sum(axis=1)
        return Dilatation(deformation, ratio, slope, self._pressure(spans, mean), energy)

    def added_stress(self, spans: slice, slope: Floats, strain: Floats) -> Floats:
        """Return the stress (3, 3, points) that strains (3, 3, points) add."""
        metric = np.broadcast_to(np.eye(3)[..., None], strain.shape)  # d theta / d E
        if self._logarithmic:
            metric = np.einsum("kip,kjp->ijp", slope, slope)
        mean = self._means(spans, np.einsum("ijp,ijp->p", metric, strain))
        return self._pressure(spans, mean) * metric

    def _means(self, spans: slice, theta: Floats) -> Floats:
        """Return theta_r (e, r)."""
        m, e, g = self._weight[:, spans].shape
        sums = self._functions.T @ (self._weight[:, spans].reshape(m, -1) * theta.reshape(m, -1))
        return (self.orthonormal[spans] @ sums.reshape(-1, e, g).sum(axis=2).T[..., None])[..., 0]

    def _pressure(self, spans: slice, mean: Floats) -> Floats:
        of_given = (mean[:, None] @ self.orthonormal[spans])[:, 0]
        of_spans = self.lame * (self._functions @ of_given.T)  # (m, e)
        return np.repeat(of_spans, self._weight.shape[2], axis=1).reshape(-1)


CACHE = 12_000  # points whose moduli fit into a processor's cache together
CLOSE = 16_384  # numbers that fit into the nearest part of it, together with their products


class Spans(Elements):
    """Spans of yarns whose splines have the same degrees over the section.

    With the `step` that they came by straight from where a tangent was formed, the stress in the tangent is the one
    that the tangent foresaw, without stretches of second order: as in Newton's method with stresses as unknowns of
    their own (Magisano et al. 2017). A straight step stretches a yarn that turns by half the square of the angle. In
    slender yarns that would be most of the stress, in the very step that takes it away.

    Raises MeshError if a span is folded at a quadrature point, as where a yarn is bent tighter than its radius.
    """

    def __init__(
        self,
        corners: Floats,  # (E, a, 3), undeformed nodes [m]
        # (2, E, g, d + 1), splines and their derivatives [1/m] at the Gauss points along the spans
        along: Floats,
        weight: Floats,  # (E, g), weights of these points [m]
        degrees: Ints,  # (d + 1,), p of the splines
        material: Material,
    ) -> None:
        self.material = material
        self._along = along
        degree = int(degrees.max())
        self._full = disc.size(degree)
        points, section = disc.quadrature(degree)
        value, gradient = disc.gradients(degree, points)
        self._table = np.stack([gradient[..., 0], gradient[..., 1], value])  # (alpha, m, k)
        self._pairs, self._entries = _pair_tables(self._table)
        nodes = len(degrees) * self._full
        order = np.arange((3 * nodes) ** 2).reshape(3, nodes, 3, nodes)
        self._order = order.transpose(1, 3, 0, 2).reshape(-1)  # pairs of nodes, then of components
        fewer = [j * self._full + np.arange(disc.size(p)) for j, p in enumerate(degrees)]
        kept = np.concatenate(fewer)
        self._kept = None if len(kept) == len(degrees) * self._full else kept
        count = len(corners)
        few = self.few = max(1, CACHE // self.points)
        shape = len(points), count, weight.shape[1]
        self._inverse, size = np.empty((3, 3, *shape)), np.empty(shape)  # d xi / d x and the Jacobian
        for first in range(0, count, few):
            spans = slice(first, min(first + few, count))
            covariant = self._parent_gradient(corners[spans], spans)
            back, jacobian = inverse(covariant.transpose(2, 0, 1))
            part = self._inverse[:, :, :, spans]
            part[:] = back.transpose(1, 2, 0).reshape(part.shape)
            size[:, spans] = jacobian.reshape(part.shape[2:])
        if not np.all(size > 0):
            raise MeshError(
                f"span {int(np.argmin(size.min(axis=(0, 2))))} of {count} of the yarns is folded: its Jacobian is "
                f"{size.min():.3g} and has to be positive; the yarn is bent tighter than its radius, or spans are "
                "too long for its bends: use a thinner yarn or shorter spans"
            )
        self._weight = section[:, None, None] * weight * size  # (m, E, g)
        self.volume = self._weight.sum(axis=(0, 2))
        self._rest, lame = material.without_dilatation()
        means = disc.values(max(int(degrees.min()) - 1, 0), points)  # (m, r)
        self._mean_table = (self._table[:, :, None] * means[..., None]).reshape(3, len(means), -1)
        self._dilatation = MeanDilatation(lame, material.logarithmic, means, self._weight)

    @property
    def points(self) -> int:
        """Number of quadrature points a span."""
        return self._along.shape[2] * self._table.shape[1]

    def node_volume(self) -> Floats:
        """Return the integrals (E, a) of N_j phi_k^2 [m3]; the integrals with k = 0 add up to the volume."""
        across = self._weight.transpose(1, 2, 0) @ self._table[2] ** 2  # (E, g, k)
        volume = (np.swapaxes(self._along[0], 1, 2) @ across).reshape(len(across), -1)
        return volume if self._kept is None else volume[:, self._kept]

    def _respond(
        self, spans: slice, displacement: Floats, out: Floats | None, step: Floats | None
    ) -> tuple[Floats, Floats]:
        to_parent = self._inverse[:, :, :, spans].reshape(3, 3, -1)
        weight = self._weight[:, spans]
        gradient = _product(self._parent_gradient(displacement, spans), to_parent)
        transposed = gradient.swapaxes(0, 1)
        strain = 0.5 * (gradient + transposed + _product(transposed, gradient))
        axes = None
        if self.material.directional:
            axes = axes_along(inverse(to_parent.transpose(2, 0, 1))[0][:, :, 2])
        dilatation = self._dilatation.at(spans, gradient)
        answer = self._rest.respond(strain.transpose(2, 0, 1), out is not None, axes, dilatation.pressure)
        stress = answer.stress.transpose(1, 2, 0)
        weighted = (weight.reshape(-1) * to_parent).swapaxes(0, 1)  # (J, beta)
        flux = _product(dilatation.deformation, _product(stress, weighted))
        # A span turned inside out has no energy in terms of E: the load path has to reject it.
        flux[..., dilatation.volume_ratio <= 0] = np.nan
        if out is not None:
            moduli = answer.moduli.transpose(1, 2, 0)
            if step is not None:
                change = _product(self._parent_gradient(step, spans), to_parent)
                strain = 0.5 * _product(change.swapaxes(0, 1), change)
                stress = stress - _stress(moduli, strain)
                stress -= self._dilatation.added_stress(spans, dilatation.slope, strain)
            initial = _product(to_parent, _product(stress, weighted))  # S in parent coordinates
            tensor = _material_part(dilatation.deformation, np.sqrt(weight.reshape(-1)) * to_parent, moduli)
            changes = self._dilatations(spans, _product(dilatation.slope, weighted))
            self._sum_stiffness(spans, tensor, initial, changes, out)
        energy = (weight * answer.energy.reshape(weight.shape)).sum(axis=(0, 2)) + dilatation.energy
        return self._sum_force(spans, flux), energy

    def _parent_gradient(self, nodes: Floats, spans: slice) -> Floats:
        """Return the derivatives (i, alpha, points) by parent coordinates of a sum over nodes (e, a, 3)."""
        along = self._along[:, spans]
        _, e, g, d = along.shape
        if self._kept is not None:
            every = np.zeros((e, d * self._full, 3))
            every[:, self._kept] = nodes
            nodes = every
        rows = np.swapaxes(along, 0, 1).reshape(e, 2 * g, d)
        sums = (rows @ nodes.reshape(e, d, -1)).reshape(e, 2, g, self._full, 3)
        value, slope = np.ascontiguousarray(sums.transpose(1, 4, 3, 0, 2)).reshape(2, 3, self._full, e * g)
        m = self._table.shape[1]
        gradient = np.empty((3, 3, m, e * g))
        np.matmul(self._table[:2].reshape(2 * m, -1), value, out=gradient[:, :2].reshape(3, 2 * m, -1))
        np.matmul(self._table[2], slope, out=gradient[:, 2])
        return gradient.reshape(3, 3, -1)

    def _sum_force(self, spans: slice, flux: Floats) -> Floats:
        """Return forces (e, a, 3) of weighted stresses (i, alpha, points)."""
        force = self._sums(spans, flux, self._table).swapaxes(2, 3)
        force = force.reshape(len(force), -1, 3)
        return force if self._kept is None else force[:, self._kept]

    def _sums(self, spans: slice, flux: Floats, table: Floats) -> Floats:
        """Return sums (e, d + 1, 3, n) of fluxes (i, alpha, points) with a table (alpha, m, n) over the section."""
        along = self._along[:, spans]
        _, e, g, d = along.shape
        _, m, n = table.shape
        flux = flux.reshape(3, 3, m, e * g)
        sums = np.empty((e * g, 2, 3, n))
        across = flux[:, :2].reshape(3, 2 * m, -1).swapaxes(1, 2)
        np.matmul(across, table[:2].reshape(2 * m, n), out=sums[:, 0].swapaxes(0, 1))
        np.matmul(flux[:, 2].swapaxes(1, 2), table[2], out=sums[:, 1].swapaxes(0, 1))
        columns = along.transpose(1, 3, 2, 0).reshape(e, d, 2 * g)
        return (columns @ sums.reshape(e, 2 * g, -1)).reshape(e, d, 3, n)

    def _dilatations(self, spans: slice, flux: Floats) -> Floats:
        """Return the derivatives of theta_r by the displacements (e, r, i (d + 1) n) of a few spans."""
        sums = self._sums(spans, flux, self._mean_table)
        e, d, _, _ = sums.shape
        sums = sums.reshape(e, d, 3, -1, self._full).transpose(0, 3, 2, 1, 4)  # (e, r, i, d, n)
        return self._dilatation.orthonormal[spans] @ sums.reshape(e, sums.shape[1], -1)

    def _sum_stiffness(
        self, spans: slice, tensor: Floats, stress: Floats, changes: Floats, out: Floats
    ) -> None:
        """Put the stiffness of a few spans into `out` (e, a a, 9).

        From A (points, alpha i, beta k) without stress, the stress (alpha, beta, points) and the result of
        `_dilatations`.
        """
        along = self._along[:, spans]
        _, e, g, d = along.shape
        n = self._full
        count = len(tensor)
        sums = SCRATCH.array("section sums", e * g, int(self._entries.max()) + 1)
        first = 0
        for (alpha, beta), table in self._pairs:
            moduli = tensor.reshape(count, 3, 3, 3, 3)[:, alpha, :, beta].transpose(2, 4, 1, 3, 0)
            part = SCRATCH.array("moduli of a pair", *moduli.shape)
            np.copyto(part, moduli)
            part.reshape(9, *part.shape[2:])[::4] += stress[alpha, beta]
            size = table.shape[1]
            summed = sums[:, first : first + 9 * size].reshape(e * g, 9, size).swapaxes(0, 1)
            np.matmul(part.reshape(9, -1, e * g).swapaxes(1, 2), table, out=summed)
            first += 9 * size
        # Products of the splines and derivatives that go with them.
        splines = along.transpose(1, 2, 0, 3)
        weights = splines[:, :, :, None, :, None] * splines[:, :, None, :, None]
        weights = weights.reshape(e, 4 * g, d * d).swapaxes(1, 2)
        full = out if self._kept is None else SCRATCH.array("stiffness of all", e, (d * n) ** 2, 9)
        sums = sums.reshape(e, g, -1)
        few = max(1, CLOSE // self._entries.size)
        for some in (slice(low, low + few) for low in range(0, e, few)):
            here = full[some]
            rows = changes[some]
            flat = here.reshape(len(here), -1)
            products = SCRATCH.array("products of dilatations", len(here), 3 * d * n, 3 * d * n)
            np.matmul(self._dilatation.lame * rows.swapaxes(1, 2), rows, out=products)
            np.take(products.reshape(flat.shape), self._order, axis=1, out=flat, mode="clip")
            every = SCRATCH.array("all section sums", len(here) * g, self._entries.size)
            np.take(sums[some].reshape(len(every), -1), self._entries, axis=1, out=every, mode="clip")
            blocks = SCRATCH.array("blocks of splines", len(here), d * d, n * n * 9)
            np.matmul(weights[some], every.reshape(len(here), 4 * g, -1), out=blocks)
            target = here.reshape(-1, d, n, d, n, 9)
            target += blocks.reshape(-1, d, d, n, n, 9).transpose(0, 1, 3, 2, 4, 5)
        if self._kept is not None:
            kept = self._kept
            full = full.reshape(e, d * n, d * n, 9)
            out.reshape(e, len(kept), len(kept), 9)[:] = full[:, kept[:, None], kept]


def _product(one: Floats, other: Floats) -> Floats:
    """Return the products (i, k, points) of tensors (i, j, points) and (j, k, points)."""
    return np.einsum("ijp,jkp->ikp", one, other)


def _stress(moduli: Floats, strain: Floats) -> Floats:
    """Return the stress (3, 3, points) by moduli (6, 6, points) of strains (3, 3, points)."""
    i, j = VOIGT.T
    return np.einsum("pqk,qk->pk", moduli, np.where(i == j, 1.0, 2.0)[:, None] * strain[i, j])[FULL]


def _material_part(deformation: Floats, to_parent: Floats, moduli: Floats) -> Floats:
    """Return B^T C B (points, alpha i, beta k): B is the derivative of engineering strains by d u_i / d xi_alpha."""
    count = moduli.shape[-1]
    rows = SCRATCH.array("strain rows", 6, 3, 3, count)
    for row, (i, j) in zip(rows, VOIGT, strict=True):
        np.multiply(to_parent[:, None, i], deformation[:, j], out=row)
        if i != j:
            row += to_parent[:, None, j] * deformation[:, i]
    # Small matrices are multiplied one after the other where each of them is one run of memory.
    strain, law = SCRATCH.array("B", count, 6, 9), SCRATCH.array("C", count, 6, 6)
    np.copyto(strain.reshape(count, 54), rows.reshape(54, count).T)
    np.copyto(law.reshape(count, 36), moduli.reshape(36, count).T)
    half = np.matmul(law, strain, out=SCRATCH.array("C B", count, 6, 9))
    return np.matmul(strain.swapaxes(1, 2), half, out=SCRATCH.array("B C B", count, 9, 9))


def _pair_tables(table: Floats) -> tuple[list[tuple[tuple[slice, slice], np.ndarray]], Ints]:
    """Return pairs (alpha, beta) with products (r m, .) of functions (alpha, m, n), and where sums with them stand.

    Of no derivative along the yarn, of one in the column, and of two. The first and the last are as large as the
    transposed, and only pairs of functions a <= b are summed. The sums follow each other, of each kind in the order
    (i, k), pair of functions. The places (4 n n 9,) belong to (order of the derivative of the row, of the column, a, b,
    i, k).
    """
    n = table.shape[2]
    across, along = slice(0, 2), slice(2, 3)
    half = np.triu_indices(n)
    every = tuple(np.indices((n, n)).reshape(2, -1))
    tables = []
    first = 0
    places = np.empty((2, 2, n, n, 3, 3), dtype=np.intp)
    for rows, columns, (a, b) in ((across, across, half), (across, along, every), (along, along, half)):
        product = table[rows][:, None, :, a] * table[columns][None, :, :, b]
        tables.append(((rows, columns), np.ascontiguousarray(product.reshape(-1, len(a)))))
        here = first + np.arange(9 * len(a)).reshape(3, 3, -1)
        row, column = rows.start // 2, columns.start // 2
        places[column, row, b, a] = here.transpose(2, 1, 0)
        places[row, column, a, b] = here.transpose(2, 0, 1)
        first += 9 * len(a)
    return tables, places.reshape(-1)


def span_groups(
    space: Space,
    nodes: Floats,  # (N, 3), undeformed coefficients [m]
    material: Material,
) -> tuple[ElementGroup, ...]:
    """Return all spans of yarns without their images, in groups of equal local size, by rising size.

    Raises MeshError as `Spans` does.
    """
    rows: dict[tuple[int, ...], list[tuple[np.ndarray, ...]]] = {}
    for number, yarn in enumerate(space.yarns):
        spline = yarn.spline
        d = spline.degree
        point, gauss = np.polynomial.legendre.leggauss(d + 1)
        low, high = spline.spans[yarn.own].T[..., None]
        s = 0.5 * (low + high) + 0.5 * (high - low) * point
        span = yarn.beyond + np.repeat(np.arange(len(s)), d + 1)
        _, along = spline.basis(s.ravel(), 1, span)
        along = along.reshape(2, len(s), d + 1, d + 1)
        weight = 0.5 * (high - low) * gauss
        splines = spline.first[yarn.own, None] + np.arange(d + 1)
        kinds, kind = np.unique(yarn.degrees[splines], axis=0, return_inverse=True)
        for i, degrees in enumerate(kinds):
            here = np.flatnonzero(kind.ravel() == i)
            first = space.first_node[number] + yarn.first_node[splines[here, 0]]
            local = first[:, None] + np.arange(disc.size(degrees).sum())
            rows.setdefault(tuple(degrees.tolist()), []).append((local, along[:, here], weight[here]))
    groups = []
    for degrees, parts in sorted(rows.items(), key=lambda item: (sum(item[0]), item[0])):
        connectivity = np.concatenate([local for local, _, _ in parts])
        along = np.concatenate([s for _, s, _ in parts], axis=1)
        weight = np.concatenate([w for _, _, w in parts])
        elements = Spans(nodes[connectivity], along, weight, np.array(degrees), material)
        groups.append(ElementGroup(connectivity.astype(np.int32), elements))
    return tuple(groups)
