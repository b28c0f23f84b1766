"""Centrelines with closed forms, by arc length."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Straight:
    length: float
    start: tuple = (0.0, 0.0, 0.0)
    along: tuple = (1.0, 0.0, 0.0)

    def position(self, s):
        return self.start + np.multiply.outer(s, self.along)

    def tangent(self, s):
        return np.tile(self.along, (len(s), 1))


@dataclass
class Helix:
    radius: float
    rise: float  # along the axis, a radian
    turns: float

    @property
    def pace(self):
        return np.hypot(self.radius, self.rise)

    @property
    def length(self):
        return 2 * np.pi * self.turns * self.pace

    def position(self, s):
        t = s / self.pace
        return np.stack([self.radius * np.cos(t), self.radius * np.sin(t), self.rise * t], axis=-1)

    def tangent(self, s):
        t = s / self.pace
        return (
            np.stack([-self.radius * np.sin(t), self.radius * np.cos(t), 0 * t + self.rise], axis=-1)
            / self.pace
        )


class Arc:
    """Circular arc in the x-z plane through the origin, from a centre above it."""

    def __init__(self, radius, angle, y=0.0):
        self.radius, self.length, self.y = radius, radius * angle, y

    def position(self, s):
        t = s / self.radius
        return np.stack([self.radius * np.sin(t), self.y + 0 * t, self.radius * (1 - np.cos(t))], axis=-1)

    def tangent(self, s):
        t = s / self.radius
        return np.stack([np.cos(t), 0 * t, np.sin(t)], axis=-1)

    def curvature(self, s):
        return np.full(s.shape, 1 / self.radius)
