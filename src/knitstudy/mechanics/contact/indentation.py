"""The local indentation that a space of displacements cannot show, as a law of contact in series with that space.

Under a force P the two yarns approach by delta_H(P) + 2 C_far P: Hertz's indentation of two half spaces, and what
the yarns give way besides (`polynomial_yarn.patch`). In their space they approach by u(P) at the middle of the patch,
and by less beside it. What is left is the depth D(P) of the gap, a paraboloid whose curvatures A' and B' are those of
the cylinders less those of u:

    D = delta_H + 2 C_far P - 2 u_0 P,    A' = A - 2 k_x P,    B' = B - 2 k_y P

A pressure p(g) on it gives the force P = 2 pi R_e' F(D), F the integral of p, R_e' = 1 / (2 sqrt(A' B')). So
F(D(P)) = P / (2 pi R_e'(P)) is the energy of the law, and p = dF/dD. Nothing is fitted. Everything depends on the space
and on the angle between the axes, at which R_e = R / sin(angle).

Along the surface a patch that sticks gives way as Mindlin's does, (2 - nu) / (2 (1 - nu)) times as much. Stick is
remembered as a traction: a growing pressure adds stiffness, but no traction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.hertz import Crossing
from knitstudy.mechanics.polynomial_yarn.patch import far, patched_yarn

ANGLES = np.radians([15.0, 22.5, 30.0, 45.0, 60.0, 90.0])
"""Angles between the axes for which the law is computed; it is interpolated between, and below it is the first."""

SOFT = 1e-4
"""Depth over the radius below which the pressure begins smoothly; the law is that of a gap larger by as much."""

LOADS = 0.04 * 1.15 ** np.arange(26)
"""Larger semiaxes of Hertz's ellipses, over the radius, under whose forces the law is computed."""

WIDEST = 0.8
"""Largest extent across the yarn of the patch, over the radius."""

FLATTENED = 0.3
"""Smallest curvature that the space may leave of the gap's, over that of the cylinders."""

STIFFEST = 15.0
"""Largest slope of the pressure over E / R: where the space shows all, the law is a penalty as stiff."""

LEAST = 0.5
"""Smallest slope over pressure by depth, that of half spaces: with less the patch is no paraboloid any more."""

PIECES = 24

VANISHING = 1e-12


