"""The history of a loading, in one format for solids and beams (see docs/architecture.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from knitstudy.cost import Meter
from knitstudy.fem.increment import PHASES, Increment

FORMS = ("external", "internal", "hourglass", "penalty", "friction", "stabilisation")
"""Forms of energy in the ledger: external work = the sum of all others."""


@dataclass(frozen=True)
class Stations:
    """Points whose motion the history follows: section centres or beam nodes.

    Attributes
    ----------
    yarn : ndarray of int, shape (S,)
        Yarn of a station.
    arc_length : ndarray, shape (S,)
        Its arc length along the undeformed yarn [m].
    position : ndarray, shape (S, 3)
        Its undeformed position [m].
    """

    yarn: np.ndarray
    arc_length: np.ndarray
    position: np.ndarray


@dataclass
class Recorder:
    """Collects increments and keeps the ledger of energies.

    Attributes
    ----------
    stations : Stations
        Points to follow.
    driven : ndarray of int, shape (k, 3)
        Unknowns of the driven nodes by component (x, y, z).
    axis : int
        Load direction, 0 for course and 1 for wale.
    travel : float
        Displacement of the driven side at full load [m].
    length : float
        Length that strain refers to [m].
    meter : Meter
        Begun before the model was built, so that its memory counts.
    """

    stations: Stations
    driven: np.ndarray
    axis: int
    travel: float
    length: float
    columns: dict[str, list] = field(default_factory=dict)
    meter: Meter = field(default_factory=Meter)

    def add(self, increment: Increment, station_displacement: np.ndarray, **crossings: np.ndarray) -> None:
        """Append a converged increment.

        Parameters
        ----------
        increment : Increment
        station_displacement : ndarray, shape (S, 3)
            Displacement of the stations [m].
        **crossings : ndarray, shape (K, 3)
            `crossing_force` [N] and `crossing_displacement` [m], where the model has them.
        """
        reaction = np.array([increment.response.force[self.driven[:, i]].sum() for i in range(3)])
        displacement = increment.load * self.travel
        row = {
            "load": increment.load,
            "strain": displacement / self.length,
            "displacement": displacement,
            "force": reaction[self.axis],
            "reaction": reaction,
            "newton_iterations": increment.newton_iterations,
            "krylov_iterations": increment.krylov_iterations,
            "residual": increment.residual,
            "correction": increment.correction,
            "centreline_displacement": np.array(station_displacement),
            "energy": self._ledger(increment, displacement, reaction[self.axis]),
            "seconds": np.array([increment.timings.get(phase, 0.0) for phase in PHASES]),
            **crossings,
        }
        for name, value in row.items():
            self.columns.setdefault(name, []).append(value)

    def _ledger(self, increment: Increment, displacement: float, force: float) -> np.ndarray:
        ledger = np.array([increment.response.energy.get(form, 0.0) for form in FORMS])
        if self.columns:
            # Trapezoidal work of the reactions: independent of the potentials that it is held against.
            mean = 0.5 * (force + self.columns["force"][-1])
            ledger[0] = self.columns["energy"][-1][0] + mean * (
                displacement - self.columns["displacement"][-1]
            )
        return ledger

    def to_dataset(self, **attributes) -> xr.Dataset:
        """Return the history as a Dataset in the format of docs/architecture.md."""
        column = {name: np.array(values) for name, values in self.columns.items()}
        variables = {
            name: (dims, column[name], {"units": unit, "long_name": meaning})
            for name, (dims, unit, meaning) in _COLUMNS.items()
            if name in column
        }
        variables |= {
            "yarn": ("station", np.asarray(self.stations.yarn), {"units": "1", "long_name": "yarn"}),
            "arc_length": ("station", self.stations.arc_length, {"units": "m", "long_name": "arc length"}),
            "centreline": (
                ("station", "xyz"),
                self.stations.position,
                {"units": "m", "long_name": "undeformed centreline"},
            ),
        }
        coordinates = {"xyz": list("xyz"), "form": list(FORMS), "phase": list(PHASES)}
        cost = self.meter.read()
        attributes = {
            "wall_seconds": cost.seconds,
            "memory_growth": cost.memory_growth,
            "memory_peak": cost.memory_peak,
            "axis": self.axis,
            "gauge_length": self.length,
            **attributes,
        }
        return xr.Dataset(variables, coords=coordinates, attrs=attributes)


_COLUMNS = {
    "load": ("increment", "1", "load factor"),
    "strain": ("increment", "1", "applied strain"),
    "displacement": ("increment", "m", "displacement of the driven side"),
    "force": ("increment", "N", "reaction of the driven side along the load"),
    "reaction": (("increment", "xyz"), "N", "reaction of the driven side"),
    "energy": (("increment", "form"), "J", "ledger of energies"),
    "newton_iterations": ("increment", "1", "Newton iterations"),
    "krylov_iterations": ("increment", "1", "Krylov iterations"),
    "residual": ("increment", "1", "largest unbalanced force over mean internal force"),
    "correction": ("increment", "1", "largest last correction over element size"),
    "centreline_displacement": (("increment", "station", "xyz"), "m", "displacement of the centreline"),
    "crossing_force": (
        ("increment", "crossing", "xyz"),
        "N",
        "force of the interaction on the lower row's yarn",
    ),
    "crossing_displacement": (("increment", "crossing", "xyz"), "m", "mean displacement of the tied nodes"),
    "seconds": (("increment", "phase"), "s", "time by phase of the Newton iterations"),
}
