"""Columns: values of one simulation, which tables list and claims read.

A row is a `Simulation`: a scene with its results. A table with a row for every simulation is a list of `Column`. A
reading of the paper gives rows other names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures import response
from knitstudy.measures.cost import MEGABYTE, effort
from knitstudy.run.catalogue import Datasets, Scenes


@dataclass(frozen=True, eq=False)
class Simulation:
    """A scene with its results by stage: a row of a table, whose cells are computed when they are asked for."""

    scene: Scene
    results: Datasets
    _cells: dict[Column, Any] = field(default_factory=dict, repr=False)

    def __getitem__(self, column: Column) -> Any:
        if column.of == "scene":  # whose name changes
            return column.function(self.scene)
        if column not in self._cells:
            self._cells[column] = column.function(self.results[column.of] if column.of else self)
        return self._cells[column]

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
    return pd.DataFrame([{column.head: row[column] for column in columns} for row in rows])


def key(name: str, unit: str, path: str) -> Column:
    """Return the column of a key of the scene; cells are empty where a model has no such key."""
    return Column(name, unit, lambda scene: scene.value(path), of="scene")


def cells_of(scene: Scene) -> str:
    """Return the number of loops and rows of a knit in words."""
    return f"{scene.value('pattern.loops')} x {scene.value('pattern.rows')}"


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
MEMORY = Column("memory growth", "MB", lambda history: history.attrs["memory_growth"] / MEGABYTE)
STABILISED = Column(
    "stabilisation over internal energy at full load", "1", lambda history: _stabilised(history["energy"][-1])
)


def _stabilised(energy: xr.DataArray) -> float:
    return float(energy.sel(form="stabilisation") / energy.sel(form="internal"))


def _effort(name: str, unit: str) -> Column:
    return Column(name, unit, lambda history: effort(history)[f"{name} [{unit}]"])


INCREMENTS, NEWTON = _effort("increments", "1"), _effort("Newton iterations", "1")
KRYLOV, TIME = _effort("Krylov iterations", "1"), _effort("time", "s")
EFFORT = (INCREMENTS, NEWTON, KRYLOV, TIME)
