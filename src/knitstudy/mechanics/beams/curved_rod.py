"""Section law of a curved rod: Saint-Venant's problem of a torus of circular section, solved on the disc.

The rod has the curvature kappa towards its principal normal N; x and y count along N and the binormal B from the
centre of the section, t is the tangent. A layer at x is g = 1 - kappa x as long as the centreline. With section forces
f = (n_N, n_B, n_t, m_N, m_B, m_t), strains p = (Gamma_N, Gamma_B, Gamma_t, K_N, K_B, K_t) of the section as a whole and
a warping w(x, y, s) on top, all in components that turn with the rod,

    g e_tt = w_t' - kappa w_N + Gamma_t + K_N y - K_B x        e_NN = w_N,x    e_BB = w_B,y
    g e_Nt = w_N' + kappa w_t + Gamma_N - K_t y + g w_t,x      e_NB = w_N,y + w_B,x  (shear angles)
    g e_Bt = w_B' + Gamma_B + K_t x + g w_t,y

and equilibrium of a free rod is f' = T f: n' + kappa B x n = 0, m' + kappa B x m + t x n = 0. Away from its ends such
a rod is in a state w = W f, p = P f with constant W and P (Giavotto et al. 1983, here with curvature). W is made of
polynomials of x and y, so that virtual work gives a linear matrix equation for both. The complementary energy
f S f / 2 of a slice is the law.

At kappa = 0 it is that of the straight rod, with the shear factor 6 (1 + nu)^2 / (7 + 14 nu + 8 nu^2) of its energy.
Normal forces on the surface ask for another one, see `eased_by_pressure`.
Couplings grow with k = kappa R, all else changes with k^2; closed forms and checks: docs/notes/beams.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from knitstudy.errors import GeometryError
from knitstudy.mechanics.beams.beam import SLENDERNESS
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials.isotropic import Hencky

DEGREE = 8  # of the polynomials: at k = 0.55 degree 10 moves no compliance by more than 2e-5 of it
TIGHTEST = 0.8  # largest k = kappa R of the table; the layers inside of a yarn vanish at 1
NODES = 12  # bends at which the problem is solved: in between the law is met to 1e-7
# Forces of the two problems that symmetry about the plane of curvature separates: in that plane, and out of it.
PLANES = ((0, 2, 4), (1, 3, 5))


@lru_cache(maxsize=16)
def _table(poisson_ratio: float) -> np.ndarray:
    """Chebyshev coefficients (2 NODES, 6, 6) of the compliance over k / `TIGHTEST`.

    Seen from the other side of its plane a rod has the opposite curvature, and N, B with the signs changed: couplings
    of n_t, m_t with forces across them are odd in k.
    """
    nodes = chebyshev.chebpts1(2 * NODES)
    seen = np.diag([-1.0, -1, 1, -1, -1, 1])
    values = np.stack([section_compliance(TIGHTEST * node, poisson_ratio) for node in nodes[NODES:]])
    values = np.concatenate([seen @ values[::-1] @ seen, values])
    return chebyshev.chebfit(nodes, values.reshape(-1, 36), 2 * NODES - 1).reshape(-1, 6, 6)


def compliances(bends: Floats, poisson_ratio: float) -> np.ndarray:
    """Return the compliances S (k, 6, 6) of rods of radius 1 and modulus 1 with curvatures (k,) up to `TIGHTEST`.

    Rows and columns are (n_N, n_B, n_t, m_N, m_B, m_t).

    Examples
    --------
    >>> S = compliances([0.0], poisson_ratio=0.3)[0]
    >>> float(round(1 / S[2, 2], 6)), float(round(1 / S[3, 3], 6))  # EA = pi and EI = pi / 4 of a straight rod
    (3.141593, 0.785398)
    """
    at = np.asarray(bends) / TIGHTEST
    return np.moveaxis(chebyshev.chebval(at, _table(float(poisson_ratio))), -1, 0)


def section_compliance(
    bend: float,  # curvature times radius, k
    poisson_ratio: float,
    degree: int = DEGREE,  # of the polynomials of the warping
) -> Floats:
    """Return the compliance S (6, 6) of a rod of radius 1, modulus 1 and curvature `bend` below 1.

    Examples
    --------
    >>> compliance = section_compliance(1e-3, poisson_ratio=0.3)
    >>> float(round(1 / compliance[2, 2] / np.pi, 3))  # E A of an all but straight rod, over pi
    1.0
    """
    S = np.zeros((6, 6))
    for forces in PLANES:
        S[np.ix_(forces, forces)] = _solve(_disc_of(degree, forces == PLANES[0]), bend, poisson_ratio, forces)
    return S


class _Disc:
    """Polynomials on the unit disc that one symmetry has: cosines or sines by component (N, B, t).

    ``value``, ``along_x`` and ``along_y`` (3, q, n) at the points ``x``, ``y`` of weight ``weight`` (q,).
    """

    def __init__(self, degree: int, in_plane: bool) -> None:
        points, mean = disc.on_rings(degree + 5, 4 * degree + 16, 0.5)
        above = points[:, 1] > 0  # the other half does the same work
        points = points[above]
        self.weight = 2 * np.pi * mean[above]
        self.x, self.y = points.T
        value, slope = disc.gradients(degree, points)
        parts = np.stack([value, slope[..., 0], slope[..., 1]])
        # Unknowns of a component are its own polynomials; all others are zero there.
        every = np.einsum("cd,pqn->pcqdn", np.eye(3), parts).reshape(3, 3, len(points), -1)
        kept = [disc.modes(degree).sine == (in_plane == (c == 1)) for c in range(3)]
        self.value, self.along_x, self.along_y = every[..., np.concatenate(kept)]


_disc_of = cache(_Disc)


def _solve(section: _Disc, bend: float, poisson_ratio: float, forces: tuple[int, ...]) -> Floats:
    """Return the compliance (3, 3) of the forces that one symmetry has."""
    f = list(forces)
    T = _balance(bend)[np.ix_(f, f)]
    of_warping, of_slope, of_strain = _strains(section, bend)
    root = np.linalg.cholesky(Hencky(1.0, poisson_ratio).moduli).T
    weigh = np.sqrt(section.weight * (1.0 - bend * section.x))[:, None, None] * root
    B0, B1, BR = (
        (weigh @ values).reshape(-1, values.shape[-1]) for values in (of_warping, of_slope, of_strain[..., f])
    )
    # Motions of the section as a whole are no warping.
    rigid = _rigid(section)[:, :, f].reshape(-1, 3)
    shapes = section.value.transpose(1, 0, 2).reshape(-1, section.value.shape[-1])
    weights = np.repeat(section.weight, 3)[:, None]
    motion = shapes.T @ (weights * rigid)
    free = np.linalg.svd(motion.T)[2][3:].T
    B0, B1 = B0 @ free, B1 @ free
    # (B1' e)' = B0' e for the warping, BR' e = f for the strains, with e = B1 W T + B0 W + BR P for every f.
    n = B0.shape[1]
    one = np.eye(3)
    M, C, E = B1.T @ B1, B1.T @ B0, B0.T @ B0
    of_warping = np.kron(M, (T @ T).T) + np.kron(C - C.T, T.T) - np.kron(E, one)
    of_both = np.kron(B1.T @ BR, T.T) - np.kron(B0.T @ BR, one)
    back = np.kron(BR.T @ B1, T.T) + np.kron(BR.T @ B0, one)
    system = np.block([[of_warping, of_both], [back, np.kron(BR.T @ BR, one)]])
    solution = np.linalg.solve(system, np.concatenate([np.zeros(3 * n), one.ravel()]))
    W = solution[: 3 * n].reshape(n, 3)
    P = solution[3 * n :].reshape(3, 3)
    e = B1 @ (W @ T) + B0 @ W + BR @ P
    return e.T @ e


def _balance(bend: float) -> Floats:
    """The matrix T of f' = T f."""
    T = np.zeros((6, 6))
    T[0, 2] = -bend
    T[2, 0] = bend
    T[3, 5] = -bend
    T[5, 3] = bend
    T[3, 1], T[4, 0] = 1.0, -1.0
    return T


