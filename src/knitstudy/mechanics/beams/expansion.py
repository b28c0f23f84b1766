"""Functions of few variables with their first and second derivatives, by the rules of differentiation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.core.arrays import Floats


@dataclass(frozen=True, eq=False)
class Expansion:
    """A function (k,) of v variables with its first derivatives, and its second ones where they are asked for."""

    value: Floats  # (k,)
    slope: Floats  # (k, v)
    bend: Floats | None  # (k, v, v)

    @classmethod
    def variables(cls, values: Floats, second: bool = True) -> list[Expansion]:
        """Return the variables (k, v) themselves."""
        k, v = values.shape
        zero = np.zeros((k, v, v)) if second else None
        return [cls(values[:, c], np.tile(np.eye(v)[c], (k, 1)), zero) for c in range(v)]

    @classmethod
    def over_roots(cls, values: Floats, top: int, below: list[int], second: bool) -> Expansion:
        """Return one of the variables (k, v) over the roots of others, which are positive."""
        per = 1 / np.sqrt(values[:, below].prod(axis=1))
        value = values[:, top] * per
        slope = np.zeros(values.shape)
        bend = None
        by = -0.5 / values[:, below]
        slope[:, top] = per
        slope[:, below] = value[:, None] * by
        if second:
            bend = np.zeros((*values.shape, values.shape[1]))
            for column, one in zip(below, by.T, strict=True):
                bend[:, top, column] = bend[:, column, top] = per * one
                bend[:, column, below] = slope[:, below] * one[:, None]
                bend[:, column, column] *= 3.0
        return cls(value, slope, bend)

    def through(self, value: Floats, first: Floats, second: Floats) -> Expansion:
        """Return an outer function of this one, from the outer value and derivatives (k,) by this one."""
        bend = None
        if self.bend is not None:
            bend = second[:, None, None] * self.slope[:, :, None] * self.slope[:, None, :]
            bend = bend + first[:, None, None] * self.bend
        return Expansion(value, first[:, None] * self.slope, bend)

    def of(self, inner: list[Expansion]) -> Expansion:
        """Return the composition with inner functions, one for every variable of this function."""
        J = np.stack([variable.slope for variable in inner], axis=1)  # (k, v, w)
        bend = None
        if self.bend is not None:
            bend = J.swapaxes(1, 2) @ self.bend @ J
            for slope, variable in zip(self.slope.T, inner, strict=True):
                if variable.bend is not None:
                    bend += slope[:, None, None] * variable.bend
        return Expansion(self.value, np.einsum("kv,kvw->kw", self.slope, J), bend)

    def power(self, exponent: float) -> Expansion:
        """Return a power of this function."""
        x = self.value
        n = exponent
        return self.through(x**n, n * x ** (n - 1), n * (n - 1) * x ** (n - 2))

    def at_least(self, least: float) -> Expansion:
        """Return a smooth lower bound y of this function x: (y - least) (y - x) = least^2."""
        x = self.value - least
        root = np.sqrt(x**2 + 4 * least**2)
        return self.through(least + 0.5 * (x + root), 0.5 * (1 + x / root), 2 * least**2 / root**3)

    def times(self, factor: Floats) -> Expansion:
        """Return this function times constants (k,)."""
        return self.through(self.value * factor, factor, np.zeros_like(factor))

    def __add__(self, other: Expansion | Floats | float) -> Expansion:
        if not isinstance(other, Expansion):
            return Expansion(self.value + other, self.slope, self.bend)
        bend = None if self.bend is None or other.bend is None else self.bend + other.bend
        return Expansion(self.value + other.value, self.slope + other.slope, bend)

    __radd__ = __add__

    def __mul__(self, other: Expansion | Floats | float) -> Expansion:
        if not isinstance(other, Expansion):
            return self.times(np.full(len(self.value), other))
        f = self.value[:, None]
        g = other.value[:, None]
        bend = None
        if self.bend is not None and other.bend is not None:
            cross = self.slope[:, :, None] * other.slope[:, None, :]
            bend = f[..., None] * other.bend + g[..., None] * self.bend + cross + cross.swapaxes(1, 2)
        return Expansion(self.value * other.value, f * other.slope + g * self.slope, bend)

    __rmul__ = __mul__
