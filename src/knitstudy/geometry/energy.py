"""Cost function of the yarn geometry, Eqs. (1) to (6) of the paper, with exact gradients.

Lengths are in units of the yarn radius R here, so that the terms carry no unit and their weights mean the
same in every unit of length. A term is a function from the control points of one loop to its value and
gradient.

Where the paper leaves a choice:

- F_Distance (Eq. 2) has one term for every crossing of the cell, aims at D = 2 + c0 and takes
  the true minimum D.
- L_l^0 (Eq. 6) is the arc length of Bezier curve l at the start. The printed one is its chord, which would
  shrink the yarn however well it fits.
- theta (Eq. 5) is the angle between the chords of the control polygon, pi where it is straight: the angle
  between tangents would be pi everywhere on a C1 curve. tau and rho follow from K_join being C1 at
  theta = pi/4.
- sigma (Eq. 5) is the mean of the two chords at the start, constant as the rest length of Breen et al.
  (1994) is.
"""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from knitstudy.geometry.crossing import closest_approach
from knitstudy.geometry.spline import GAUSS_POINTS, GAUSS_WEIGHTS, CatmullRom

CURVATURE_POINTS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
"""Two-point Gauss rule: exact for the square of C'', which is linear on a segment."""


@dataclass(frozen=True)
class Weights:
    """Weights of Eq. (1), and beta_0 of Eq. (3)."""

    alpha: float
    beta: float
    gamma: float
    beta_0: float


class CostFunction:
    """F of Eq. (1) for one loop of a periodic knit, in units of the radius.

    Parameters
    ----------
    loop : Loop
        The loop at the start, in radii; it gives the rest lengths and sigma, and the distance 2 + c0 of the
        centrelines that F_Distance aims at.
    weights : Weights
    window : ndarray (4, 2, 2)
        Where on the two yarns each crossing is looked for, see `crossing.windows`.
    samples : int
        Samples a Bezier segment in the search of the closest points.
    """

    def __init__(self, loop, weights, window, samples):
        start = loop.curve
        self.advance = start.advance
        self.course_spacing = loop.course_spacing
        self.target = loop.target
        self.weights = weights
        self.window = window
        self.samples = samples
        self.rest_length = start.segment_lengths()
        segments = np.arange(start.period)[:, None]
        self._tangent, self._tangent_offset = start.operator((segments + GAUSS_POINTS).ravel(), 1)
        self._bend, self._bend_offset = start.operator((segments + CURVATURE_POINTS).ravel(), 2)
        chord = np.linalg.norm(_chords(loop.control_points, self.advance), axis=1)
        self.sigma = 0.5 * (chord + np.roll(chord, 1))

    def softened(self, share):
        """The same cost function with a share of alpha."""
        soft = copy(self)
        soft.weights = replace(self.weights, alpha=share * self.weights.alpha)
        return soft

    def value(self, points):
        """F and its gradient: (P, 3) -> float, (P, 3)."""
        w = self.weights
        distance, d_distance = self.distance(points)
        continuous, d_continuous = self.continuous(points)
        join, d_join = self.join(points)
        length, d_length = self.length(points)
        value = (
            w.alpha * distance + w.beta * (continuous + w.beta_0 * join) + w.gamma * length
        )  # Eqs. (1), (3)
        gradient = w.alpha * d_distance + w.beta * (d_continuous + w.beta_0 * d_join) + w.gamma * d_length
        return value, gradient

    def terms(self, points):
        """Each term of F without its weight, and F: (P, 3) -> dict of floats."""
        continuous, join = self.continuous(points)[0], self.join(points)[0]
        return {
            "distance": self.distance(points)[0],
            "continuous": continuous,
            "join": join,
            "bending": continuous + self.weights.beta_0 * join,
            "length": self.length(points)[0],
            "total": self.value(points)[0],
        }

    def approach(self, points):
        """Closest approach of the yarns at the four crossings: (P, 3) -> Approach."""
        curve = CatmullRom(points, self.advance)
        return closest_approach(curve, self.course_spacing, self.window, self.samples)

    def distance(self, points):
        """F_Distance, Eq. (2), summed over the crossings, and its gradient."""
        found = self.approach(points)
        error = found.distance - self.target
        return error @ error, np.einsum("k,kpi->pi", 2 * error, self.distance_slope(points, found))

    def distance_slope(self, points, found):
        """Gradient of the shortest distance at each crossing: (P, 3), Approach -> (4, P, 3).

        The closest points move along the curves when the control points move, but to first order that does
        not change the shortest distance: only the motion of the curves at fixed parameters does.
        """
        normal = (found.point[:, 1] - found.point[:, 0]) / found.distance[:, None]
        curve = CatmullRom(points, self.advance)
        on_lower, _ = curve.operator(found.parameter[:, 0])
        on_upper, _ = curve.operator(found.parameter[:, 1])
        return (on_upper - on_lower)[:, :, None] * normal[:, None]

    def continuous(self, points):
        """F_cont, Eq. (4), with t the parameter of each Bezier segment, and its gradient."""
        second = self._bend @ points + self._bend_offset
        share = 1 / len(CURVATURE_POINTS)
        return share * (second**2).sum(), 2 * share * self._bend.T @ second

    def join(self, points):
        """Sum of K_join^2, Eq. (5), over the control points of a loop, and its gradient."""
        chord = _chords(points, self.advance)
        size = np.linalg.norm(chord, axis=1, keepdims=True)
        after = chord / size
        before = np.roll(after, 1, axis=0)
        square, slope = squared_join_curvature((before * after).sum(axis=1), self.sigma)
        d_unit = slope[:, None] * before + np.roll(slope[:, None], -1, axis=0) * np.roll(after, -1, axis=0)
        d_chord = (d_unit - after * (d_unit * after).sum(axis=1, keepdims=True)) / size
        return square.sum(), np.roll(d_chord, 1, axis=0) - d_chord

    def length(self, points):
        """F_Length, Eq. (6), with arc lengths, and its gradient."""
        tangent = (self._tangent @ points + self._tangent_offset).reshape(len(points), -1, 3)
        speed = np.linalg.norm(tangent, axis=-1)
        error = self.rest_length - speed @ GAUSS_WEIGHTS
        slope = -2 * error[:, None, None] * GAUSS_WEIGHTS[:, None] * tangent / speed[..., None]
        return error @ error, self._tangent.T @ slope.reshape(-1, 3)