def _strains(section: _Disc, bend: float) -> tuple[Floats, Floats, Floats]:
    """Strains (q, 6, .) NN, BB, tt, NB, Nt, Bt by the warping, its slope along the rod, and the section's strains."""
    (N, B, t), (N_x, B_x, t_x), (N_y, B_y, t_y) = section.value, section.along_x, section.along_y
    g = (1.0 - bend * section.x)[:, None]
    none = np.zeros_like(N)
    of_warping = np.stack([N_x, B_y, -bend / g * N, N_y + B_x, t_x + bend / g * t, t_y], axis=1)
    of_slope = np.stack([none, none, t / g, none, N / g, B / g], axis=1)
    of_strain = np.zeros((len(g), 6, 6))
    of_strain[:, [4, 5, 2]] = _rigid(section) / g[:, :, None]
    return of_warping, of_slope, of_strain


def _rigid(section: _Disc) -> Floats:
    """Displacements (q, 3, 6) of the section's points by its translations and rotations."""
    rigid = np.zeros((len(section.x), 3, 6))
    rigid[:, range(3), range(3)] = 1.0
    rigid[:, 2, 3] = section.y
    rigid[:, 2, 4] = -section.x
    rigid[:, 0, 5] = -section.y
    rigid[:, 1, 5] = section.x
    return rigid


