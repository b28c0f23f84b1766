"""An endless sheet of beams in contact that is bent to a cylinder: its images are rigid motions of one cell.

A sheet with the curvature kappa about the axis e, along one of its lattice vectors, is the same after two motions: a
translation along e, and a turn about the axis of the cylinder, on which the other lattice vector lies. With m across
the axis in the plane, z upwards, and the turn n = z x m, the image of a point x is, j periods round the cylinder and l
along it,

    x_jl = R_j x + u D_j + (l s + j s') e,   R_j = exp(j phi n),   D_j = j int_0^1 exp(j phi t n) m dt.

phi is the angle of a period, and u its arc in the plane z = 0: kappa = phi / u, and the axis is at z = -1 / kappa. For
phi = 0 images are those of a flat sheet. Where phi > 0 the front is longer.

Sections turn with their images. So forces T^T f, tangents T^T K T and the moment dU / dphi follow from beams and
contact of an explicit patch of images, which know nothing of the motions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.beams.beam import BeamState, LineHistory
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.line_contact import SOFT, LineContact
from knitstudy.mechanics.beams.pair_search import FAR, PairSearch, PointPairs
from knitstudy.mechanics.cells.beams import EndlessBeams, EndlessState
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.linear import factorise
from knitstudy.mechanics.core.model import Response, summed
from knitstudy.mechanics.core.rotation import exp, hat

ROOM = 1.3  # images that a cell has, over those that it needs flat: bent ones may fold together
# Points of Gauss's rule for D and its derivatives: exact to rounding up to |j phi| = 3
GAUSS = 12
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class BentPatch:
    """The n stations of a cell, and copies of them: beside it and above. Stations of a yarn follow each other."""

    owner: Ints  # (N,), station of the cell
    image: Ints  # (N, 2), how many periods away
    yarn: Ints  # (N,), another one for every copy above
    arc_length: Floats  # (N,) [m]
    place: Ints  # (2 A + 1, B + 1, n), where the copy of a station is that is a - A and b periods away

    @classmethod
    def around(
        cls,
        yarn: Ints,  # (n,), of the stations of a cell
        arc_length: Floats,  # (n,) [m]
        period: Floats,  # (Y,), lengths of the yarns [m]
        position: Floats,  # (n, 3) [m]
        vectors: Floats,  # (2, 3), of the lattice [m]
        reach: float,  # distance up to which points are to find each other [m]
    ) -> BentPatch:
        """Return the copies that come within reach, and more to both sides, through which yarns go on."""
        most = np.abs(np.linalg.inv(vectors[:, :2].T)) @ (np.ptp(position[:, :2], axis=0) + reach)
        side, above = int(ROOM * most[0]) + 2, int(ROOM * most[1]) + 1
        a, b, owner = (
            each.ravel()
            for each in np.meshgrid(
                np.arange(-side, side + 1), np.arange(above + 1), np.arange(len(yarn)), indexing="ij"
            )
        )
        order = np.lexsort((owner, a, yarn[owner], b))
        place = np.argsort(order).reshape(2 * side + 1, above + 1, len(yarn))
        a, b, owner = a[order], b[order], owner[order]
        own = yarn[owner]
        s = arc_length[owner] + a * period[own]
        return cls(owner, np.stack([a, b], axis=1), own + b * len(period), s, place)

    def find(self, owner: Ints, image: Ints) -> Ints:
        """Return the places (k,) of the copies of stations (k,) that lie a number of periods (k, 2) away."""
        return self.place[image[:, 0] + len(self.place) // 2, image[:, 1], owner]


class PatchSearch(PairSearch):
    """Search for pairs of a cell with itself and with copies above it: every pair of the sheet once."""

    def __init__(self, of: PairSearch, image: Ints) -> None:
        """Search among the points of a contact and their copies, which lie a number of periods (p, 2) away."""
        super().__init__(of.yarn, of.arc_length, of.beside, None, None)
        self.own = np.flatnonzero(~image.any(axis=1))
        self.others = np.flatnonzero((image[:, 1] > 0) | (image[:, 0] > 0))
        self.at_edge = (np.abs(image) == np.abs(image).max(axis=0)).any(axis=1)

    def _all(self, reach: float, position: Floats, vectors: Floats) -> PointPairs:
        tree = cKDTree(position[self.own])
        i, j = tree.query_pairs(reach, output_type="ndarray").T.astype(np.int64)
        near = tree.sparse_distance_matrix(cKDTree(position[self.others]), reach, output_type="coo_matrix")
        i = self.own[np.append(i, near.row)]
        j = np.append(self.own[j], self.others[near.col])
        apart = (
            np.abs(self.arc_length[j] - self.arc_length[i]) > np.broadcast_to(self.beside, len(position))[i]
        )
        chosen = np.flatnonzero((self.yarn[i] != self.yarn[j]) | apart)
        key = i * len(position) + j
        order = chosen[np.argsort(key[chosen])]
        i, j = i[order], j[order]
        if self.at_edge[j].any():
            raise ConvergenceError("yarns of the bent cell touch images beyond those that it has")
        none = np.zeros((len(i), 2), dtype=np.int64)
        return PointPairs(i, j, none, position[j] - position[i], key[order])


class BentBeams(EndlessBeams):
    """Beams of a cell whose images lie on a cylinder; unknowns are those of `EndlessBeams`, and the angle phi.

    Unknowns of the lattice: changes of the lengths s and u of both vectors, in the order of these, of s' and phi [rad].
    The force on phi is the moment times the length s of the cell along the axis.
    """

    def __init__(
        self,
        flat: EndlessBeams,
        state: EndlessState,  # of the flat sheet, in which bending begins
        contact: LineContact,  # of points of the patch, without period
        points: ContactPoints,
        patch: BentPatch,
        along: int,  # number of the lattice vector that is bent
    ) -> None:
        super().__init__(flat.inner, flat.owner, flat.image, Lattice(flat.vectors(state)), contact, points)
        contact.search = PatchSearch(contact.search, patch.image[points.station])
        self.patch, self.along = patch, along
        t, over = self.lattice.vectors[[along, 1 - along]]
        s = float(np.linalg.norm(over))
        shift = float(t @ over / np.linalg.norm(over))
        self.axis = over / s
        across = t - shift * self.axis
        u = float(np.linalg.norm(across))
        self.flat = np.insert([s, shift], along, u)  # s and u in the order of the vectors, s'
        self.across = across / u
        self.turn = np.cross(UP, self.across)
        self.size += 1
        self.scale = np.append(self.scale, u)
        self.drag = np.append(self.drag, 0.0)
        self._nodes = patch.find(flat.owner, flat.image)
        self._begins = EndlessState(state.beams, np.zeros(4), LineHistory.none(), np.zeros(self.size))
        if contact.mu:
            self._begins = replace(self._begins, contact=self._carried(state))
        self._stored = self.respond(self._begins, stiffness=False).energy

    def _carried(self, state: EndlessState) -> LineHistory:
        """Return the friction of a flat sheet, whose pairs are pairs of the patch."""
        past = state.contact
        each = len(self.contact.yarn) // len(self.patch.owner)
        both, image = np.divmod(past.key, FAR * FAR)
        periods = np.stack([image // FAR - FAR // 2, image % FAR], axis=1)
        i, j = (
            each * self.patch.find(k // each, away) + k % each
            for k, away in zip(np.divmod(both, each * self.nodes), (0 * periods, periods), strict=True)
        )
        key = i * len(self.contact.yarn) + j
        order = np.argsort(key)
        kept = key[order], past.traction[order], past.stored[order]
        return self.contact.restored_history(self.at_points(self._begins), NO_LATTICE, *kept)

    def name_of(self, unknown: int) -> str:
        """Return what an unknown is, in words."""
        return self.inner.name_of(unknown) if unknown < 6 * self.nodes else "the bent cell as a whole"

    @property
    def per_curvature(self) -> Floats:
        """Angle phi [m] and force on it over a moment per width [m], by lengths of the flat sheet."""
        return self.flat[[self.along, 1 - self.along]]

    def bending_stiffness(self, state: EndlessState, held: Ints) -> float:
        """Return the derivative of the moment per width by curvature [N m] with unknowns (k,) that are held."""
        K = sp.csc_matrix(self.respond(state, stiffness=True).tangent)
        free = np.setdiff1d(np.arange(self.size - 1), held)
        eased = factorise(K[free][:, free]).solve(K[free][:, [-1]].toarray())
        round_, along_axis = self.per_curvature
        return float((K[-1, -1] - K[[-1]][:, free] @ eased).item() * round_ / along_axis)

    def vectors(self, state: EndlessState) -> Floats:
        """Return no lattice vectors (2, 3): images are explicit."""
        return NO_LATTICE

    def at_points(self, state: EndlessState) -> BeamState:
        """Return position and rotation of the points of contact of the patch."""
        return self.points.at(self._copies(state), NO_LATTICE)

    def _all(self, state: EndlessState) -> BeamState:
        copies = self._copies(state)
        return replace(copies, position=copies.position[self._nodes], rotation=copies.rotation[self._nodes])

    def _motions(self, state: EndlessState) -> tuple[Ints, Floats, Floats]:
        """Return periods round the cylinder (N,) of stations of the patch, R (N, 3, 3), and D, D', D'' (N, 3, 3)."""
        j = self.patch.image[:, self.along]
        periods, which = np.unique(j, return_inverse=True)
        angle = periods * state.lattice[3]
        t, weight = np.polynomial.legendre.leggauss(GAUSS)
        t = 0.5 + 0.5 * t
        weight = 0.5 * weight
        way = exp((angle[:, None] * t)[..., None] * self.turn) @ self.across
        once = np.cross(self.turn, way)
        ways = np.stack([way, once, np.cross(self.turn, once)], axis=2)  # (J, G, 3, 3)
        power = (periods[:, None] * t)[..., None] ** np.arange(3)
        D = np.einsum("j,g,jgd,jgdi->jdi", periods, weight, power, ways)
        return j, exp(angle[:, None] * self.turn)[which], D[which]

    def _copies(self, state: EndlessState) -> BeamState:
        """Return the state of all stations of the patch."""
        j, R, D = self._motions(state)
        lengths = self.flat + state.lattice[:3]
        beams = state.beams
        owner = self.patch.owner
        along_axis = self.patch.image[:, 1 - self.along] * lengths[1 - self.along] + j * lengths[2]
        position = np.einsum("nij,nj->ni", R, beams.position[owner])
        position += lengths[self.along] * D[:, 0] + np.multiply.outer(along_axis, self.axis)
        return replace(beams, position=position, rotation=R @ beams.rotation[owner])

    def respond(self, state: EndlessState, stiffness: bool) -> Response:
        """Return forces, energies and, if asked, the tangent."""
        beams, contact, points, active = self._placed(state)
        inner = self.inner.respond(beams, stiffness)
        on_points, energy, tangent = contact.respond(
            points, NO_LATTICE, state.contact, stiffness, active, self._points_follow
        )
        force = self._points_follow.forces(on_points)  # on all stations of the patch, and on no lattice
        rows = (6 * self._nodes[:, None] + np.arange(6)).ravel()
        force[rows] += inner.force
        T, turned = self._follow(state, force[:-3] if stiffness else None)
        if stiffness:
            own = T[rows].T @ sp.csr_matrix(inner.stiffness) @ T[rows]
            tangent = sp.csr_matrix(own + T.T @ tangent @ T + turned + sp.diags(self.drag))
            tangent.sort_indices()
        return replace(
            inner,
            force=T.T @ force + self.drag * state.moved,
            energy=summed(
                inner.energy | energy | {"stabilisation": self._dragged(state)},
                {form: -stored for form, stored in self._stored.items()},
            ),
            stiffness=tangent,
            status=SOFT,
        )

    def _follow(
        self, state: EndlessState, force: Floats | None
    ) -> tuple[sp.csr_matrix, sp.csr_matrix | None]:
        """Return T (6 N + 3, size), how the patch follows the unknowns, and dT^T f under forces f (6 N,) on it."""
        j, R, D = self._motions(state)
        owner = self.patch.owner
        n = self.nodes
        u = (self.flat + state.lattice[:3])[self.along]
        N = len(owner)
        edge = np.arange(self.size)
        turned = j[:, None, None] * (hat(self.turn) @ R)  # dR / dphi
        rate = np.einsum("nij,nj->ni", turned, state.beams.position[owner])
        # Rows of a copy, of its place and its turn: by those of its owner, and by the edges and the angle
        rows = np.zeros((N, 2, 3, 7))
        column = np.empty((N, 2, 3, 7), dtype=np.int32)
        rows[..., :3], last = R[:, None], rows[..., 3:]
        last[:, 0, :, 1 - self.along] = np.multiply.outer(self.patch.image[:, 1 - self.along], self.axis)
        last[:, 0, :, self.along] = D[:, 0]
        last[:, 0, :, 2] = np.multiply.outer(j, self.axis)
        last[:, 0, :, 3] = rate + u * D[:, 1]
        last[:, 1, :, 3] = np.multiply.outer(j, self.turn)
        column[..., :3] = (6 * owner[:, None] + [0, 3])[..., None, None] + np.arange(3)
        column[..., 3:] = edge[-4:]
        ends = 7 * np.minimum(np.arange(6 * N + 4), 6 * N)
        T = sp.csr_matrix((rows.ravel(), column.ravel(), ends), (6 * N + 3, self.size))
        if force is None:
            return T, None
        f = force.reshape(N, 2, 3)
        by_angle = np.zeros(self.size)  # of all forces
        on_owner = np.zeros((n, 2, 3))
        np.add.at(on_owner, owner, np.einsum("nij,nai->naj", turned, f))
        by_angle[: 6 * n] = on_owner.ravel()
        by_angle[6 * n + self.along] = np.vdot(D[:, 1], f[:, 0])
        of_moment = by_angle.copy()  # by all unknowns: spins of images do not change the moment they take
        of_moment[: 6 * n].reshape(n, 2, 3)[:, 1] = 0.0
        twice = j[:, None] * np.cross(self.turn, rate) + u * D[:, 2]
        of_moment[-1] = np.vdot(twice, f[:, 0])
        at = np.full(self.size, self.size - 1)
        entries = np.append(by_angle[:-1], of_moment), (np.append(edge[:-1], at), np.append(at[:-1], edge))
        return T, sp.csr_matrix(entries, (self.size, self.size))
