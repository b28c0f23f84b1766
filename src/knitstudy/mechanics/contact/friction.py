"""The law of contact points: a penalty in normal direction, Coulomb friction along the surface.

Pressure is p = -(multiplier + eps g) where that is positive; the tangential traction is epsT times the slip s since
the point last stuck, and at most mu p. With mu = inf nothing ever slips: rough contact. With mu = 0 there is no
friction. Signs: a traction t acts with +t on the internal force of the point's own side, as its gap does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OPEN, STICK, SLIP = 0, 1, 2
"""Status of a contact point."""


@dataclass(frozen=True)
class Coulomb:
    """Stiffnesses of contact and friction coefficient.

    Attributes
    ----------
    normal : float or ndarray, shape (k,)
        eps, pressure over gap [Pa/m].
    tangential : float or ndarray, shape (k,)
        epsT, tangential traction over elastic slip [Pa/m].
    friction : float
        mu; inf for rough contact, 0 for none.
    slope : float or ndarray, shape (k,)
        Derivative of epsT by the gap [Pa/m2].
    """

    normal: float | np.ndarray
    tangential: float | np.ndarray
    friction: float
    slope: float | np.ndarray = 0.0

    directional = False

    def pressure(
        self, gap: np.ndarray, multiplier: np.ndarray, angle: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the pressures (k,) [Pa] at gaps (k,) [m] with multipliers (k,) [Pa]; zero where open."""
        return np.maximum(0.0, -(multiplier + self.normal * gap))

    def stored(self, gap: np.ndarray, pressure: np.ndarray, angle: np.ndarray | None = None) -> np.ndarray:
        """Return the energies (k,) of the pressure at gaps (k,) [J/m2]."""
        return 0.5 * pressure * np.abs(gap)

    def at(self, gap: np.ndarray, angle: np.ndarray | None = None) -> Coulomb:
        """Return the stiffnesses at gaps (k,) [m]: always the same here."""
        return self

    def attributes(self) -> dict[str, float]:
        """Return what the law has for numbers, by name."""
        return {"contact_stiffness": self.normal, "stick_stiffness": self.tangential}

    def of(self, chosen: np.ndarray) -> Coulomb:
        """Return the law of some points."""
        values = (self.normal, self.tangential, self.slope)
        normal, tangential, slope = (v[chosen] if isinstance(v, np.ndarray) else v for v in values)
        return Coulomb(normal, tangential, self.friction, slope)

    def traction(self, trial: np.ndarray, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return tractions (k, 3) [Pa] and status (k,) from trial tractions epsT s (k, 3) and pressures (k,)."""
        size = np.linalg.norm(trial, axis=1)
        limit = self._limit(pressure)
        slips = (size > limit) | (self.friction == 0)
        share = np.where(slips, limit / np.where(size > 0, size, 1.0), 1.0)
        status = np.where(pressure > 0, np.where(slips, SLIP, STICK), OPEN)
        return np.where(pressure > 0, share, 0.0)[:, None] * trial, status

    def slipped(self, trial: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """Return the lengths (k,) [m] that points slip, from trial tractions (k, 3) and pressures (k,) [Pa]."""
        excess = np.linalg.norm(trial, axis=1) - self._limit(pressure)
        return np.where(pressure > 0, np.maximum(0.0, excess), 0.0) / self.tangential

    def tangent(
        self,
        trial: np.ndarray,
        trial_change: np.ndarray,
        gap_change: np.ndarray,
        pressure: np.ndarray,
        status: np.ndarray,
    ) -> np.ndarray:
        """Return the derivative (k, 3, 9) of the tractions.

        Parameters
        ----------
        trial : ndarray, shape (k, 3)
            Trial tractions [Pa].
        trial_change : ndarray, shape (k, 3, 9)
            Their derivative.
        gap_change : ndarray, shape (k, 9)
            Derivative of the gap.
        pressure : ndarray, shape (k,)
        status : ndarray of int, shape (k,)
        """
        change = trial_change.copy()
        slips = status == SLIP
        size = np.linalg.norm(trial[slips], axis=1)[:, None]
        size[size == 0] = 1.0
        along = trial[slips] / size
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        limit = self._limit(pressure[slips])[:, None, None]
        change[slips] = (limit / size[..., None]) * (across @ trial_change[slips])
        stiffness = self.friction * np.broadcast_to(self.normal, slips.shape)[slips]
        change[slips] -= stiffness[:, None, None] * along[:, :, None] * gap_change[slips][:, None, :]
        return change

    def symmetric_stiffness(
        self, trial: np.ndarray, normal: np.ndarray, pressure: np.ndarray, status: np.ndarray
    ) -> np.ndarray:
        """Return the symmetric positive part (k, 3, 3) of the law's stiffness [Pa/m].

        It leaves out what a rotation of the surface and the coupling of friction to the pressure do.
        """
        along_normal = normal[:, :, None] * normal[:, None, :]
        plane = np.eye(3) - along_normal
        size = np.linalg.norm(trial, axis=1)
        slips = status == SLIP
        size[size == 0] = 1.0
        share = np.where(slips, self._limit(pressure) / size, 1.0)
        direction = np.where(slips[:, None], trial / size[:, None], 0.0)
        plane -= direction[:, :, None] * direction[:, None, :]
        stiffness = np.broadcast_to(self.normal, share.shape)[:, None, None]
        return stiffness * along_normal + (self.tangential * share)[:, None, None] * plane

    def _limit(self, pressure: np.ndarray) -> np.ndarray:
        if np.isinf(self.friction):
            return np.full_like(pressure, np.inf)
        return self.friction * pressure
