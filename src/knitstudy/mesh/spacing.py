"""Where the slices of a swept yarn stand: element size as a function of arc length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError

SpacingFunction = Callable[[np.ndarray], np.ndarray]
"""Wanted distance of slices in m at arc lengths s in m: (k,) -> (k,)."""

SAMPLES_PER_ELEMENT = 32


@dataclass(frozen=True)
class Spacing:
    """Spacing ``size`` near the crossings that grows smoothly to ``growth * size`` between them.

    Attributes
    ----------
    size : float
        Spacing within ``reach`` of a crossing, m.
    growth : float
        Spacing away from the crossings over ``size``, at least 1.
    stations : tuple of float
        Arc lengths of the crossings, m.
    period : float
        Arc length after which the stations repeat (one loop), m.
    reach, ramp : float
        The spacing is ``size`` up to the distance ``reach`` and ``growth * size`` beyond ``reach + ramp``, m.
    """

    size: float
    growth: float = 1.0
    stations: tuple[float, ...] = ()
    period: float = np.inf
    reach: float = 0.0
    ramp: float = 1.0

    def __post_init__(self):
        if not self.size > 0:
            raise MeshError(f"mesh size: {self.size} m is not allowed; it must be positive")
        if not self.growth >= 1:
            raise MeshError(f"mesh growth: {self.growth} is not allowed; it must be at least 1")

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """Spacing in m at arc lengths ``s`` (k,) in m."""
        s = np.asarray(s, dtype=float)
        if not self.stations:
            return np.full(s.shape, self.size * self.growth)
        offset = s[:, None] - np.asarray(self.stations)
        if np.isfinite(self.period):
            offset -= self.period * np.round(offset / self.period)
        distance = np.abs(offset).min(axis=1)
        t = np.clip((distance - self.reach) / self.ramp, 0.0, 1.0)
        return self.size * (1 + (self.growth - 1) * t**2 * (3 - 2 * t))


def place_slices(length: float, spacing: SpacingFunction, periods: int = 1) -> np.ndarray:
    """Arc lengths of the slices of one yarn, equidistributed with respect to ``spacing``.

    Between neighbours the integral of ds / spacing(s) is the same everywhere; the first and the last slice
    lie exactly on the ends.

    Parameters
    ----------
    length : float
        Arc length of the yarn, m.
    spacing : callable
        Wanted distance of neighbours in m at arc lengths in m.
    periods : int
        Number of equal parts of the yarn (its loops) that get the same number of elements.

    Returns
    -------
    ndarray (slices,)
        Increasing arc lengths from 0 to ``length``, m.

    Raises
    ------
    MeshError
        If the length or a spacing is not positive and finite.
    """
    if not (np.isfinite(length) and length > 0):
        raise MeshError(f"yarn length: {length} m is not allowed; it must be positive")
    coarse = _checked(spacing, np.linspace(0.0, length, 4097))
    s = np.linspace(0.0, length, 1 + SAMPLES_PER_ELEMENT * int(np.ceil(length / coarse.min())))
    density = 1.0 / _checked(spacing, s)
    count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])
    divisions = periods * max(1, round(count[-1] / periods))
    stations = np.interp(np.arange(divisions + 1) * (count[-1] / divisions), count, s)
    stations[[0, -1]] = 0.0, length
    return stations


def _checked(spacing: SpacingFunction, s: np.ndarray) -> np.ndarray:
    """Values of ``spacing`` at ``s``, refused where they are not positive and finite."""
    values = np.broadcast_to(np.asarray(spacing(s), dtype=float), s.shape)
    bad = ~(np.isfinite(values) & (values > 0))
    if bad.any():
        first = np.flatnonzero(bad)[0]
        raise MeshError(
            f"mesh spacing: {values[first]} m at s = {s[first]:.6g} m is not allowed; it must be positive"
        )
    return values
