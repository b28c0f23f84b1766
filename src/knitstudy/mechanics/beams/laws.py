"""Contact laws of beams: force of two yarns that cross, effect of their curvatures, potential of two short pieces.

Two yarns whose axes have the unit tangents a and b at their closest points, and bend towards each other with the
curvatures k_a and k_b, touch with surfaces that part by x . M x / 2R over their common tangent plane,

    M = 2 I - alpha a a^T - beta b b^T,   alpha = 1 / (1 - k_a R),   beta = 1 / (1 - k_b R):

the inner side of a bend has the curvature k / (1 - k R) along the yarn. Straight yarns that cross at a right angle have
M = I and carry F(delta) at an approach delta. Everything else follows from the trace and the determinant of M. Yarns of
the radii q_a R and q_b R, q_a + q_b = 2, have

    M = 2 I - q_b alpha a a^T - q_a beta b b^T,   alpha = 1 / (1 - q_a k_a R),   beta = 1 / (1 - q_b k_b R),

over the radius q_a q_b R of equal yarns with the same mean of both curvatures, of which F(delta) is.

Half spaces (Hertz; Johnson 1985, section 4.2). The patch has the semi-axes a > b and the eccentricity e; l = B / A is
the ratio of the principal values of M. With the complete elliptic integrals K(e), E(e) and D = (K - E) / e^2,

    l = (E / (1 - e^2) - K) / (K - E),   F(delta; M) = F(delta) g(l) det(M)^(-1/4)
    g = (pi / sqrt 2) D^(1/2) K^(-3/2) l^(1/4).

Bodies that stick are held with s dF/d(delta) (Mindlin 1949; Deresiewicz 1957), along and across the patch with

    s = (1 - nu) K / ((1 - nu) K + nu D)   and   s = (1 - nu) K / ((1 - nu) K + nu (K - D)).

Layers, whose pressure is a power of their compression point by point, carry F(delta) / sqrt(det M) for any power.

An integral of a potential over both axes (`line_contact`) carries F(delta) sqrt(alpha beta / det M) for any law F.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.beams.expansion import Expansion
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.registry import Registry

# Reading a scene needs the names of laws alone: functions import SciPy, which takes a second, when they are called.
if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from knitstudy.mechanics.beams.pair_search import PointPairs

# Hertz's patch is small against R. The patch of yarns that conform or lie along each other is not: curvatures that
# become flat or sharp there have smooth lower bounds. Up to kR = 0.45 around each other, or down to 15 degrees, the
# bounds change forces by less than 2 %.
LEAST_DET = 0.006  # of det M
LEAST_OPEN = 0.015  # of 2 - alpha: yarns bent beyond 1 / 2R do not touch at one point
LEAST_INNER = 0.02  # of 1 - kR: a yarn bent to its own radius has no inner side

_LOGARITHMS = np.linspace(0.0, 9.0, 400)  # of l, beyond the largest that `LEAST_DET` admits


def eccentricity_squared(ratio: Floats) -> Floats:
    """Return e^2 (k,) of patches between surfaces whose relative curvatures have the ratio l >= 1 (k,).

    Examples
    --------
    >>> float(eccentricity_squared(np.array([1.0]))[0].round(12)) + 0.0  # yarns that cross at right angles
    0.0
    """
    one_less: Floats = np.expm1(_flattening()(np.log(ratio)))
    return -one_less


@cache
def _flattening() -> CubicSpline:
    """Return the spline of ln(1 - e^2) over ln l."""
    from scipy.interpolate import CubicSpline
    from scipy.special import elliprd

    log = -16 * np.linspace(0.0, 1.0, 2001)[1:] ** 2
    m = -np.expm1(log)
    ratio = elliprd(0, 1, 1 - m) / elliprd(0, 1 - m, 1)  # l (DLMF 19.25.1)
    return CubicSpline(np.append(0.0, np.log(ratio)), np.append(0.0, log))


def _integrals(ratio: Floats) -> tuple[Floats, Floats]:
    """Return K and D (k,) of patches with curvature ratios l (k,)."""
    from scipy.special import ellipk, elliprd

    m = eccentricity_squared(ratio)
    return ellipk(m), elliprd(0, 1 - m, 1) / 3


@cache
def _shape() -> tuple[CubicSpline, CubicSpline, CubicSpline]:
    """Return ln g over y = tr(M)^2 / (4 det M) - 1 = sinh^2(ln(l) / 2), and its two derivatives."""
    from scipy.interpolate import CubicSpline

    K, D = _integrals(np.exp(_LOGARITHMS))
    log = np.log(np.pi / np.sqrt(2) * D**0.5 * K**-1.5) + 0.25 * _LOGARITHMS
    curve = CubicSpline(np.sinh(0.5 * _LOGARITHMS) ** 2, log)
    return curve, curve.derivative(1), curve.derivative(2)


@dataclass(frozen=True)
class Patch:
    """Effect of the shape of a contact on its force and its stiffness."""

    poisson_ratio: float | None = None  # of half spaces; None: layers

    @property
    def spreads(self) -> bool:
        """Whether the pressure at a place deforms its surroundings, as that on half spaces does."""
        return self.poisson_ratio is not None

    def density(
        self, k_a: Expansion, k_b: Expansion, cos: Expansion, near: Expansion, *ratios: Floats
    ) -> tuple[Expansion, Expansion]:
        """Return the factor of the integrand of a potential over both axes, and the force over F(delta) that it makes.

        Arguments are k_a R, k_b R, the cosine of the angle and the distance over the diameter; q_a and q_b (k,) of
        yarns of different radii. From closest points of axes that are nearer than a diameter their distance grows
        faster than the gap of the undeformed surfaces, which Hertz's law is about; layers are pressed by the overlap
        itself.
        """
        both, trace, det = _surfaces(k_a, k_b, cos, *ratios)
        force = self._force(trace, det)
        if self.spreads:
            both, _, det = _surfaces(k_a * near, k_b * near, cos)
        elif ratios:  # the distance of axes knows no radii
            both, _, det = _surfaces(k_a, k_b, cos)
        return force * det.power(0.5) * both.power(-0.5), force

    def _force(self, trace: Expansion, det: Expansion) -> Expansion:
        if not self.spreads:
            return det.power(-0.5)
        y = 0.25 * (trace * trace * det.power(-1.0)) + (-1.0)
        value, first, second = (curve(y.value) for curve in _shape())
        g = np.exp(value)
        return y.through(g, g * first, g * (second + first**2)) * det.power(-0.25)

    def shear(self, tangents: Floats, bends: Floats, normal: Floats, *ratios: Floats) -> Floats:
        """Return the shear stiffness over dF/d(delta) (k, 3, 3) in the tangent plane.

        `tangents` (k, 2, 3) are of both axes, `bends` (k, 3) and `ratios` as for `density`, `normal` (k, 3) is a unit
        vector.
        """
        flat = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        nu = self.poisson_ratio
        if nu is None:
            return flat
        k_a, k_b, cos = Expansion.variables(bends, second=False)
        _, trace, det = _surfaces(k_a, k_b, cos, *ratios)
        half = 0.5 * trace.value
        root = np.sqrt(np.maximum(half**2 - det.value, 0.0))
        ratio = np.maximum((half + root) / np.maximum(half - root, 1e-3 * LEAST_DET), 1.0)
        K, D = _integrals(np.minimum(ratio, np.exp(_LOGARITHMS[-1])))
        along = (1 - nu) * K / ((1 - nu) * K + nu * D)
        across = (1 - nu) * K / ((1 - nu) * K + nu * (K - D))
        # The patch is long where M is small: M = 2 I - alpha a a^T - beta b b^T.
        axes = np.einsum("kij,kaj->kai", flat, tangents)
        q = np.stack(ratios, axis=1) if ratios else np.ones((1, 2))
        weight = q[:, ::-1] / np.maximum(1 - q * bends[:, :2], 0.5)
        M = 2 * flat - np.einsum("ka,kai,kaj->kij", weight, axes, axes)
        # Deviator of M over its size is e2 e2^T - e1 e1^T of both principal directions.
        deviator = M - 0.5 * np.trace(M, axis1=1, axis2=2)[:, None, None] * flat
        size = np.sqrt(0.5 * np.einsum("kij,kij->k", deviator, deviator))
        deviator = np.divide(
            deviator, size[:, None, None], out=np.zeros_like(M), where=(size > 1e-12)[:, None, None]
        )
        mean = 0.5 * (along + across)
        half_difference = 0.5 * (across - along)
        stiffness: Floats = mean[:, None, None] * flat + half_difference[:, None, None] * deviator
        return stiffness


def _surfaces(
    k_a: Expansion, k_b: Expansion, cos: Expansion, *ratios: Floats
) -> tuple[Expansion, Expansion, Expansion]:
    """Return alpha beta, the trace and the determinant of M."""
    q_a, q_b = ratios or (1.0, 1.0)
    alpha, beta = ((1.0 + k * -q).at_least(LEAST_INNER).power(-1.0) for k, q in ((k_a, q_a), (k_b, q_b)))
    one, other = ((2.0 + angle * -q).at_least(LEAST_OPEN) for angle, q in ((alpha, q_b), (beta, q_a)))
    crossed = (2.0 + (-1.0) * one) * (2.0 + (-1.0) * other) * (cos * cos)
    det = one * other + (-1.0) * crossed
    if ratios:  # the bound is over what yarns at a right angle have
        return alpha * beta, one + other, (det * (1 / (q_a * q_b))).at_least(LEAST_DET) * (q_a * q_b)
    return alpha * beta, one + other, det.at_least(LEAST_DET)


LAYERS = Patch()

FITTED = 0.05, 0.5  # approaches over the diameter between which the law of two unlike yarns is fitted
ASKEW = 0.05


@dataclass(frozen=True, eq=False)
class Power:
    """Force of two yarns that cross at a right angle over their approach, which is their overlap as beams.

    It is coefficient approach^exponent [N], or becomes so as the approach vanishes.
    """

    coefficient: float  # of `Mixed` yarns, this and other fields hold one value a pair (k,)
    # Above 1: under a linear law, pieces would touch with their full stiffness, and later pieces would not rub.
    exponent: float = 1.5
    share: float = 1.0  # stiffness against elastic slip over that against approach
    patch: Patch = LAYERS  # effect of the shape of the contact
    penalty: bool = False  # whether the stiffness is a numerical penalty

    PAIRED: ClassVar[tuple[str, ...]] = ("coefficient", "exponent")
    """Fields that may hold one value a pair."""

    def against(self, other: Power, radii: tuple[float, float]) -> Power:
        """Return the law of two yarns with this law and another one, of two radii [m]; of crossings, over det(M)^-1/2.

        Layers in series: at a pressure p one gives way by w = (2 pi R p / (c n))^(1 / (n - 1)) / 2, and the force is
        2 pi R sum p w / n, with the radius of M for R. It is a power of the approach where both are, and nearly one
        otherwise.
        Raises ConfigurationError if a power misses it by more than `ASKEW` between the approaches `FITTED`.
        """
        if other is self and radii[0] == radii[1]:
            return self
        c, n = np.array([(law.coefficient, law.exponent) for law in (self, other)]).T
        R = np.array(radii)
        depth = np.array(FITTED)[:, None] * sum(radii)
        hard = c * n / (2 * np.pi * R)
        ends = hard * depth ** (n - 1)
        p = np.geomspace(ends.min(), ends.max(), 400)[:, None]
        w = 0.5 * (p / hard) ** (1 / (n - 1))
        delta = w.sum(axis=1)
        force = 4 * np.pi * R.prod() / R.sum() * (p * w / n).sum(axis=1)
        x, y = np.log([delta, force])[:, (delta >= depth[0]) & (delta <= depth[1])]
        exponent, log = np.polyfit(x, y, 1)
        if (off := np.abs(np.expm1(exponent * x + log - y)).max()) > ASKEW:
            raise ConfigurationError(
                f"yarn_b.pressing_exponent is {n[1]:g} and that of yarn {n[0]:g}: the force of both on each other "
                f"would be {off:.0%} wrong, {ASKEW:.0%} are allowed; take exponents that differ less"
            )
        return replace(self, coefficient=float(np.exp(log)), exponent=float(exponent))

    def force(self, approach: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the force (k,) [N] at approaches (k,) [m] and its two derivatives; zero where open.

        Examples
        --------
        >>> force, stiffness, _ = Power(3.0, exponent=2.0).force(np.array([-0.1, 0.1]))
        >>> force.round(3).tolist(), stiffness.round(3).tolist()
        ([0.0, 0.03], [0.0, 0.6])
        """
        c, n = self.coefficient, self.exponent
        depth = np.where(approach > 0, approach, 1.0)
        values = c * depth**n, n * c * depth ** (n - 1.0), n * (n - 1.0) * c * depth ** (n - 2.0)
        force, first, second = (np.where(approach > 0, value, 0.0) for value in values)
        return force, first, second


