"""The history of a loading, in one format for solids and beams (see docs/architecture.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from knitstudy.cost import Meter
from knitstudy.crossings.record import COLUMNS as CONTACT_COLUMNS
from knitstudy.mechanics.increment import PHASES, Increment

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
        Load direction, 0 for course and 1 for wale; 2 for a pair of yarns pressed together.
    travel : callable
        Displacement (3,) of the driven side at a load factor [m].
    length : float
        Length that strain refers to [m].
    meter : Meter
        Begun before the model was built, so that its memory counts.
    columns : dict of str to list
        One value an increment.
    flat : dict of str to list
        One array an increment, of as many rows as points were in contact.
    """

    stations: Stations
    driven: np.ndarray
    axis: int
    travel: Callable[[float], np.ndarray]
    length: float
    columns: dict[str, list] = field(default_factory=dict)
    flat: dict[str, list[np.ndarray]] = field(default_factory=dict)
    meter: Meter = field(default_factory=Meter)

    def add(
        self,
        increment: Increment,
        station_displacement: np.ndarray,
        points: dict[str, np.ndarray] | None = None,
        **columns: np.ndarray,
    ) -> None:
        """Append a converged increment.

        Parameters
        ----------
        increment : Increment
        station_displacement : ndarray, shape (S, 3)
            Displacement of the stations [m].
        points : dict of str to ndarray, optional
            Columns of the points in contact; see `knitstudy.crossings.record`.
        **columns : ndarray
            What else the model has, by the names of the format.
        """
        reaction = np.array([increment.response.force[self.driven[:, i]].sum() for i in range(3)])
        displacement = self.travel(increment.load)
        row = {
            "load": increment.load,
            "strain": displacement[self.axis] / self.length,
            "displacement": displacement[self.axis],
            "driven_displacement": displacement,
            "force": reaction[self.axis],
            "reaction": reaction,
            "newton_iterations": increment.newton_iterations,
            "krylov_iterations": increment.krylov_iterations,
            "residual": increment.residual,
            "correction": increment.correction,
            "centreline_displacement": np.array(station_displacement),
            "energy": self._ledger(increment, displacement, reaction),
            "seconds": np.array([increment.timings.get(phase, 0.0) for phase in PHASES]),
            **columns,
        }
        for name, value in row.items():
            self.columns.setdefault(name, []).append(value)
        for name, values in (points or {}).items():
            self.flat.setdefault(name, []).append(values)

    def _ledger(self, increment: Increment, displacement: np.ndarray, reaction: np.ndarray) -> np.ndarray:
        ledger = np.array([increment.response.energy.get(form, 0.0) for form in FORMS])
        if self.columns:
            # Trapezoidal work of the reactions: independent of the potentials that it is held against.
            mean = 0.5 * (reaction + self.columns["reaction"][-1])
            moved = displacement - self.columns["driven_displacement"][-1]
            ledger[0] = self.columns["energy"][-1][0] + mean @ moved
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
        variables |= self._points()
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

    def _points(self) -> dict[str, tuple]:
        """Return the variables of all points in contact, one increment after another."""
        if not self.flat:
            return {}
        counts = [len(values) for values in self.flat["crossing"]]
        number = np.repeat(np.arange(len(counts)), counts)
        variables = {
            "contact_increment": (
                "point",
                number,
                {"units": "1", "long_name": "increment that it belongs to"},
            )
        }
        for name, (dims, unit, meaning) in CONTACT_COLUMNS.items():
            attributes = {"units": unit, "long_name": meaning}
            variables[f"contact_{name}"] = (("point", *dims), np.concatenate(self.flat[name]), attributes)
        return variables


_COLUMNS = {
    "load": ("increment", "1", "load factor"),
    "strain": ("increment", "1", "applied strain"),
    "displacement": ("increment", "m", "displacement of the driven side along the load"),
    "driven_displacement": (("increment", "xyz"), "m", "displacement of the driven side"),
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
    "crossing_displacement": (
        ("increment", "crossing", "side", "xyz"),
        "m",
        "mean displacement of the facets at the crossing",
    ),
    "section_gradient": (
        ("increment", "crossing", "side", "xyz", "undeformed_xyz"),
        "1",
        "mean deformation gradient of the yarn's section at the crossing",
    ),
    "section_displacement": (
        ("increment", "crossing", "side", "xyz"),
        "m",
        "displacement of the centreline's point at the crossing",
    ),
    "yarn_force": (("increment", "yarn_number", "xyz"), "N", "net force of the interactions on a yarn"),
    "yarn_moment": (
        ("increment", "yarn_number", "xyz"),
        "N m",
        "their net moment about the mean of the yarn's centreline",
    ),
    "smallest_gap": ("increment", "m", "smallest gap of all pieces of yarn that are near each other"),
    "augmentations": ("increment", "1", "updates of the contact multipliers"),
    "seconds": (("increment", "phase"), "s", "time by phase of the Newton iterations"),
}