@dataclass(frozen=True, eq=False)
class Indentation:
    """Local indentation of crossing yarns, and Coulomb's friction.

    Attributes
    ----------
    modulus, elastic, radius : float
        E and E* = E / (2 (1 - nu^2)) [Pa], and R [m] of the yarns.
    stick : float
        Stiffness along the surface over that across it.
    friction : float
        mu; inf for rough contact, 0 for none.
    deepest : ndarray, shape (n,)
        Depth over R, at every angle of `ANGLES`, up to which F is tabulated; beyond it the pressure is linear.
    energy : ndarray, shape (4, PIECES, n)
        F / q^3 over E as cubics in q = sqrt(depth / R), in equal pieces.
    """

    modulus: float
    elastic: float
    radius: float
    stick: float
    friction: float
    deepest: np.ndarray
    energy: np.ndarray

    directional = True

    def attributes(self) -> dict[str, float]:
        """Return what the law has for numbers, by name: E*, and the depth of its tables at right angles."""
        return {
            "indentation_modulus": self.elastic,
            "indentation_deepest": float(self.radius * self.deepest[-1]),
            "stick_over_normal": self.stick,
        }

    def pressure(self, gap: np.ndarray, multiplier: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return the pressures (k,) [Pa] at gaps (k,) [m] between axes at angles (k,); there are no multipliers."""
        return self.modulus * self._derivatives(gap, angle)[1]

    def at(self, gap: np.ndarray, angle: np.ndarray) -> Coulomb:
        """Return the stiffnesses at gaps (k,) [m] and angles (k,), with the friction."""
        _, _, first, second = self._derivatives(gap, angle)
        # Where nothing touches the stiffness vanishes; it is divided by.
        normal = self.modulus / self.radius * np.maximum(first, VANISHING)
        slope = -self.stick * self.modulus / self.radius**2 * second
        return Coulomb(normal, self.stick * normal, self.friction, slope)

    def stored(self, gap: np.ndarray, pressure: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return the energies (k,) of the pressure [J/m2]."""
        return self.modulus * self.radius * self._derivatives(gap, angle)[0]

    def _derivatives(self, gap: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return F over E R and its three derivatives by the depth over R (4, k)."""
        depth = np.where(np.isfinite(gap), np.maximum(-gap / self.radius, 0.0), 0.0)
        # q = D / sqrt(D + SOFT) and its derivatives: with it the pressure begins as the square of the depth.
        root = (depth + SOFT) ** -0.5
        q = depth * root
        q1 = (0.5 * depth + SOFT) * root**3
        q2 = -(0.25 * depth + SOFT) * root**5
        q3 = -0.25 * root**5 + 2.5 * (0.25 * depth + SOFT) * root**7
        place = np.clip(np.interp(angle, ANGLES, np.arange(len(ANGLES))), 0, len(ANGLES) - 1.001)
        low = place.astype(int)
        share = place - low
        last = np.sqrt((1 - share) * self.deepest[low] + share * self.deepest[low + 1])
        x = np.minimum(q, last)
        piece = np.minimum((x / last * PIECES).astype(int), PIECES - 1)
        t = x / last * PIECES - piece
        a, b, c, d = (1 - share) * self.energy[:, piece, low] + share * self.energy[:, piece, low + 1]
        scale = PIECES / last
        g = ((a * t + b) * t + c) * t + d
        g1, g2, g3 = scale * ((3 * a * t + 2 * b) * t + c), scale**2 * (6 * a * t + 2 * b), scale**3 * 6 * a
        f = np.stack(
            [
                x**3 * g,
                3 * x**2 * g + x**3 * g1,
                6 * x * g + 6 * x**2 * g1 + x**3 * g2,
                6 * g + 18 * x * g1 + 9 * x**2 * g2 + x**3 * g3,
            ]
        )
        # Beyond what is tabulated F is a parabola of the depth.
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
            [
                f[0],
                f[1] * q1,
                f[2] * q1**2 + f[1] * q2,
                f[3] * q1**3 + 3 * f[2] * q1 * q2 + f[1] * q3,
            ]
        )


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
    """Return what yarns of a degree over the section and of spans (over the radius) do not show where they cross."""
    deepest, energy = np.empty(len(ANGLES)), np.empty((4, PIECES, len(ANGLES)))
    for number, angle in enumerate(ANGLES):
        root, values = _curve(float(angle), degree, span, spline_degree, poisson)
        deepest[number] = root[-1] ** 2
        # The smooth F / q^3, in equal pieces.
        even = np.linspace(0, root[-1], PIECES + 1)
        spline = CubicSpline(np.arange(PIECES + 1.0), CubicSpline(root, values)(even))
        energy[:, :, number] = spline.c
    stick = 2 * (1 - poisson) / (2 - poisson)
    return Indentation(modulus, 0.5 * modulus / (1 - poisson**2), radius, stick, friction, deepest, energy)


def _curve(
    angle: float, degree: int, span: float, spline_degree: int, poisson: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return q = sqrt(D / R) and F / (E q^3) for rising forces, from no force on."""
    hertz, yarn = Crossing.at(angle), patched_yarn(degree, span, spline_degree, poisson)
    elastic = 0.5 / (1 - poisson**2)  # E* over E
    beyond = far(poisson)
    start = elastic / hertz.approach**1.5 / (2 * np.pi * hertz.radius)
    depths, energies = [0.0], [0.0]
    for semiaxis in LOADS:
        force = elastic * (semiaxis / hertz.semiaxis) ** 3
        approach = hertz.approach * (force / elastic) ** (2 / 3) + 2 * beyond * force
        patch = semiaxis, semiaxis * hertz.ratio
        for _ in range(3):
            shown = yarn.shown(patch, 0.5 * angle)
            depth = approach - 2 * force * shown.middle
            curvature = np.array(hertz.curvature) - 2 * force * np.array(shown.fall)
            if depth <= depths[-1] or np.any(curvature < FLATTENED * np.array(hertz.curvature)):
                break
            patch = tuple(np.sqrt(depth / curvature))
            if max(patch[0] * np.sin(0.5 * angle), patch[1] * np.cos(0.5 * angle)) > WIDEST:
                break
        else:
            depths.append(depth)
            energies.append(force * np.sqrt(curvature.prod()) / np.pi)  # P / (2 pi R_e')
            if len(depths) < 4 or _goes_on(depths[-3:], energies[-3:]):
                continue
            depths.pop(), energies.pop()
        break
    root = np.sqrt(depths)
    return root, np.concatenate([[start], np.array(energies[1:]) / root[1:] ** 3])


def _goes_on(depth: list[float], energy: list[float]) -> bool:
    """Return whether the pressure at three depths rises as one on half spaces, or faster but not too fast."""
    pressure = np.diff(energy) / np.diff(depth)
    slope = 2 * (pressure[1] - pressure[0]) / (depth[2] - depth[0])
    return bool(LEAST * pressure.mean() / depth[1] < slope < STIFFEST)
