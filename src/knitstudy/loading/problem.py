"""A model with what is prescribed, observed and checked along its load path: all that `follow` needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from knitstudy.loading.cost import Meter
from knitstudy.loading.history import Recorder, Stations
from knitstudy.loading.load_path import Motion
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.solver import LinearSolver
from knitstudy.mechanics.model import Model
from knitstudy.study.scene import Scene


class Observer(Protocol):
    """Sees what a model does at every converged increment."""

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history, and columns of the points in contact; see `Recorder.add`."""
        ...


Check = Callable[[Increment, Recorder], None]
"""Raises a ConvergenceError if a converged increment, which has been recorded, must not count."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A boundary value problem along a load path.

    Attributes
    ----------
    scene : Scene
        What it stands for.
    model : Model
    prescribed : PrescribedDisplacement
    solver : LinearSolver
    settings : Settings
    motion : Motion
        Of the driven side.
    driven : ndarray of int, shape (k, 3)
        Unknowns of the driven nodes by component (x, y, z), whose forces are the reaction.
    stations : Stations
        Points whose displacement an observer reports.
    observers : tuple of Observer
    checks : tuple of Check
        Called in order after an increment has been recorded, before it is in the restart file: a second run must not
        go on beyond a state that is refused.
    constants : dict of str to ndarray
        Variables of the history that are the same at all increments.
    fields : callable, optional
        Returns the variables of the history that are known at the last increment alone, from the model's state.
    attributes : dict
        Of the history: numbers and texts.
    meter : Meter
        Begun before the model was built.
    """

    scene: Scene
    model: Model
    prescribed: PrescribedDisplacement
    solver: LinearSolver
    settings: Settings
    motion: Motion
    driven: np.ndarray
    stations: Stations
    observers: tuple[Observer, ...]
    checks: tuple[Check, ...] = ()
    constants: dict[str, np.ndarray] = field(default_factory=dict)
    fields: Callable[[Any], dict[str, np.ndarray]] | None = None
    attributes: dict[str, Any] = field(default_factory=dict)
    meter: Meter = field(default_factory=Meter)

    def recorder(self) -> Recorder:
        """Return an empty recorder."""
        return Recorder(self.stations, self.driven, self.motion, self.meter)
