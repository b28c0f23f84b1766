"""Geometrically exact two-node beam with one integration point (Reissner 1981, Simo 1985), as Abaqus' B31.

With the end rotations R1, R2 measured from the reference, the chord r = x2 - x1 and the reference direction
t of a straight element of length L,

    Th = log(R1^T R2),   Rm = R1 exp(Th / 2),   e = Rm^T r
    Gamma = e / L - t,   K = Th / L
    W = L/2 (Gamma . C_N Gamma + K . C_M K)

Vectors without further word stand in the frame Rm, whose axes are the global ones of the reference; so C_N
and C_M need no section frame. The strains vanish in the reference: a curved yarn is a polygon of such
elements, and its curvature is free of stress. A rigid rotation of the whole turns Rm alone, so the element
is objective.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.fem.rotation import Halfway, exp, hat, log

# Beyond this angle between the ends the logarithm may have taken the other way round.
LARGEST_ANGLE = 0.95 * np.pi


@dataclass(frozen=True)
class Section:
    """Stiffness of a section that is the same in all directions; floats, or one value an element (E,).

    Attributes
    ----------
    EA : float
        Axial stiffness [N].
    kGA : float
        Shear stiffness [N].
    EI : float
        Bending stiffness [N m2].
    GJ : float
        Torsional stiffness [N m2].
    slenderness : float
        Slenderness compensation factor: an element of length L has the shear stiffness
        kGA / (1 + slenderness L^2 EA / (12 EI)). One integration point alone makes an element in S-shaped
        bending as stiff as its shear; this bounds it. 0 leaves kGA as it is.
    """

    EA: float | np.ndarray
    kGA: float | np.ndarray
    EI: float | np.ndarray
    GJ: float | np.ndarray
    slenderness: float = 0.0

    @classmethod
    def circular(cls, diameter: float, youngs_modulus: float, poisson_ratio: float, count=1.0) -> Section:
        """Return the section of `count` solid circular yarns side by side, with the constants of Abaqus' B31.

        The shear factor 0.89 and the slenderness compensation factor 0.25 are that element's defaults. Cowper
        (1966) gives 6 (1 + nu) / (7 + 6 nu) = 0.895 at nu = 0.42; the difference is without effect on
        slender yarns.
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
            slenderness=0.25,
        )


@dataclass(frozen=True)
class Elements:
    """Reference state and stiffness of E straight elements.

    Attributes
    ----------
    length : ndarray, shape (E,)
        Reference length L [m].
    axis : ndarray, shape (E, 3)
        Reference direction t.
    C_N : ndarray, shape (E, 3, 3)
        Force over strain [N].
    C_M : ndarray, shape (E, 3, 3)
        Moment over curvature [N m2].
    """

    length: np.ndarray
    axis: np.ndarray
    C_N: np.ndarray
    C_M: np.ndarray

    @classmethod
    def straight(cls, chord: np.ndarray, section: Section) -> Elements:
        """Return the elements with the reference chords (E, 3) [m].

        Raises
        ------
        GeometryError
            If an element has no length.
        """
        length = np.linalg.norm(chord, axis=1)
        if not np.all(length > 0):
            worst = int(np.argmin(length))
            raise GeometryError(f"beam element {worst} has no length: its ends coincide")
        axis = chord / length[:, None]
        kGA = section.kGA / (1 + section.slenderness * length**2 * section.EA / (12 * section.EI))
        return cls(length, axis, _about(axis, section.EA, kGA), _about(axis, section.GJ, section.EI))