# Normal forces on the surface
# Bending by dk moves a point of the surface in the direction n from the axis of a straight rod (Saint-Venant) by
#
#     nu R^2 / 2 ((dk . n) n - (dk . b) b),   b = t x n:
#
# fibres on the inside of the bend are shorter and thicker. The displacement of beams is the one that does work with the
# shear force of the energy. Relative to it, the surface under a normal force moves by c dk, and under a force across
# the rod by (c - nu R^2) dk, with
#
#     c = (1 + e) nu R^2 / 2,   e = (1 + 2 nu) / (6 (1 + nu)).
#
# Of a curved rod the other yarn lies inside of the bend, where both move the surface under normal forces: bending by
#
#     c' dk,   c' = c - k R^2 (1 - nu) (7 + 4 nu) / 24   (to first order in k),
#
# since the section of a curved rod becomes flat, and tension by nu R e outwards from the other yarn, since a stretched
# yarn is thinner. Normal forces q per length so do additional work (c' q_N m_B - c q_B m_N) / EI - nu R q_N n_t / EA.
# With their equilibrium, q_N = -n_N' - kappa n_t and q_B = -n_B', the complementary energy of a slice is less by
#
#     ((c' + k nu R^2 / 4) n_N^2 + c n_B^2 + kappa (c' n_t m_B - c n_B m_t) - k nu R^2 / 4 n_t^2) / EI.
#
# Of a straight rod this is a shear factor of 6 (1 + nu)^2 / (7 - 8 nu^2). Forces across have 6 (1 + nu)^2 / (7 + 24 nu
# + 16 nu^2), and the mean of both compliances has Hutchinson's (2001), 6 (1 + nu)^2 / (7 + 12 nu + 4 nu^2).


