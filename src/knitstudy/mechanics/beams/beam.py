"""Geometrically exact two-node beam with one integration point (Reissner 1981, Simo 1985), as Abaqus' B31.

With the end rotations R1, R2 measured from the reference, the chord e = x2 - x1 and the reference direction
t0 of an element of length L,

    Th = log(R2 R1^T),   Rm = exp(Th / 2) R1,   t = Rm t0
    Gamma = e / L - t,   K = Th / L,   (n, m) = C (Gamma, K)
    W = L/2 (Gamma . n + K . m)

Elements that would be bent otherwise if nothing held them have the curvature K_0 at which they are free of stress, in
the axes of their reference: K - Rm K_0 stands for K in the law and in W then.

All vectors stand in global axes. C (6, 6) is the law of the section in the reference, turned by Rm. A straight section
is the same in all directions across t and does not couple n and m; that of a curved rod does (`curved_rod.py`). The
strains vanish in the reference: a curved yarn is a polygon of such elements, and its curvature is free of stress. A
rigid rotation of the whole turns every vector alike, so the element is objective.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Chosen
from knitstudy.mechanics.core.rotation import Halfway, exp, hat, log

# Beyond this angle between the ends the logarithm may have taken the other way round.
LARGEST_ANGLE = 0.95 * np.pi
SLENDERNESS = 0.25  # slenderness compensation factor of Abaqus' B31


class SectionLaw(Protocol):
    """Stiffness of beam elements."""

    def stiffness(self, chord: Floats) -> Floats:
        """Return C (E, 6, 6) of elements with the reference chords (E, 3) [m].

        It takes (Gamma, K) to (n, m) where elements have not turned: [N], [N m], in global axes.
        """


@dataclass(frozen=True)
class BeamSection:
    """Stiffness of a section that is the same in all directions; floats, or one value an element (E,)."""

    EA: float | Floats  # axial stiffness [N]
    kGA: float | Floats  # shear stiffness [N]
    EI: float | Floats  # bending stiffness [N m2]
    GJ: float | Floats  # torsional stiffness [N m2]
    # slenderness compensation factor: an element of length L has the shear stiffness kGA / (1 + slenderness L^2
    # EA / (12 EI)). One integration point alone makes an element in S-shaped bending as stiff as its shear; this
    # bounds it. 0 leaves kGA as it is
    slenderness: float = 0.0

    @classmethod
    def circular(
        cls,
        diameter: float,  # of a yarn [m]
        youngs_modulus: float,  # [Pa]
        poisson_ratio: float,
        count: float | Floats | Ints = 1.0,  # (E,), yarns in the section
    ) -> BeamSection:
        """Return the section of `count` solid circular yarns side by side, with the constants of Abaqus' B31.

        The shear factor 0.89 and the slenderness compensation factor 0.25 are that element's defaults. Cowper
        (1966) gives 6 (1 + nu) / (7 + 6 nu) = 0.895 at nu = 0.42; the difference is without effect on
        slender yarns.

        Raises ConfigurationError if the diameter or the modulus is not positive.

        Examples
        --------
        >>> section = BeamSection.circular(diameter=1e-3, youngs_modulus=1e8, poisson_ratio=0.42)
        >>> float(round(section.EA, 3))  # [N]
        78.54
        """
        if not diameter > 0 or not youngs_modulus > 0:
            raise ConfigurationError(
                f"yarn.diameter ({diameter}) and yarn.youngs_modulus ({youngs_modulus}) must be positive"
            )
        area = np.pi / 4 * diameter**2 * np.asarray(count, dtype=float)
        second_moment = area * diameter**2 / 16
        shear_modulus = youngs_modulus / (2 * (1 + poisson_ratio))
        return cls(
            EA=youngs_modulus * area,
            kGA=0.89 * shear_modulus * area,
            EI=youngs_modulus * second_moment,
            GJ=2 * shear_modulus * second_moment,
            slenderness=SLENDERNESS,
        )

    def stiffness(self, chord: Floats) -> Floats:
        """Return the law C (E, 6, 6) of elements with the reference chords (E, 3) [m], see `SectionLaw`."""
        length = np.linalg.norm(chord, axis=1)
        t = chord / length[:, None]
        kGA = self.kGA / (1 + self.slenderness * length**2 * self.EA / (12 * self.EI))
        C = np.zeros((len(t), 6, 6))
        for part, along, across in ((slice(0, 3), self.EA, kGA), (slice(3, 6), self.GJ, self.EI)):
            along, across = (np.broadcast_to(value, len(t)) for value in (along, across))
            C[:, part, part] = across[:, None, None] * np.eye(3) + _outer((along - across)[:, None] * t, t)
        return C


@dataclass(frozen=True)
class BeamElements(Chosen):
    """Reference state and stiffness of E elements."""

    length: Floats  # (E,), reference length L [m]
    axis: Floats  # (E, 3), reference direction t0
    # (E, 6, 6) C, force [N] and moment [N m] over strain and curvature [1/m], in global axes as the reference
    # stands
    law: Floats
    natural: Floats | float = 0.0  # (E, 3), curvature K_0 at which they are free of stress [1/m]

    @classmethod
    def between(cls, chord: Floats, section: SectionLaw, natural: Floats | float = 0.0) -> BeamElements:
        """Return the elements with the reference chords (E, 3) [m] and the natural curvatures (E, 3) [1/m].

        Raises GeometryError if an element has no length.
        """
        length = np.linalg.norm(chord, axis=1)
        if not np.all(length > 0):
            worst = int(np.argmin(length))
            raise GeometryError(f"beam element {worst} has no length: its ends coincide")
        return cls(length, chord / length[:, None], section.stiffness(chord), natural)


@dataclass(frozen=True)
class Deformation:
    """Kinematics and section forces of E elements in one state, in global axes."""

    Rm: Floats  # (E, 3, 3), rotation halfway between the ends
    e: Floats  # (E, 3), chord [m]
    Th: Floats  # (E, 3), rotation of the second end against the first [rad]
    Gamma: Floats  # (E, 3), strain
    K: Floats  # (E, 3), curvature beyond the natural one [1/m]
    n: Floats  # (E, 3), section force [N]
    m: Floats  # (E, 3), section moment [N m]
    q: Floats  # (E, 3), moment n x e of the section force over the element [N m]
    f_D: Floats  # (E, 3), moment that works on the difference of the end spins: H m + b Th x q [N m]
    halfway: Halfway  # scalars of the rotation maps


def deform(
    elements: BeamElements, chord: Floats, R1: Floats, R2: Floats, released: float = 1.0
) -> Deformation:
    """Return the deformation for chords (E, 3) [m], end rotations (E, 3, 3) and a share of the natural curvature.

    Elements whose ends have turned by more than `LARGEST_ANGLE` against each other get forces of nan: a
    solver then takes a smaller step.
    """
    Th = log(R2 @ np.swapaxes(R1, 1, 2))
    Th = np.where(np.linalg.norm(Th, axis=1, keepdims=True) > LARGEST_ANGLE, np.nan, Th)
    Rm = exp(0.5 * Th) @ R1
    Gamma = chord / elements.length[:, None] - np.einsum("eij,ej->ei", Rm, elements.axis)
    K = Th / elements.length[:, None]
    if np.ndim(elements.natural):
        K = K - released * np.einsum("eij,ej->ei", Rm, elements.natural)
    strain = np.stack([Gamma, K], axis=1)  # (E, 2, 3)
    turned_back = np.einsum("eji,ekj->eki", Rm, strain).reshape(-1, 6)
    forces = np.einsum("eij,ej->ei", elements.law, turned_back).reshape(-1, 2, 3)
    n, m = np.einsum("eij,ekj->eki", Rm, forces).swapaxes(0, 1)
    q = np.cross(n, chord)
    halfway = Halfway.of(Th)
    f_D = halfway.Hm(Th, m) + halfway.b[:, None] * np.cross(Th, q)
    return Deformation(Rm, chord, Th, Gamma, K, n, m, q, f_D, halfway)


def energy(elements: BeamElements, now: Deformation) -> Floats:
    """Return the stored energy (E,) [J].

    Examples
    --------
    >>> section = BeamSection.circular(diameter=1e-3, youngs_modulus=1e8, poisson_ratio=0.42)
    >>> beam, straight = BeamElements.between(np.array([[0.01, 0.0, 0.0]]), section), np.eye(3)[None]
    >>> stretched = deform(beam, np.array([[0.011, 0.0, 0.0]]), straight, straight)
    >>> float(round(energy(beam, stretched)[0], 6))  # EA e^2 L / 2 [J]
    0.003927
    """
    work = np.einsum("ei,ei->e", now.n, now.Gamma) + np.einsum("ei,ei->e", now.m, now.K)
    return 0.5 * elements.length * work


def force(now: Deformation) -> Floats:
    """Return the end forces (E, 4, 3): force [N] and moment [N m] of the first end, then of the second.

    Examples
    --------
    >>> section = BeamSection.circular(diameter=1e-3, youngs_modulus=1e8, poisson_ratio=0.42)
    >>> beam, straight = BeamElements.between(np.array([[0.01, 0.0, 0.0]]), section), np.eye(3)[None]
    >>> force(deform(beam, np.array([[0.011, 0.0, 0.0]]), straight, straight))[0, 2].round(3)  # EA e [N]
    array([7.854, 0.   , 0.   ])
    """
    half_q = 0.5 * now.q
    return np.stack([-now.n, half_q - now.f_D, now.n, half_q + now.f_D], axis=1)


def stiffness(elements: BeamElements, now: Deformation) -> Floats:
    """Return the exact derivative (E, 12, 12) of `force` over (u1, w1, u2, w2), with spins from the left.

    Set up for the changes of n, q and f_D with E' = u2 - u1, the mean spin S and the difference D of the end
    spins. They turn the element by w = S + Y D and change Th by H D + w x Th. With ^ for `hat` and the blocks
    C_n, C_nm, C_m of the law as it has turned, over L,

        dn = A E' + B w + C_nm H D          A = C_n,  B = A e^ - n^
        dm = C_nm^T (E' + e^ w) + C_m H D - m^ w
        dq = B^T E' + Q w - e^ C_nm H D     Q = e^ n^ - e^ A e^
        Y = -b Th^

    Off equilibrium the part of the spins is not symmetric: a spin does not commute with the next.
    """
    e = hat(now.e)
    Th = now.Th
    h = now.halfway
    turn = np.zeros((len(e), 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = now.Rm
    law = turn @ (elements.law / elements.length[:, None, None]) @ turn.swapaxes(1, 2)
    A = law[:, :3, :3]
    C_m = law[:, 3:, 3:]
    H = h.H(Th)
    n_D = law[:, :3, 3:] @ H
    m_E = n_D.swapaxes(1, 2)  # H C_nm^T
    B = A @ e - hat(now.n)
    Q = -e @ B
    Y = hat(-h.b[:, None] * Th)

    over_Th = h.dHm(Th, now.m) + _outer(h.db[:, None] * np.cross(Th, now.q), Th) - hat(h.b[:, None] * now.q)
    f_S = m_E @ e - Y @ (Q + hat(now.q)) - hat(now.f_D)
    f_D = (over_Th + H @ C_m) @ H + Y @ e @ n_D + f_S @ Y

    K = np.empty((len(e), 4, 3, 4, 3))
    K[:, 0, :, 0] = K[:, 2, :, 2] = A
    K[:, 0, :, 2] = K[:, 2, :, 0] = -A
    half_B = 0.5 * B
    over_D = B @ Y + n_D
    half_f_S = 0.5 * f_S
    quarter_Q = 0.25 * Q
    half_q_D = 0.5 * (Q @ Y - e @ n_D)
    for spin, sign in _SPINS:
        n_w = half_B + sign * over_D
        K[:, 2, :, spin] = n_w
        K[:, 0, :, spin] = -n_w
        K[:, spin, :, 2] = n_w.swapaxes(1, 2)
        K[:, spin, :, 0] = -n_w.swapaxes(1, 2)
        for other, way in _SPINS:
            K[:, spin, :, other] = quarter_Q + way * half_q_D + sign * half_f_S + sign * way * f_D
    return K.reshape(-1, 12, 12)


# Places of the end spins among (u1, w1, u2, w2), and their signs in D; S has half of either.
_SPINS = ((1, -1), (3, 1))


def _outer(first: Floats, second: Floats) -> Floats:
    """Return the dyads (E, 3, 3) of vectors (E, 3)."""
    return first[:, :, None] * second[:, None, :]


@dataclass(frozen=True)
class LinearSprings(Chosen):
    """Springs between K pairs of points that nodes carry by rigid arms, p0 and p1, at P0 and P1 in the reference.

        d = (p1 - p0) - (P1 - P0),   f = k d,   W = f . d / 2

    The axes of k keep their directions in space. -f acts on the first point and f on the second, on different lines as
    soon as the points are apart: no part of the model takes up the couple (p1 - p0) x f. Where both points coincide in
    the reference it is of second order in the stretch, otherwise of first order.
    """

    ends: Ints  # (K, 2), nodes that carry the points
    offsets: Floats  # (K, 2, 3), from the node to its point, in the reference [m]
    # (K, 3, 3), symmetric matrices k; diagonal if the springs stand along x, y and z [N/m]
    stiffness: Floats

    @classmethod
    def none(cls) -> LinearSprings:
        """Return no springs."""
        return cls(np.empty((0, 2), dtype=int), np.empty((0, 2, 3)), np.empty((0, 3, 3)))

    def at_points(self, stretch: Floats) -> Floats:
        """Return internal force and moment (K, 4, 3) at the first points, then at the second [N, N m].

        `stretch` d (K, 3) [m] is the displacement of the second points relative to the first.
        """
        return _SIDES[:, None] * np.einsum("kij,kj->ki", self.stiffness, stretch)[:, None]

    def stiffness_at_points(self) -> Floats:
        """Return the derivative (K, 12, 12) of `at_points` over the motion (u0, w0, u1, w1) of the points."""
        blocks = np.einsum("a,b,kij->kaibj", _SIDES, _SIDES, self.stiffness)
        return blocks.reshape(-1, 12, 12)


_SIDES = np.array([-1.0, 0.0, 1.0, 0.0])  # of force and moment at the first point, then at the second


# State of a network of beams, and the history of its contact at the last converged increment


@dataclass(frozen=True, eq=False)
class CommittedPoints:
    """Points of contact at the last converged increment."""

    position: Floats  # (p, 3) [m]
    rotation: Floats  # (p, 3, 3), of the sections
    vectors: Floats  # (2, 3), of the lattice [m]
    diameter: float  # of the yarns [m]


@dataclass(frozen=True, eq=False)
class LineHistory(Chosen):
    """History of the pairs of points that touched at the last converged increment, and all points then."""

    key: Ints  # (m,), ascending; which pairs
    arm: Floats  # (m, 2, 3), from the centres to the points that met, in the sections' axes [m]
    normal: Floats  # (m, 2, 3), at the closest points of both yarns, in the axes of both sections
    share: Floats  # (m,), part of the pairs' force along it
    density: Floats  # (m,), c times the lengths of both pieces [m2]
    thinning: Floats  # (m,), its derivative by the distance [m]
    shape: Floats  # (m,), factor of F(delta) by the shape of the contact
    distance: Floats  # (m,), r [m]
    force: Floats  # (m,), their part of the force [N]
    shear: Floats  # (m, 2, 3, 3), S in the axes of both sections
    spring: Floats  # (m,), k [N/m]
    traction: Floats  # (m, 2, 3), friction on j with which the next increment begins, in the axes of both sections [N]
    end_traction: (
        Floats  # (m, 2, 3), the same in the balanced state, from which the next increment's work counts [N]
    )
    stored: Floats  # (m,), energy of elastic slip [J]
    dissipated: float = 0.0  # work of friction so far [J]
    points: CommittedPoints | None = None  # None: nothing has been converged yet

    @classmethod
    def none(cls) -> LineHistory:
        """Return the history of yarns that have not touched."""
        one = np.zeros(0)
        both = np.zeros((0, 2, 3))
        key = np.zeros(0, dtype=np.int64)
        square = np.zeros((0, 2, 3, 3))
        return cls(key, both, both, one, one, one, one, one, one, square, one, both, both, one)


@dataclass(frozen=True, eq=False)
class BeamContactHistory:
    """History of contact at the last converged increment: of pairs of points and of K crossings."""

    points: LineHistory
    on_stations: Floats  # (S, 3), internal forces of contact [N]
    force: Floats  # (K, 3), of contact on the first yarn [N]
    # (K + 1,), of the yarns at their closest points, at last of those without a crossing; nan where none are near [m]
    gap: Floats
    slip: Floats  # (K,), mean length slid since first contact [m]


@dataclass(frozen=True, eq=False)
class BeamState:
    """Configuration of N nodes, or of points that nodes carry."""

    position: Floats  # (N, 3), positions [m]
    rotation: Floats  # (N, 3, 3), rotations from the reference, where they are the identity
    contact: BeamContactHistory | None = None
    released: float = 1.0  # share of the elements' natural curvature that acts

    @property
    def contact_history(self) -> BeamContactHistory:
        """History of contact of a state that a model with contact has made."""
        assert self.contact is not None, "this state is of a model without contact"
        return self.contact
