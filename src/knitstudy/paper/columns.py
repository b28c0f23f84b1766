"""Columns: values of one simulation, which tables list and claims read.

A row is a `Simulation`: a scene with its results. A table with a row for every simulation is a list of `Column`. A
reading of the paper gives rows other names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import nan
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import Pattern
from knitstudy.measures import response
from knitstudy.run.catalogue import Datasets, Scenes


@dataclass(frozen=True, eq=False)
class Simulation:
    """A scene with its results by stage: a row of a table, whose cells are computed on access."""

    scene: Scene
    results: Datasets
    _cells: dict[Column, Any] = field(default_factory=dict, repr=False)

    def __getitem__(self, column: Column) -> Any:
        if column.of == "scene":  # whose name changes
            return column.function(self.scene)
        if column not in self._cells:
            self._cells[column] = column.function(self.results[column.of] if column.of else self)
        return self._cells[column]

    def cells(self, columns: Iterable[Column]) -> dict[str, Any]:
        """Return the cells of some columns by their heads."""
        return {column.head: self[column] for column in columns}

    @property
    def history(self) -> xr.Dataset:
        """Result of the stage "simulation"."""
        return self.results["simulation"]

    def with_results(self, **results: xr.Dataset) -> Simulation:
        """Return the scene with other results of some stages."""
        return Simulation(self.scene, {**self.results, **results})

    def named(self, name: str) -> Simulation:
        """Return the same row under another name of the scene."""
        return self if name == str(self.scene.name) else replace(self, scene=self.scene.replace("name", name))


@dataclass(frozen=True, eq=False)
class Column:
    """A value of one simulation, and how it follows from the scene or from the result of a stage.

    `function` takes the result of the stage `of`, the scene if that is "scene", or all of a `Simulation` if it is
    empty.
    """

    name: str
    unit: str
    function: Callable[[Any], Any]
    of: str = "simulation"

    @property
    def head(self) -> str:
        """Name with the unit in brackets; texts have no unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


Rows = Mapping[str, Simulation]  # by the names of scenes


def rows_of(scenes: Scenes, simulation: Datasets, **others: Datasets) -> dict[str, Simulation]:
    """Return a row for every scene that has a result, those with a history first; results by stage and scene."""
    stages = {"simulation": simulation} | others
    names = dict.fromkeys(name for results in stages.values() for name in results)
    return {
        name: Simulation(scenes[name], {stage: of[name] for stage, of in stages.items() if name in of})
        for name in names
    }


def tabulated(rows: Iterable[Simulation], columns: Iterable[Column]) -> pd.DataFrame:
    """Return the table of some columns."""
    columns = list(columns)
    return pd.DataFrame([row.cells(columns) for row in rows])


def key(name: str, unit: str, path: str) -> Column:
    """Return the column of a key of the scene; cells are empty where a model has no such key."""
    return Column(name, unit, lambda scene: scene.value(path), of="scene")


def cells_of(pattern: Pattern) -> str:
    """Return the number of loops and rows of a knit in words."""
    return f"{pattern.loops} x {pattern.rows}"


def _last(variable: str) -> Callable[[xr.Dataset], float]:
    return lambda history: float(history[variable][-1])


# Columns of several tables and claims, at full load
SCENE = Column("scene", "", lambda scene: scene.name, of="scene")
STRAIN = Column("strain", "1", _last("strain"))
FORCE = Column("force", "N", _last("force"))
SECANT = Column("secant stiffness", "N/m", response.secant_stiffness)
U_Z = Column("largest |u_z|", "m", response.largest_out_of_plane)
RMS_U_Z = Column("root mean square of u_z of every increment", "m", response.rms_out_of_plane)
CONTRACTION = Column("transverse contraction at full strain", "1", response.transverse_contraction)
DOF = Column("degrees of freedom", "1", lambda history: int(history.attrs["dof"]))
MEMORY = Column("memory growth", "MB", lambda history: history.attrs["memory_growth"] / response.MEGABYTE)
GROWTH = Column("memory growth", "MB", lambda history: response.memory_growth(history) / response.MEGABYTE)
STABILISED = Column(
    "stabilisation over internal energy at full load", "1", lambda h: _share(h, "stabilisation", "internal")
)

FRICTION_SHARE = Column(
    "friction over external work at full load", "1", lambda history: _share(history, "friction", "external")
)


def _share(history: xr.Dataset, form: str, whole: str) -> float:
    energy = history["energy"][-1]
    return float(energy.sel(form=form) / energy.sel(form=whole))


INCREMENTS = Column("increments", "1", lambda history: history.sizes["increment"] - 1)
NEWTON = Column("Newton iterations", "1", lambda history: int(history["newton_iterations"].sum()))
KRYLOV = Column("Krylov iterations", "1", lambda history: int(history["krylov_iterations"].sum()))
TIME = Column("time", "s", lambda history: history.attrs.get("wall_seconds", nan))
EFFORT = (INCREMENTS, NEWTON, KRYLOV, TIME)


def beam_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())