def eased_by_pressure(bends: Floats, poisson_ratio: float) -> Floats:
    """Return by how much S (k, 6, 6) is less in rods loaded by normal forces on their surface, inside of bends.

    Examples
    --------
    >>> nu = 0.3
    >>> S = compliances([0.0], nu)[0] - eased_by_pressure([0.0], nu)[0]
    >>> bool(np.isclose(1 / S[0, 0], 6 * (1 + nu) ** 2 / (7 - 8 * nu**2) * np.pi / (2 * (1 + nu))))
    True
    """
    nu = poisson_ratio
    k = np.asarray(bends)
    eased = np.zeros((len(bends), 6, 6))
    c = nu * (7 + 8 * nu) / (12 * (1 + nu))
    inside = c - k * (1 - nu) * (7 + 4 * nu) / 24
    thinner = k * nu / 4
    eased[:, 0, 0] = 2 * (inside + thinner)
    eased[:, 1, 1] = 2 * c
    eased[:, 2, 2] = -2 * thinner
    eased[:, [2, 4], [4, 2]] = (k * inside)[:, None]
    eased[:, [1, 5], [5, 1]] = (-k * c)[:, None]
    return 4 / np.pi * eased  # 1 / EI = 4 / pi


# Section of beams that follow a curved yarn: the law of a curved rod, by the curvature of every element


@dataclass(frozen=True)
class CurvedSection:
    """Solid circular sections of one isotropic material, in rods that are bent without stress.

    Where a rod is straight this is `BeamSection.circular`, with the shear factor of the strain energy for 0.89 (0.847
    at nu = 0.42).
    """

    radius: float  # [m]
    youngs_modulus: float  # [Pa]
    poisson_ratio: float
    # (E, 3), mean curvature vector t x dt/ds of the undeformed rod over every element: along the binormal
    # [1/m]
    curvature: Floats
    slenderness: float = SLENDERNESS  # see `BeamSection`
    pressed: float | Floats = 0.0  # (E,), share of normal forces in what loads the rod on its surface

    def stiffness(self, chord: Floats) -> Floats:
        """Return the law C (E, 6, 6) of elements with the reference chords (E, 3) [m], see `SectionLaw`.

        Raises GeometryError if a rod is bent more tightly than the law is known for.
        """
        length = np.linalg.norm(chord, axis=1)
        frame, bend = self._frames(chord / length[:, None])
        S = compliances(bend, self.poisson_ratio)
        S -= np.reshape(self.pressed, (-1, 1, 1)) * eased_by_pressure(bend, self.poisson_ratio)
        softer = 1 + self.slenderness * (length / self.radius) ** 2 / 3  # R^2 EA = 4 EI
        S[:, :2, :2] *= softer[:, None, None]
        scale = np.repeat([1.0, self.radius], 3)
        law = self.youngs_modulus * self.radius**2 * np.outer(scale, scale) * np.linalg.inv(S)
        turn = np.zeros_like(law)
        turn[:, :3, :3] = turn[:, 3:, 3:] = frame
        return turn.swapaxes(1, 2) @ law @ turn

    def _frames(self, t: Floats) -> tuple[Floats, Floats]:
        """Rows N, B, t (E, 3, 3) of elements along t, and their curvature over 1 / radius (E,)."""
        across = self.curvature - np.einsum("ei,ei->e", self.curvature, t)[:, None] * t
        bend = self.radius * np.linalg.norm(across, axis=1)
        if not np.all(bend <= TIGHTEST):
            worst = int(np.argmax(np.nan_to_num(bend, nan=np.inf)))
            raise GeometryError(
                f"beam element {worst} is bent to a radius of {self.radius / bend[worst]:.4g}, and the law of a "
                f"curved rod is known down to {self.radius / TIGHTEST:.4g}, {1 / TIGHTEST:g} yarn radii: "
                "take straight sections, which do without it"
            )
        # Where a rod is straight any normal will do.
        any_normal = np.eye(3)[np.argmin(np.abs(t), axis=1)]
        B = np.where((bend > 1e-12)[:, None], across, np.cross(t, any_normal))
        B /= np.linalg.norm(B, axis=1)[:, None]
        return np.stack([np.cross(B, t), B, t], axis=1), bend
