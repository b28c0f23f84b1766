"""Two equal cylinders that cross, pressed on each other as half spaces are: Hertz, with exact elliptic integrals.

Johnson, Contact Mechanics (1985), sections 4.1 and 4.2. The gap of the undeformed surfaces is A x^2 + B y^2 with
A = (1 - cos w) / (2 R) and B = (1 + cos w) / (2 R); x lies on the bisector of the angle w between the axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipk, elliprd

from knitstudy.mechanics.contact.compliance import far_compliance, patched_yarn
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.cylinder import ACROSS, ALONG


@dataclass(frozen=True)
class CylinderContact:
    """Contact of two cylinders of unit radius at an angle; lengths are over R, forces over E* R^2."""

    curvature: tuple[float, float]  # A and B
    ratio: float  # b / a of the ellipse of contact, whose longer axis lies on the bisector
    semiaxis: float  # a over P^(1/3)
    approach: float  # of far points of both bodies, over P^(2/3)

    @classmethod
    def at(cls, angle: float) -> CylinderContact:
        """Return the contact at an angle between the axes, 0 < angle <= pi / 2."""
        a = 0.5 * (1 - np.cos(angle))
        b = 0.5 * (1 + np.cos(angle))

        def excess(ratio: float) -> float:
            return elliprd(0, 1, ratio**2) / elliprd(0, ratio**2, 1) - b / a  # DLMF 19.25.1

        ratio = 1.0 if b / a - 1 < 1e-6 else float(brentq(excess, 1e-4, 1 - 1e-8))
        semiaxis = float(elliprd(0, ratio**2, 1) / (2 * np.pi * a)) ** (1 / 3)
        return cls((a, b), ratio, semiaxis, 3 * float(ellipk(1 - ratio**2)) / (2 * np.pi * semiaxis))

    @property
    def radius(self) -> float:
        """R_e = 1 / sin w, over R: a gap that is a paraboloid has the area 2 pi R_e delta at a depth delta."""
        return 0.5 / np.sqrt(self.curvature[0] * self.curvature[1])


# The local indentation that a space of displacements cannot show, as a law of contact in series with that space
# Under a force P two yarns approach by Hertz's delta_H(P) and by 2 C_far P, their other compliance
# (`compliance`). In their space they approach by u(P) at the middle of the patch. The rest is the depth D of
# a gap whose curvatures A' and B' are the curvatures of the cylinders less the curvatures of u:
#
#     D = delta_H + 2 C_far P - 2 u_0 P,    A' = A - 2 k_x P,    B' = B - 2 k_y P
#
# A pressure p(g) on it gives P = 2 pi R_e' F(D), F the integral of p, R_e' = 1 / (2 sqrt(A' B')). So p = dF/dD with
# F(D(P)) = P / (2 pi R_e'(P)): nothing is fitted. Along the surface a patch that sticks gives way by Mindlin's share
# m = (2 - nu) / (2 (1 - nu)) of d delta_H / dP, and by C_far along and across; the part of it that the
# space does not show is the compliance 1 / K of the law, and its stiffness is spread as the pressure is:
#
#     1 / K = m d delta_H / dP + sum (C_far - C_shown),    t = d/dD (K / (2 pi R_e'))
#
# t is tabulated as its share of dp/dD, 1 / m where the patch is small. A growing pressure adds stiffness, no traction.

# Angles between the axes for which the law is computed; it is interpolated between, and below it is the first.
ANGLES = np.radians([15.0, 22.5, 30.0, 45.0, 60.0, 90.0])
# Depth over the radius below which the pressure begins smoothly; the law is that of a gap larger by as much.
SOFT = 1e-4
# Larger semiaxes of Hertz's ellipses, over the radius, under whose forces the law is computed.
LOADS = 0.04 * 1.15 ** np.arange(26)
WIDEST = 0.8  # largest extent across the yarn of the patch, over the radius
FLATTENED = 0.3  # smallest curvature that the space may leave of the gap's, over that of the cylinders
# Largest slope of the pressure over E / R: where the space shows all, the law is a penalty as stiff.
STIFFEST = 15.0
# Smallest slope over pressure by depth, that of half spaces: with less the patch is no paraboloid any more.
LEAST = 0.5
REMAINDER = 0.1  # smallest compliance along the surface that a patch is left with, over that of half spaces
STEEPEST = 2.0  # largest power of the depth with which that stiffness rises; a half of half spaces
PIECES = 24
VANISHING = 1e-12


@dataclass(frozen=True, eq=False)
class Indentation:
    """Local indentation of crossing yarns, and Coulomb's friction."""

    modulus: float  # E of the yarns [Pa]
    elastic: float  # E* = E / (2 (1 - nu^2)) [Pa]
    radius: float  # R of the yarns [m]
    friction: float  # mu; inf for rough contact, 0 for none
    deepest: Floats  # (n,), depth over R, at every angle of `ANGLES`, beyond which the pressure is linear
    energy: Floats  # (4, PIECES, n) F / q^3 over E as cubics in q = sqrt(depth / R), in equal pieces
    stick: Floats  # (4, PIECES, n), stiffness along the surface over that across it, in the same pieces

    directional = True
    numerical = False

    def attributes(self) -> dict[str, float]:
        """Return the constants of the law by name: E*; at right angles the depth of its tables, and 1 / m."""
        return {
            "indentation_modulus": self.elastic,
            "indentation_deepest": self.end,
            "stick_over_normal": float(self.stick[-1, 0, -1]),
        }

    @property
    def end(self) -> float:
        """Depth [m] up to which the law is computed, of axes at right angles."""
        return float(self.radius * self.deepest[-1])

    def pressure(self, gap: Floats, multiplier: Floats, angle: Floats | None) -> Floats:
        """Return the pressures (k,) [Pa] at gaps (k,) [m] between axes at angles (k,); there are no multipliers."""
        return self.modulus * self._derivatives(gap, angle)[1]

    def at(self, gap: Floats, angle: Floats | None) -> Coulomb:
        """Return the stiffnesses at gaps (k,) [m] and angles (k,), with the friction."""
        _, _, first, second = self._derivatives(gap, angle)
        stick, change = self._stick(gap, angle)
        # Where nothing touches the stiffness vanishes; it is divided by.
        normal = self.modulus / self.radius * np.maximum(first, VANISHING)
        slope = -self.modulus / self.radius**2 * (stick * second + change * first)
        return Coulomb(normal, stick * normal, self.friction, slope)

    def stored(self, gap: Floats, pressure: Floats, angle: Floats | None) -> Floats:
        """Return the energies (k,) of the pressure [J/m2]."""
        return self.modulus * self.radius * self._derivatives(gap, angle)[0]

    def _stick(self, gap: Floats, angle: Floats | None) -> tuple[Floats, Floats]:
        """Return the share of the stiffness along the surface (k,), and its derivative by the depth over R (k,)."""
        q, slope, *_ = self._root(gap)
        at = self._piece(q, angle)
        value, first, *_ = at.of(self.stick)
        return value, np.where(q > at.last, 0.0, first * slope)

    def _root(self, gap: Floats) -> tuple[np.ndarray, ...]:
        """Return q and its three derivatives by the depth over R: with it the pressure begins as its square."""
        depth = np.where(np.isfinite(gap), np.maximum(-gap / self.radius, 0.0), 0.0)
        root = (depth + SOFT) ** -0.5
        return (
            depth * root,
            (0.5 * depth + SOFT) * root**3,
            -(0.25 * depth + SOFT) * root**5,
            -0.25 * root**5 + 2.5 * (0.25 * depth + SOFT) * root**7,
        )

    def _piece(self, q: Floats, angle: Floats | None) -> _Piece:
        """Return where q (k,) lies in the tables of angles (k,)."""
        assert angle is not None, "the law of indentation depends on the angle between the yarns"
        place = np.clip(np.interp(angle, ANGLES, np.arange(len(ANGLES))), 0, len(ANGLES) - 1.001)
        low = place.astype(int)
        share = place - low
        last = np.sqrt((1 - share) * self.deepest[low] + share * self.deepest[low + 1])
        x = np.minimum(q, last)
        number = np.minimum((x / last * PIECES).astype(int), PIECES - 1)
        return _Piece(x, last, low, share, number, x / last * PIECES - number)

    def _derivatives(self, gap: Floats, angle: Floats | None) -> Floats:
        """Return F over E R and its three derivatives by the depth over R (4, k)."""
        q, q1, q2, q3 = self._root(gap)
        at = self._piece(q, angle)
        x, last = at.x, at.last
        g, g1, g2, g3 = at.of(self.energy)
        f = np.stack(
            [
                x**3 * g,
                3 * x**2 * g + x**3 * g1,
                6 * x * g + 6 * x**2 * g1 + x**3 * g2,
                6 * g + 18 * x * g1 + 9 * x**2 * g2 + x**3 * g3,
            ]
        )
        # Beyond the table F is a parabola of the depth.
        pressure = f[1] / (2 * last)
        slope = np.maximum((f[2] - 2 * pressure) / (4 * last**2), LEAST * pressure / last**2)
        more = q**2 - last**2
        beyond = np.stack(
            [
                f[0] + pressure * more + 0.5 * slope * more**2,
                2 * q * (pressure + slope * more),
                2 * (pressure + slope * more) + 4 * q**2 * slope,
                12 * q * slope,
            ]
        )
        f = np.where(q > last, beyond, f)
        return np.stack(
            [f[0], f[1] * q1, f[2] * q1**2 + f[1] * q2, f[3] * q1**3 + 3 * f[2] * q1 * q2 + f[1] * q3]
        )