class Law(Power):
    """A law that a scene can name; one that is no power of the approach has a `force` of its own."""

    name: ClassVar[str]  # value of the key `beam.section`, and one line on it
    meaning: ClassVar[str]
    label: ClassVar[str]  # in figures and tables
    look: ClassVar[tuple[str, str, str]]  # colour, dash and marker of its lines in figures

    @classmethod
    def of(cls, yarn: Any, beam: Any) -> Self:
        """Return the law of a scene with the sections `yarn` and `beam`."""
        raise NotImplementedError


LAWS: Registry[type[Law]] = Registry("beam.section")
"""Laws by the value of the key `beam.section`."""


RIGID = 10.0
"""Penalty of sections that do not deform, over E sqrt(R): twelve times Hertz's law, which has 0.8 to 0.9."""


@LAWS.register
class Rigid(Law):
    """Sections that do not deform: a penalty of `RIGID` E sqrt(R) approach^1.5."""

    name, meaning, label = "rigid", "a penalty", "rigid"
    look = ("#0072B2", "-", "v")

    @classmethod
    def of(cls, yarn: Any, beam: Any) -> Self:
        """Return the law of a scene with the sections `yarn` and `beam`."""
        return cls(RIGID * yarn.youngs_modulus * yarn.radius / yarn.radius**0.5, penalty=True)