def _about(axis: np.ndarray, along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Tensors (E, 3, 3) with one value along the axis (E, 3) and another across it."""
    outer = axis[:, :, None] * axis[:, None, :]
    along, across = (np.broadcast_to(v, len(axis))[:, None, None] for v in (along, across))
    return along * outer + across * (np.eye(3) - outer)


@dataclass(frozen=True)
class Deformation:
    """Kinematics and section forces of E elements in one state.

    Attributes
    ----------
    Rm : ndarray, shape (E, 3, 3)
        Rotation halfway between the ends.
    e, Th : ndarray, shape (E, 3)
        Chord [m] and relative rotation [rad], in the frame Rm.
    Gamma, K : ndarray, shape (E, 3)
        Strain and curvature [1/m].
    n, m : ndarray, shape (E, 3)
        Section force [N] and moment [N m].
    halfway : Halfway
        Scalars of the rotation maps.
    """

    Rm: np.ndarray
    e: np.ndarray
    Th: np.ndarray
    Gamma: np.ndarray
    K: np.ndarray
    n: np.ndarray
    m: np.ndarray
    halfway: Halfway

    @property
    def q(self) -> np.ndarray:
        """Moment n x e (E, 3) of the section force over the element [N m]."""
        return np.cross(self.n, self.e)

    @property
    def turned(self) -> np.ndarray:
        """Moment (E, 3) that works on half the difference of the end spins: H m + b Th x q [N m]."""
        h = self.halfway
        return _apply(h.H(self.Th), self.m) + h.b[:, None] * np.cross(self.Th, self.q)


def deform(elements: Elements, chord: np.ndarray, R1: np.ndarray, R2: np.ndarray) -> Deformation:
    """Return the deformation for chords (E, 3) [m] and end rotations (E, 3, 3).

    Elements whose ends have turned by more than `LARGEST_ANGLE` against each other get forces of nan: a
    solver then takes a smaller step.
    """
    Th = log(np.swapaxes(R1, 1, 2) @ R2)
    Th = np.where(np.linalg.norm(Th, axis=1, keepdims=True) > LARGEST_ANGLE, np.nan, Th)
    Rm = R1 @ exp(0.5 * Th)
    e = _apply(np.swapaxes(Rm, 1, 2), chord)
    Gamma = e / elements.length[:, None] - elements.axis
    K = Th / elements.length[:, None]
    return Deformation(
        Rm, e, Th, Gamma, K, n=_apply(elements.C_N, Gamma), m=_apply(elements.C_M, K), halfway=Halfway.of(Th)
    )


def energy(elements: Elements, now: Deformation) -> np.ndarray:
    """Return the stored energy (E,) [J]."""
    density = np.einsum("ei,ei->e", now.n, now.Gamma) + np.einsum("ei,ei->e", now.m, now.K)
    return 0.5 * elements.length * density


def force(now: Deformation) -> np.ndarray:
    """Return the end forces (E, 4, 3): force [N] and moment [N m] of the first end, then of the second."""
    n, half_q, f_D = (_apply(now.Rm, v) for v in (now.n, 0.5 * now.q, now.turned))
    return np.stack([-n, half_q - f_D, n, half_q + f_D], axis=1)


def stiffness(elements: Elements, now: Deformation) -> np.ndarray:
    """Return the exact derivative (E, 12, 12) of `force` over (u1, w1, u2, w2), with spins from the left.

    Set up in the frame Rm for the chord's change E', the mean spin S and the difference of spins D; then
    turned to global axes and spread to the ends. Off equilibrium it is not symmetric: a spin does not
    commute with the next.
    """
    n, e, Th, q, f_D, h = now.n, now.e, now.Th, now.q, now.turned, now.halfway
    L, b = elements.length[:, None, None], h.b[:, None, None]
    identity = np.broadcast_to(np.eye(3), (len(n), 3, 3))
    zero = np.zeros_like(identity)

    H = h.H(Th)
    w_m = np.concatenate([zero, identity, -b * hat(Th)], axis=2)  # (E, 3, 9)
    d_e = np.concatenate([identity, zero, zero], axis=2) + hat(e) @ w_m
    d_Th = np.concatenate([zero, zero, H], axis=2)

    d_n = elements.C_N @ d_e / L
    d_q = hat(n) @ d_e - hat(e) @ d_n
    d_b = h.db[:, None, None] * Th[:, None, :]
    over_Th = h.dHm(Th, now.m) + np.cross(Th, q)[:, :, None] * d_b - b * hat(q)
    d_f_D = (over_Th + H @ elements.C_M / L) @ d_Th + b * hat(Th) @ d_q

    # The frame turns with w_m: d(Rm f) = Rm (w_m x f + df).
    local = np.concatenate([d_v - hat(v) @ w_m for v, d_v in ((n, d_n), (q, d_q), (f_D, d_f_D))], axis=1)
    blocks = local.reshape(-1, 3, 3, 3, 3)  # element, row block, row, column block, column
    turned = np.einsum("eij,eajbk,elk->eaibl", now.Rm, blocks, now.Rm, optimize=True)
    return np.einsum("ap,eaibl,bq->epiql", _SPREAD, turned, _SPREAD, optimize=True).reshape(-1, 12, 12)


# (E', S, D) from (u1, w1, u2, w2): u2 - u1, (w1 + w2) / 2, w2 - w1
_SPREAD = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, 0.5, 0.0, 0.5], [0.0, -1.0, 0.0, 1.0]])


def _apply(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return matrices (E, 3, 3) times vectors (E, 3)."""
    return np.einsum("eij,ej->ei", matrices, vectors)