@dataclass(frozen=True, eq=False)
class _Piece:
    """Places x (k,) in tables that end at `last`: angle, piece, and how far in both."""

    x: Floats
    last: Floats
    low: Ints
    share: Floats
    number: Ints
    t: Floats

    def of(self, table: Floats) -> tuple[np.ndarray, ...]:
        """Return the value of a table there (k,), and its three derivatives by q."""
        low, share, t = self.low, self.share, self.t
        a, b, c, d = (1 - share) * table[:, self.number, low] + share * table[:, self.number, low + 1]
        scale = PIECES / self.last
        return (
            ((a * t + b) * t + c) * t + d,
            scale * ((3 * a * t + 2 * b) * t + c),
            scale**2 * (6 * a * t + 2 * b),
            scale**3 * 6 * a,
        )


@lru_cache
def indentation(
    degree: int,
    span: float,
    spline_degree: int,
    *,
    modulus: float,
    poisson: float,
    radius: float,
    friction: float,
) -> Indentation:
    """Return the law of indentation missing in yarns of a degree over the section and spans (over the radius)."""
    deepest = np.empty(len(ANGLES))
    energy, stick = np.empty((2, 4, PIECES, len(ANGLES)))
    for number, angle in enumerate(ANGLES):
        root, values, sticking = _curve(float(angle), degree, span, spline_degree, poisson)
        deepest[number] = root[-1] ** 2
        # The smooth F / q^3, in equal pieces.
        even = np.linspace(0, root[-1], PIECES + 1)
        for table, curve in ((energy, values), (stick, sticking)):
            table[:, :, number] = CubicSpline(np.arange(PIECES + 1.0), CubicSpline(root, curve)(even)).c
    elastic = 0.5 * modulus / (1 - poisson**2)
    return Indentation(modulus, elastic, radius, friction, deepest, energy, stick)


