"""What simulations cost: memory, time of a model and of the simulations that it is made from, size of elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.study.scene import Scene

MEGABYTE = 1e6
NO_GROWTH = 1e3  # Least growth of memory in ratios and logarithms [bytes]

# Kinds of seconds: histories from before CPU time was recorded have wall-clock time alone.
PROCESSOR, WALL = "processor", "wall clock"


def memory_growth(history: xr.Dataset) -> float:
    """Return the growth of memory above that of the bare process, at least `NO_GROWTH` [bytes]."""
    return max(float(history.attrs["memory_growth"]), NO_GROWTH)


def element_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())


@dataclass(frozen=True)
class Expense:
    """Seconds of a simulation and its sources, of the sources, kind of seconds, and largest growth of memory [MB]."""

    seconds: float
    sources: float
    clock: str
    memory: float


def seconds_of(history: xr.Dataset) -> tuple[float, str]:
    """Return the seconds of a simulation and their kind."""
    if "processor_seconds" in history.attrs:
        return float(history.attrs["processor_seconds"]), PROCESSOR
    return float(history.attrs["wall_seconds"]), WALL


def expense_of(scene: Scene, histories: Mapping[str, xr.Dataset]) -> Expense | None:
    """Return the expense of a scene; None without the history of one of its sources."""
    names = {scene.value(key) for key in scene.kind.fidelity.sources} - {None}
    if not names <= histories.keys():
        return None
    own, clock = seconds_of(histories[scene.name])
    found = [seconds_of(histories[name]) for name in names]
    memory = max(memory_growth(histories[name]) for name in (scene.name, *names)) / MEGABYTE
    sources = sum(seconds for seconds, _ in found)
    clocks = {clock, *(kind for _, kind in found)}
    return Expense(own + sources, sources, WALL if WALL in clocks else PROCESSOR, memory)
