"""Viscous forces against rigid motions of what nothing holds yet, as in Abaqus/Standard's static stabilisation.

F = c M (du/dt), with the lumped mass M of unit density, time the load factor, and c falling to zero at full load. The
work that they take is booked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Stabilisation:
    """Viscous forces on all unknowns.

    Attributes
    ----------
    coefficient : ndarray, shape (size,)
        c M at the start [N/m a unit of the load factor].
    """

    coefficient: np.ndarray

    @classmethod
    def of(cls, share: float, youngs_modulus: float, length: float, volume: np.ndarray) -> Stabilisation:
        """Return the forces with c = share E / h^2: h [m] the element size, volume (n,) of every node [m3]."""
        return cls(np.repeat(share * youngs_modulus / length**2 * volume, 3))

    def stiffness(self, load: float, change: float) -> np.ndarray:
        """Return the diagonal stiffness (size,) [N/m] within an increment of the load factor to `load`."""
        return self.coefficient * max(1.0 - load, 0.0) / change