def _curve(
    angle: float, degree: int, span: float, spline_degree: int, poisson: float
) -> tuple[Floats, Floats, Floats]:
    """Return q = sqrt(D / R), F / (E q^3) and the share of sticking t / (dp/dD) for rising forces, from no force on."""
    hertz = CylinderContact.at(angle)
    yarn = patched_yarn(degree, span, spline_degree, poisson)
    elastic = 0.5 / (1 - poisson**2)  # E* over E
    mindlin = 0.5 * (2 - poisson) / (1 - poisson)
    beyond = far_compliance(poisson)
    aside = far_compliance(poisson, ALONG) + far_compliance(poisson, ACROSS)
    start = elastic / hertz.approach**1.5 / (2 * np.pi * hertz.radius)
    depths, energies, sticks = [0.0], [0.0], [0.0]
    for semiaxis in LOADS:
        force = elastic * (semiaxis / hertz.semiaxis) ** 3
        indented = hertz.approach * (force / elastic) ** (2 / 3)
        approach = indented + 2 * beyond * force
        patch = semiaxis, semiaxis * hertz.ratio
        for _ in range(3):
            response = yarn.response(patch, 0.5 * angle)
            depth = approach - 2 * force * response.middle
            curvature = np.array(hertz.curvature) - 2 * force * np.array(response.fall)
            if depth <= depths[-1] or np.any(curvature < FLATTENED * np.array(hertz.curvature)):
                break
            patch = tuple(np.sqrt(depth / curvature))
            if max(patch[0] * np.sin(0.5 * angle), patch[1] * np.cos(0.5 * angle)) > WIDEST:
                break
        else:
            area = np.sqrt(curvature.prod()) / np.pi  # 1 / (2 pi R_e')
            slid = sum(yarn.response(patch, 0.5 * angle, way).mean for way in (ALONG, ACROSS))
            local = mindlin * indented / (1.5 * force)
            missing = max(local + aside - slid, REMAINDER * local)
            depths.append(depth)
            energies.append(force * area)
            sticks.append(area / missing)
            if len(depths) < 4 or _goes_on(depths[-3:], energies[-3:]):
                continue
            depths.pop(), energies.pop(), sticks.pop()
        break
    q = np.sqrt(depths)
    energy = np.concatenate([[start], np.array(energies[1:]) / q[1:] ** 3])
    stick = np.concatenate([[1.5 * start / mindlin], np.array(sticks[1:]) / q[1:]])
    # A cubic may bend down in its last piece: a pressure that falls with the depth holds nothing.
    while len(q) > 4 and _power(q, energy)[-1] < LEAST:
        q, energy, stick = q[:-1], energy[:-1], stick[:-1]
    return q, energy, _share(q, energy, stick)


