"""Load path of the driven grips (section 2.3 of the paper), history of a loading (files.md), and its cost."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import xarray as xr

from knitstudy.knit.geometry.columns import HISTORY
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import DrawnCellStrain, PairPath
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Chosen
from knitstudy.mechanics.core.increment import PHASES, Increment, PrescribedDisplacement, between_corners

DIRECTIONS = ("course", "wale")  # of a knit's load, along x and y


@dataclass(frozen=True, eq=False)
class Motion:
    """Straight legs from rest through a number of corners."""

    displacement: Floats  # (m, 3) of the driven grips at the corners [m]
    corners: tuple[float, ...]  # their load factors, rising to 1
    stops: tuple[float, ...]  # load factors at which an increment has to end
    axis: int  # direction of the force that is reported
    length: float  # length that strains along it refer to [m]

    def at(self, load: float) -> Floats:
        """Return the displacement (3,) at a load factor [m]."""
        return between_corners(self.displacement, self.corners, load)

    def way(self, start: float, end: float) -> float:
        """Return the length of the path between two load factors [m]."""
        loads = [start, *(corner for corner in self.corners if start < corner < end), end]
        return float(np.linalg.norm(np.diff([self.at(load) for load in loads], axis=0), axis=1).sum())

    def place(self, load: float) -> str:
        """Return where a load factor is on the path, in words: the strain, or the leg, or both.

        Examples
        --------
        >>> Motion(np.array([[2e-3, 0, 0]]), (1.0,), (), axis=0, length=0.04).place(0.5)
        'strain 2.50%'
        """
        # Rounding at a corner must not begin the next leg.
        leg = f"leg {int(np.searchsorted(self.corners, load - 1e-9)) + 1} of {len(self.corners)}"
        if self.axis == 2:  # across the plane, where a pair has no strain
            return leg
        strain = f"strain {self.at(load)[self.axis] / self.length:.2%}"
        return strain if len(self.corners) == 1 else f"{strain} on {leg}"


def load_path(scene: Scene, specimen: Fabric) -> Motion:
    """Return how a scene's grips move: a knit's along the load to its strain, a pair's along its path."""
    if isinstance(scene.load, PairPath):
        legs = np.array(scene.load.path)
        corners = tuple((np.arange(len(legs)) + 1) / len(legs))
        return Motion(legs, corners, (), axis=2, length=float(specimen.size[2]))
    axis = DIRECTIONS.index(scene.value("load.direction"))
    length = float(specimen.size[axis])
    strain = scene.load.strain
    stops = tuple(stop / strain for stop in scene.load.stops)
    return Motion(strain * length * np.eye(3)[[axis]], (1.0,), stops, axis, length)


# Which strains of a cell a deformation prescribes, by `load.deformation`; the last one is the closing of plates
PRESCRIBED = {
    "course": (1, 0, 0),
    "wale": (0, 1, 0),
    "biaxial": (1, 1, 0),
    "shear": (0, 0, 1),
    "press": (0, 0, 0, 1),
}


def cell_path(
    load: DrawnCellStrain, lengths: Floats, held: Ints | Sequence[int] = (), size: int = 3
) -> tuple[Motion, PrescribedDisplacement]:
    """Return how the lattice of a cell with edges (3,) [m] moves (`Lattice.lengths`): the last three of the unknowns.

    Its displacement along x, y and in shear is the strain times the edge; legs take shares of the load by their strain.
    Between plates their distance is the fourth of the `lengths`, and the motion is that of the last three unknowns.
    """
    chosen = np.array(PRESCRIBED[load.deformation], dtype=bool)
    turns = np.array([*load.turns, load.strain])
    way = np.cumsum(np.abs(np.diff(turns, prepend=0.0)))
    corners = (*(way[:-1] / way[-1]).tolist(), 1.0)
    stops = tuple(abs(stop) / way[-1] for stop in load.stops)
    axis = int(np.argmax(chosen[-3:]))
    moved = turns[:, None] * chosen * [1.0, load.ratio, 1.0, 1.0][: len(lengths)] * lengths
    motion = Motion(moved[:, -3:], corners, stops, axis, float(lengths[-3:][axis]))
    chosen |= load.lateral == "fixed"
    fixed = np.array([*held, *np.arange(size - len(lengths), size)[chosen]])
    value = np.concatenate([np.zeros((len(turns), len(held))), moved[:, chosen]], axis=1)
    return motion, PrescribedDisplacement(fixed, value, corners, stops)