# The local compliance of a cylinder (`local_compliance`) is that of a half space and a further compliance C, which
# hardly depends on the radius a of the patch. Two yarns approach by
#
#     delta = delta_H(P) + 2 C(a) P,   a^2 = R delta_H.
#
# C is negative: at an approach of 0.03 R the force is 17 % larger than between half spaces.

PATCHES = (0.2, 0.35, 0.5)  # semi-axes over R from which C(a) follows as a parabola
DEEPEST = 0.35  # delta_H over R up to which the law is tabulated
# Mean displacement of a half space under an even pressure, times E a / (1 - nu^2)
UNIFORM = 16 / (3 * np.pi**2)


@LAWS.register
@dataclass(frozen=True, eq=False, kw_only=True)
class CrossedCylinders(Law):
    """Force of two equal elastic cylinders: Hertz's law F = coefficient delta^1.5 times a tabulated factor."""

    name, meaning, label = "hertz", "the approach of two crossed cylinders", "Hertzian"
    look = ("#56B4E9", "--", "^")

    radius: float  # R [m]
    table: CubicSpline  # F over Hertz's, by sqrt(delta / R)

    PAIRED: ClassVar[tuple[str, ...]] = ("coefficient", "radius")

    @classmethod
    def of(cls, yarn: Any, beam: Any) -> Self:
        """Return the law of a scene with the sections `yarn` and `beam`."""
        return cls.elastic(yarn.youngs_modulus, yarn.poisson_ratio, yarn.radius)

    @classmethod
    def elastic(cls, youngs_modulus: float, poisson_ratio: float, radius: float) -> Self:
        """Return the law of cylinders of a modulus [Pa] and a radius [m]."""
        nu = poisson_ratio
        modulus = youngs_modulus / (2 * (1 - nu**2))
        return cls(
            coefficient=4 / 3 * modulus * np.sqrt(radius),
            share=2 * (1 - nu) / (2 - nu),  # Mindlin 1949, of a circle
            patch=Patch(nu),
            radius=radius,
            table=_finite_thickness(nu),
        )

    def against(self, other: Power, radii: tuple[float, float]) -> Power:
        """Return the law of two cylinders of one Poisson's ratio: their compliances count half."""
        between = 2 * radii[0] * radii[1] / sum(radii)
        soft = [R**0.5 / law.coefficient for law, R in zip((self, other), radii, strict=True)]
        return replace(self, coefficient=2 * between**0.5 / sum(soft), radius=between)

    def force(self, approach: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the force (k,) [N] at approaches (k,) [m] and its two derivatives; zero where open.

        With x = sqrt(delta / R) the force is k x^3 f(x); f is constant beyond its table.
        """
        x = np.sqrt(np.maximum(approach, 1e-300) / self.radius)
        k = self.coefficient * self.radius**1.5
        inside = np.minimum(x, self.table.x[-1])
        f, f1, f2 = (self.table(inside, order) for order in range(3))
        f1, f2 = np.where(inside < x, 0.0, f1), np.where(inside < x, 0.0, f2)
        by_x = k * (3 * x**2 * f + x**3 * f1)
        by_xx = k * (6 * x * f + 6 * x**2 * f1 + x**3 * f2)
        per = 1 / (2 * x * self.radius)  # dx / d delta
        values = k * x**3 * f, by_x * per, by_xx * per**2 - by_x * per**2 / x
        force, first, second = (np.where(approach > 0, value, 0.0) for value in values)
        return force, first, second


@cache
def _finite_thickness(poisson_ratio: float) -> CubicSpline:
    """Return F over Hertz's by sqrt(delta / R)."""
    from scipy.interpolate import CubicSpline

    from knitstudy.mechanics.core.cylinder import local_compliance

    nu = poisson_ratio
    C = [local_compliance(a, nu)[0] - UNIFORM * (1 - nu**2) / a for a in PATCHES]
    a = np.linspace(0.0, np.sqrt(DEEPEST), 200)  # over R
    P = 2 / 3 / (1 - nu**2) * a**3  # over E R^2
    x = np.sqrt(a**2 + 2 * np.polyval(np.polyfit(PATCHES, C, 2), a) * P)
    return CubicSpline(x, np.divide(a, x, out=np.ones_like(a), where=x > 0) ** 3)


@dataclass(frozen=True)
class Repulsion:
    """The potential of two short pieces, from the force of two yarns that cross."""

    law: Power
    diameter: float  # distance at which it begins, D [m]
    onset: float  # e [m]
    ratios: tuple[Floats, ...] = ()  # of pairs of different radii: both (k,) over their mean

    @property
    def own_diameter(self) -> Floats | float:
        """Diameter of the yarn of every point [m], or of all."""
        return self.diameter

    def between(self, pairs: PointPairs) -> Repulsion:
        """Return the repulsion of pairs, with one value a pair where yarns differ."""
        return self

    @property
    def patch(self) -> Patch:
        """Effect of the shape of a contact."""
        return self.law.patch

    def shear(self, tangents: Floats, bends: Floats, normal: Floats) -> Floats:
        """Return the stiffness (k, 3, 3) against elastic slip over that against approach; see `Patch.shear`."""
        share = 1.0 if self.patch.spreads else self.law.share
        return share * self.patch.shear(tangents, bends, normal, *self.ratios)

    def _depth(self, distance: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the approach (k,) at distances (k,) [m], which begins softly, and its two derivatives."""
        e = self.onset
        delta = np.maximum(self.diameter - distance, 1e-9 * e)
        x = delta / e
        soft = delta < e
        return (
            np.where(soft, e * (2 - x) * x**2, delta),
            -np.where(soft, (4 - 3 * x) * x, 1.0),
            np.where(soft, (4 - 6 * x) / e, 0.0),
        )

    def closing(self, y: Floats, shape: Floats) -> Floats:
        """Return F'' (k,) [N/m2] after an approach y (k,) [m] since first contact, its mean up to the onset."""
        f = shape if self.patch.spreads else np.ones_like(shape)
        late = np.maximum(y, self.onset)
        early = self.law.force(f**2 * self.onset)[1] / (f * self.onset)
        return np.where(y > self.onset, f * self.law.force(f**2 * late)[2], early)

    def of(self, distance: Floats, shape: Floats | float = 1.0) -> tuple[Floats, Floats, Floats]:
        """Return V (k,) [N/m] at distances (k,) [m] within reach, and its two derivatives."""
        (r,) = Expansion.variables(distance[:, None])
        V = self.potential(r, r * 0.0 + shape)
        assert V.bend is not None  # of variables with second derivatives
        return V.value, V.slope[:, 0], V.bend[:, 0, 0]

    def push(self, share: Floats, thinning: Floats, shape: Floats, distance: Floats) -> tuple[Floats, Floats]:
        """Return parts (k,) of the force of pairs [N], and their derivatives by the distance [N/m].

        Parts (k,) of the density and of its derivative by the distance are those of the last increment.
        """
        within = distance < self.diameter
        V, V1, V2 = self.of(distance, shape)
        force, change = share * V1 + thinning * V, share * V2 + thinning * V1
        return np.where(within, -force, 0.0), np.where(within, -change, 0.0)

    def potential(self, r: Expansion, shape: Expansion) -> Expansion:
        """Return V as a function of the variables of the distance and of the factor f by the shape.

        A contact of half spaces that carries f times the force F(delta) spreads as a circle does at f^2 delta: the
        compliance of a yarn beyond that of a half space counts as much. So F, without the factor itself, is
        F(f^2 delta) / f^3. Layers do not spread.
        """
        f = shape if self.patch.spreads else shape * 0.0 + 1.0
        x = f * f * r.through(*self._depth(r.value))
        F = x.through(*self.law.force(x.value))
        return (1 / (2 * np.pi)) * (F * f.power(-3.0) * r.power(-1.0))


@dataclass(frozen=True, eq=False)
class Mixed(Repulsion):
    """Repulsion of the points of several yarns; law, diameter and onset are of the first yarn, the thickest one."""

    kind: Ints = field(kw_only=True)  # (n,), which yarn a point is of
    laws: dict[str, Floats] = field(kw_only=True)  # values (m, m) of fields of the law, by both yarns
    thickness: Floats = field(kw_only=True)  # (m,), of the yarns, over the first one's

    @classmethod
    def of_yarns(cls, laws: Sequence[Power], diameters: Sequence[float], onset: float, kind: Ints) -> Mixed:
        """Return the repulsion of yarns with laws of their own; raises ConfigurationError as `Power.against`."""
        R = 0.5 * np.array(diameters)
        every = range(len(laws))
        rows = [[laws[a].against(laws[b], (R[a], R[b])) for b in every] for a in every]
        values = {
            key: np.array([[getattr(law, key) for law in row] for row in rows]) for key in laws[0].PAIRED
        }
        return cls(laws[0], diameters[0], onset, kind=kind, laws=values, thickness=R / R[0])

    @property
    def own_diameter(self) -> Floats:
        """Diameter of the yarn of every point (n,) [m]."""
        return self.diameter * self.thickness[self.kind]

    def between(self, pairs: PointPairs) -> Repulsion:
        """Return the repulsion of pairs, with one value a pair."""
        a, b = self.kind[pairs.i], self.kind[pairs.j]
        one, other = self.thickness[a], self.thickness[b]
        mean = 0.5 * (one + other)
        of_pairs: dict[str, Any] = {name: values[a, b] for name, values in self.laws.items()}
        ratios = () if np.ptp(self.thickness) == 0 else (one / mean, other / mean)
        law = replace(self.law, **of_pairs)
        D = self.diameter * mean
        e = self.onset / mean
        return Repulsion(law, D, e, ratios)  # type: ignore[arg-type]