def _power(q: Floats, energy: Floats) -> Floats:
    """Return the power of the depth with which the pressure rises at every depth q^2: d ln p / d ln D."""
    g = CubicSpline(q, energy)
    return 0.5 * (3 * g(q) + 5 * q * g(q, 1) + q**2 * g(q, 2)) / (3 * g(q) + q * g(q, 1))


def _share(q: Floats, energy: Floats, stick: Floats) -> Floats:
    """Return t / (dp/dD), where F = q^3 `energy` and K / (2 pi R_e') = q `stick`, both smooth in q = sqrt(D).

    Both rise with the depth at least as fast as for half spaces; K rises at most with the power `STEEPEST`.
    """
    g, h = CubicSpline(q, energy), CubicSpline(q, stick)
    slope = 3 * g(q) + q * g(q, 1)  # 2 p / q
    normal = np.maximum(_power(q, energy), LEAST)
    along = np.clip(0.5 * (1 + q * h(q, 1) / h(q)), LEAST, STEEPEST)
    return along / normal * 2 * h(q) / slope


def _goes_on(depth: list[float], energy: list[float]) -> bool:
    """Return whether the pressure at three depths rises as one on half spaces, or faster but not too fast."""
    pressure = np.diff(energy) / np.diff(depth)
    slope = 2 * (pressure[1] - pressure[0]) / (depth[2] - depth[0])
    return bool(LEAST * pressure.mean() / depth[1] < slope < STIFFEST)