_CLEAR, _STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


class Meter:
    """Measures time and growth of memory from its making on.

    On Linux the kernel is told to forget earlier peaks of memory; elsewhere an earlier peak may hide growth.
    """

    def __init__(self) -> None:
        self._before = psutil.Process().memory_info().rss
        try:
            _CLEAR.write_text("5")  # forgets the peak of /proc/self/status, not that of getrusage
            self.has_own_peak = _peak_since() > 0
        except OSError:
            self.has_own_peak = False
        self._started = _times()
        self._most = (0.0, 0.0)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave out the time that a block takes."""
        started = _times()
        try:
            yield
        finally:
            self._started += _times() - started

    def go_on(self, earlier: Mapping[str, float]) -> None:
        """Count the costs of the earlier processes of the same run too, as `read` returned them."""
        self._started -= earlier["wall_seconds"], earlier["processor_seconds"]
        self._most = earlier["memory_growth"], earlier["memory_peak"]

    def read(self) -> dict[str, float]:
        """Return the costs of a run so far, as attributes of a history.

        Times by the clock and of all processors are in seconds, the growth and the peak of memory in bytes.
        """
        wall, processor = (_times() - self._started).tolist()
        highest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        highest *= 1 if sys.platform == "darwin" else 1024
        peak = _peak_since() if self.has_own_peak else highest
        growth, highest = np.maximum(self._most, (peak - self._before, highest)).tolist()
        times = {"wall_seconds": wall, "processor_seconds": processor}
        return times | {"memory_growth": growth, "memory_peak": highest}


def _times() -> Floats:
    return np.array([time.perf_counter(), time.process_time()])


def _peak_since() -> int:
    for line in _STATUS.read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    return 0


# Forms of energy: external work = the sum of all others
FORMS = ("external", "internal", "hourglass", "penalty", "friction", "stabilisation")
FORMS_OF_YARNS = ("internal", "hourglass", "penalty", "friction")


@dataclass(frozen=True)
class Stations(Chosen):
    """Points whose motion the history follows: section centres or beam nodes."""

    yarn: Ints  # (S,) yarn of a station
    arc_length: Floats  # (S,) its arc length along the undeformed yarn [m]
    position: Floats  # (S, 3) its undeformed position [m]

    def nearest(self, yarn: Ints, arc_length: Floats) -> Ints:
        """Return the stations nearest to places on yarns; stations are in the order of yarns and arc lengths."""
        longest = 2 * self.arc_length.max()  # puts all yarns on one axis
        places = longest * self.yarn + self.arc_length
        return np.searchsorted(0.5 * (places[1:] + places[:-1]), longest * yarn + arc_length)


@dataclass
class Recorder:
    """Collects increments and adds up their energies."""

    stations: Stations  # points to follow
    driven: Ints  # (k, 3) unknowns of the driven nodes by component (x, y, z)
    motion: Motion  # of the driven side
    meter: Meter = field(default_factory=Meter)  # begun before the model was built, so that its memory counts
    columns: dict[str, list[Any]] = field(default_factory=dict)  # one value an increment
    # One array an increment, of as many rows as points were in contact
    flat: dict[str, list[Floats]] = field(default_factory=dict)
    # Energy up to every increment that says nothing about the yarns [J]: of the drag of what nothing holds, and of
    # forces that the tolerance of the residual leaves unbalanced
    undecided: list[float] = field(default_factory=list)

    def add(
        self,
        increment: Increment,
        observed: Mapping[str, Any],  # with `centreline_displacement` (S, 3) [m] at least
        points: Mapping[str, Floats] | None = None,  # of the points in contact, without `contact_`
    ) -> None:
        """Append a converged increment and the columns of the observer; DataFileError if `HISTORY` has no such name."""
        reaction = np.array([increment.response.force[self.driven[:, i]].sum() for i in range(3)])
        displacement = self.motion.at(increment.load)
        axis = self.motion.axis
        row = {
            "load": increment.load,
            "strain": displacement[axis] / self.motion.length,
            "displacement": displacement[axis],
            "driven_displacement": displacement,
            "force": reaction[axis],
            "reaction": reaction,
            "newton_iterations": increment.newton_iterations,
            "krylov_iterations": increment.krylov_iterations,
            "negative_eigenvalues": -1
            if increment.negative_eigenvalues is None
            else increment.negative_eigenvalues,
            "residual": increment.residual,
            "correction": increment.correction,
            "energy": self._energies(increment, displacement, reaction),
            "seconds": np.array([increment.timings.get(phase, 0.0) for phase in PHASES]),
            **observed,
        }
        HISTORY.require([*row, *(f"contact_{name}" for name in points or {})])
        self.undecided.append(increment.unbalanced_so_far + max(increment.dragged, 0.0))
        for name, value in row.items():
            self.columns.setdefault(name, []).append(value)
        if points:
            number = np.full(len(points["crossing"]), len(self.columns["load"]) - 1)
            for name, values in {"increment": number, **points}.items():
                self.flat.setdefault(name, []).append(values)

    def drop(self) -> None:
        """Take the last increment away."""
        for values in (*self.columns.values(), *self.flat.values(), self.undecided):
            values.pop()

    def slack(self) -> tuple[int, bool]:
        """Return the last increment up to which nothing resists, and whether something does after it.

        Yarns store and lose less than says nothing about them: a stiffness, if there is any, is not known.
        """
        energy = np.array(self.columns["energy"])[:, [FORMS.index(form) for form in FORMS_OF_YARNS]]
        resists = np.flatnonzero(np.abs(energy).sum(axis=1) > self.undecided)
        return (max(int(resists[0]) - 1, 0), True) if len(resists) else (len(energy) - 1, False)

    def _energies(self, increment: Increment, displacement: Floats, reaction: Floats) -> Floats:
        energies = np.array([increment.response.energy.get(form, 0.0) for form in FORMS])
        if self.columns:
            # Trapezoidal work of the reactions: independent of the potentials that it is compared with.
            mean = 0.5 * (reaction + self.columns["reaction"][-1])
            moved = displacement - self.columns["driven_displacement"][-1]
            energies[0] = self.columns["energy"][-1][0] + mean @ moved
        return energies

    def to_dataset(self, once: Mapping[str, Any] | None = None, **attributes: Any) -> xr.Dataset:
        """Return the history as a Dataset in the format of docs/reference/files.md, with further attributes.

        `once` are variables of `HISTORY` that are the same at all increments, or known at the last one alone.
        """
        values = {name: np.array(values) for name, values in self.columns.items()}
        values |= {f"contact_{name}": np.concatenate(parts) for name, parts in self.flat.items()}
        values |= {
            "yarn": np.asarray(self.stations.yarn),
            "arc_length": self.stations.arc_length,
            "centreline": self.stations.position,
        }
        coordinates = {"xyz": list("xyz"), "form": list(FORMS), "phase": list(PHASES)}
        axis = {"axis": self.motion.axis, "gauge_length": self.motion.length}
        attributes = self.meter.read() | axis | attributes
        return xr.Dataset(HISTORY.variables(values | dict(once or {})), coords=coordinates, attrs=attributes)