def squared_join_curvature(cosine, sigma):
    """K_join^2 of Eq. (5), and its derivative with respect to the cosine.

    Parameters
    ----------
    cosine : ndarray (P,)
        Cosine of the angle by which the control polygon turns: -cos(theta).
    sigma : ndarray (P,)
        Local spacing of the control points.

    Returns
    -------
    square, derivative : ndarray (P,)
    """
    # theta > pi/4: (2/sigma)^2 cos^2(theta/2) = (2/sigma^2)(1 + cos(theta)), smooth where it is straight too.
    square, derivative = 2 * (1 - cosine) / sigma**2, -2 / sigma**2
    sharp = cosine < -np.cos(np.pi / 4)
    if sharp.any():
        s = sigma[sharp]
        theta = np.arccos(np.clip(-cosine[sharp], -1, 1 - 1e-12))  # a folded polygon costs much, not infinity
        tau, rho = 2 / s * np.cos(np.pi / 8), -np.sin(np.pi / 8) / s
        k_join = -((np.pi / 4) ** 2) * rho / theta + tau + np.pi / 4 * rho
        square[sharp] = k_join**2
        derivative[sharp] = 2 * k_join * (np.pi / 4) ** 2 * rho / theta**2 / np.sin(theta)
    return square, derivative


def _chords(points, advance):
    """Edges P_k+1 - P_k of the control polygon: (P, 3)."""
    return np.vstack([points[1:], points[0] + advance]) - points
