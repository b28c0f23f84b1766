"""Figures and tables: functions that register themselves with the results of named scenes that they are made from.

One file makes one figure or table of the paper: a module of the figures or tables of an optional package, or one from
outside that the configuration names under ``plugins``, whose function is decorated with ``FIGURES.add`` or
``TABLES.add``. A study makes the figures and tables whose scenes it has.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import translate
from functools import cache, cached_property
from inspect import signature
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from knitstudy.datasets import file_digest
from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import RESOURCES, base_of
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.registry import Registry, optional_packages
from knitstudy.run.code_digest import MODEL, code_digest
from knitstudy.run.plan import Plan, Step
from knitstudy.run.stages import STAGES

if TYPE_CHECKING:  # the workflow needs no dataset, and starts in half the time
    import xarray as xr

Function = TypeVar("Function", bound=Callable[..., Any])

Datasets = Mapping[str, "xr.Dataset"]  # results of one stage by the names of their scenes
Scenes = Mapping[str, Scene]  # by name


@dataclass(frozen=True)
class StageResults:
    """Results of one stage that a figure or table is made from."""

    stage: str  # "geometry", "mesh", "simulation", "contacts" or "stress"
    # Names of scenes in order of preference; shell patterns of names where several scenes are taken
    names: tuple[str, ...]
    several: bool = False  # whether all scenes that match are taken, or the first name that the study has
    optional: bool = False  # whether the figure or table is also made without them
    where: Callable[[Scene], bool] | None = None  # whether a scene whose name matches is taken
    fewest: int = 1  # with fewer scenes none is taken

    def scenes(self, study: Mapping[str, Scene]) -> list[Scene]:
        """Return the scenes of a study that are taken, in the order of the study; an empty list if it has none."""
        if not self.several:
            return [study[name] for name in self.names if name in study][:1]
        matches = _pattern(self.names).match
        matching = [
            scene
            for name, scene in study.items()
            if matches(name) and (self.where is None or self.where(scene))
        ]
        return matching if len(matching) >= self.fewest else []


@cache
def _pattern(names: tuple[str, ...]) -> re.Pattern[str]:
    """Return the regular expression of the names that match one of some shell patterns."""
    return re.compile("|".join(map(translate, names)))


def one(stage: str, *names: str, optional: bool = False) -> StageResults:
    """Return the result of the first of some scenes that a study has."""
    return StageResults(stage, names, optional=optional)


def several(stage: str, *patterns: str, **attributes: Any) -> StageResults:
    """Return the results of all scenes whose names match a pattern; keywords are attributes of `StageResults`."""
    return StageResults(stage, patterns, several=True, **attributes)


@dataclass(frozen=True)
class Display:
    """A figure or a table."""

    name: str  # of the file
    title: str  # with the number in the paper
    make: Callable[..., Any]  # function that draws the figure or builds the table
    # Arguments of the function that are results: a Dataset, or several by the names of their scenes
    results: Mapping[str, StageResults] = field(default_factory=dict)
    # Other arguments of the function: files by the names of `reference_files`
    files: tuple[str, ...] = ()
    # Arguments that are other tables of the study, by their names
    tables: tuple[str, ...] = ()
    # Whether it has the argument ``scenes``: a scene by the name of its result, several by their own names
    scenes: bool = False
    order: float = inf  # place in the report; figures and tables without a place follow by their names
    # Alternative text and captions where ``workflow/report/captions.yaml`` has none
    texts: Mapping[str, str] = field(default_factory=dict)

    @property
    def needed(self) -> tuple[str, ...]:
        """Arguments without which it cannot be made."""
        results = [name for name, result in self.results.items() if not result.optional]
        return (*results, *self.tables, *self.files, *(("scenes",) if self.scenes else ()))

    @property
    def takes(self) -> tuple[str, ...]:
        """All arguments."""
        optional = [name for name, result in self.results.items() if result.optional]
        return (*self.needed, *optional)


class Catalogue(Registry[Display]):
    """All figures, or all tables, in the order of the report."""

    def add(self, name: str, title: str, **attributes: Any) -> Callable[[Function], Function]:
        """Return a decorator of the function that makes a figure or table; keywords are attributes of `Display`.

        Arguments of the function that are no results and no tables are files.

        Raises ConfigurationError if the name is taken.
        """

        def added(make: Function) -> Function:
            own = {"scenes", *attributes.get("results", ()), *attributes.get("tables", ())}
            named = [
                each for each in signature(make).parameters.values() if each.kind is not each.VAR_KEYWORD
            ]
            files = [each.name for each in named if each.default is each.empty and each.name not in own]
            given = {"scenes": any(each.name == "scenes" for each in named)} | attributes
            self.register(Display(name, title, make, **given | {"files": (*given.get("files", ()), *files)}))
            return make

        return added

    def all(self) -> dict[str, Display]:
        """Return all by name, in the order of the report."""
        return dict(sorted(super().all().items(), key=lambda entry: (entry[1].order, entry[0])))

    def make(self, name: str, **sources: Any) -> Any:
        """Make a figure or table from its sources among all.

        Raises ConfigurationError if there is none of that name, or something that it needs is missing.
        """
        display = self.find(name)
        missing = [need for need in display.needed if need not in sources]
        if missing:
            raise ConfigurationError(
                f"{self.what} {name!r} needs {', '.join(display.needed)}: {', '.join(missing)} is missing"
            )
        return display.make(**{name: sources[name] for name in display.takes if name in sources})


FIGURES = Catalogue("figure", "".join(package.figures for package in optional_packages()))
TABLES = Catalogue("table", "".join(package.tables for package in optional_packages()))


# What a study can make of them

REFERENCE = RESOURCES / "reference"


@dataclass(frozen=True)
class Made:
    """A table that other displays are made from: its path in the folder of results, its digest, and what it needs."""

    path: Path
    digest: str
    needs: Mapping[str, Step | Made]


Source = Step | Made | Path  # A result, a table of the study, or a file of reference
Sources = dict[str, Source | list[Source]]  # of a figure or table by argument, several in a list


def reference_files(config: Path) -> dict[str, Path]:
    """Return the files that no study makes, by the arguments of figures and tables."""
    folder = Path(os.path.relpath(REFERENCE))  # as Snakemake lists it
    return {
        "paper": folder / "paper_tables.csv",
        "claims": folder / "paper_claims.csv",
        "readings": folder / "readings.csv",
        "reference": folder / "reference.csv",
        "mechanisms": folder / "mechanisms.csv",
        "targets": base_of(config) / "calibration.yaml",
    }


class Displays:
    """The figures, or the tables, of a study."""

    def __init__(
        self,
        catalogue: Catalogue,
        plan: Plan,
        study: Iterable[Scene],  # in the order of the configuration
        reference: Mapping[str, Path | str],  # files by their names (`reference_files`)
        label: str = "the study",  # in messages
    ) -> None:
        self.catalogue, self.plan, self.label = catalogue, plan, label
        self.study = {scene.name: scene for scene in study}
        self.reference = {name: Path(path) for name, path in reference.items()}

    @cached_property
    def sources(self) -> dict[str, Sources]:
        """Sources of each figure or table that the study can make."""
        found = {name: self._found(display) for name, display in self.catalogue.all().items()}
        return {name: sources for name, sources in found.items() if sources is not None}

    def _found(self, display: Display) -> Sources | None:
        """Return the sources of a figure or table; None where the study cannot make it."""
        known: Sources = {**self.reference}
        for argument, results in display.results.items():
            if steps := self._steps(results):
                known[argument] = [*steps] if results.several else steps[0]
        for name in display.tables:
            of_tables = Displays(TABLES, self.plan, self.study.values(), self.reference, self.label)
            if (sources := of_tables._found(TABLES.find(name))) is not None:
                needs = {role: each for role, each in _each(sources).items() if not isinstance(each, Path)}
                known[name] = Made(Path("tables", f"{name}.csv"), of_tables._digest(name, sources), needs)
        if set(display.needed) <= {*known, "scenes"}:
            return {argument: known[argument] for argument in display.takes if argument in known}
        return None

    def _steps(self, results: StageResults) -> list[Step]:
        """Return the results that the study has, of scenes that have the stage."""
        scenes = results.scenes(self.study)
        stage = STAGES[results.stage]
        return [self.plan.step(results.stage, scene) for scene in scenes if stage.of(scene)]

    def names(self) -> tuple[str, ...]:
        """Return the names of the figures or tables that the study can make, in the order of the report."""
        return tuple(self.sources)

    def sources_of(self, name: str) -> Sources:
        """Return the sources of one; ConfigurationError says which scenes the study lacks for it."""
        display = self.catalogue.find(name)
        if name not in self.sources:
            behind = (display, *map(TABLES.find, display.tables))
            every = [result for each in behind for result in each.results.values()]
            results = [result for result in every if not result.optional]
            needed = [result for result in results if not self._steps(result)]
            scenes = ", ".join(f"{result.stage} of {' or '.join(result.names)}" for result in needed)
            raise ConfigurationError(
                f"{self.catalogue.what} {name!r} needs {scenes}: {self.label} has no such scene"
            )
        return self.sources[name]

    def files(self, name: str, folder: Path | str) -> dict[str, Any]:
        """Return the files that a figure or table is made from, by argument; `folder` is that of all results."""

        def path(source: Source | list[Source]) -> Any:
            if isinstance(source, list):
                return [path(each) for each in source]
            return (source if isinstance(source, Path) else Path(folder) / source.path).as_posix()

        return {argument: path(source) for argument, source in self.sources_of(name).items()}

    def scenes(self, name: str) -> dict[str, Scene]:
        """Return the scenes of a figure or table that asks for them: one by its argument, several by their names."""
        display = self.catalogue.find(name)
        return {
            step.scene.name if results.several else argument: step.scene
            for argument, results in display.results.items()
            for step in (self._steps(results) if display.scenes else ())
        }

    def digest(self, name: str) -> str:
        """Return the digest of a figure or table that is up to date: of its title, scenes, code and sources.

        Raises ConfigurationError where the study cannot make it.
        """
        return self._digest(name, self.sources_of(name))

    def _digest(self, name: str, sources: Sources) -> str:
        scenes = {role: scene.read(scene.to_dict()) for role, scene in self.scenes(name).items()}
        reads = {"title": self.catalogue.find(name).title, "scenes": scenes}
        code = code_digest("paper", "use", "measures", *MODEL)
        return digest({"reads": reads, "code": code, "needs": digests_of(sources)})


def digests_of(sources: Sources) -> dict[str, str]:
    """Return the digests of sources, by argument and scene."""
    return {
        name: file_digest(each) if isinstance(each, Path) else each.digest
        for name, each in _each(sources).items()
    }


def _each(sources: Sources) -> dict[str, Source]:
    """Return every single source, by argument and scene."""
    return {
        f"{role} {each.scene.name}" if isinstance(each, Step) else role: each
        for role, source in sources.items()
        for each in (source if isinstance(source, list) else [source])
    }
