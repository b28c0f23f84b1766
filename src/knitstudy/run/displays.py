"""Figures and tables that a study can make: their sources, scenes and digests."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.files import file_digest
from knitstudy.knit.scene.defaults import base_of
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.run.catalogue import Catalogue, Results
from knitstudy.run.code import MODEL, code_digest
from knitstudy.run.plan import Plan, Step
from knitstudy.run.stages import STAGES

REFERENCE = RESOURCES / "reference"

Source = Step | list[Step] | Path  # A result, several results of one argument, or a file of reference


def reference_files(config: Path) -> dict[str, Path]:
    """Return the files that no study makes, by the arguments of figures and tables."""
    folder = Path(os.path.relpath(REFERENCE))  # as Snakemake lists it
    return {
        "paper": folder / "paper_tables.csv",
        "claims": folder / "paper_claims.csv",
        "readings": folder / "readings.csv",
        "reference": folder / "reference.csv",
        "targets": base_of(config) / "calibration.yaml",
    }


@dataclass(eq=False)
class Displays:
    """The figures, or the tables, of a study."""

    catalogue: Catalogue
    plan: Plan
    study: Iterable[Scene]  # in the order of the configuration
    reference: Mapping[str, Path | str]  # files by their names (`reference_files`)
    label: str = "the study"  # names the study in messages

    def __post_init__(self) -> None:
        self.study = {scene.name: scene for scene in self.study}
        self.reference = {name: Path(path) for name, path in self.reference.items()}

    @cached_property
    def sources(self) -> dict[str, dict[str, Source]]:
        """Sources by argument of each figure or table that the study can make."""
        sources = {}
        for name, display in self.catalogue.all().items():
            known: dict[str, Source] = dict(self.reference)
            for argument, results in display.results.items():
                steps = self._steps(results)
                if steps:
                    known[argument] = steps if results.several else steps[0]
            if set(display.needed) <= {*known, "scenes"}:
                sources[name] = {argument: known[argument] for argument in display.takes if argument in known}
        return sources

    def _steps(self, results: Results) -> list[Step]:
        """Return the results that the study has, of scenes that have the stage."""
        stage = STAGES[results.stage]
        return [(stage, scene) for scene in results.scenes(self.study) if stage.of(scene)]

    def names(self) -> tuple[str, ...]:
        """Return the names of the figures or tables that the study can make, in the order of the report."""
        return tuple(self.sources)

    def files(self, name: str, folder: Path | str) -> dict[str, str | list[str]]:
        """Return the files that a figure or table is made from, by argument; `folder` is that of all results."""
        display, folder = self.catalogue.find(name), Path(folder)
        if name not in self.sources:
            needed = [
                result
                for result in display.results.values()
                if not result.optional and not self._steps(result)
            ]
            scenes = ", ".join(f"{result.stage} of {' or '.join(result.names)}" for result in needed)
            raise ConfigurationError(
                f"{self.catalogue.what} {name!r} needs {scenes}: {self.label} has no such scene"
            )

        def path(source: Source) -> str | list[str]:
            if isinstance(source, list):
                return [path(step) for step in source]
            file = source if isinstance(source, Path) else folder / source[0].path(source[1])
            return file.as_posix()

        return {argument: path(source) for argument, source in self.sources[name].items()}

    def scenes(self, name: str) -> dict[str, Scene]:
        """Return the scenes of a figure or table that asks for them: one by its argument, several by their names."""
        display = self.catalogue.find(name)
        scenes: dict[str, Scene] = {}
        if display.scenes:
            for argument, results in display.results.items():
                named = [scene for _, scene in self._steps(results)]
                scenes |= {scene.name if results.several else argument: scene for scene in named}
        return scenes

    def digest(self, name: str) -> str:
        """Return the digest of a figure or table that is up to date: of its title, scenes, code and sources."""
        scenes = {role: scene.read(scene.to_dict()) for role, scene in self.scenes(name).items()}
        reads = {"title": self.catalogue.find(name).title, "scenes": scenes}
        code = code_digest("paper", "use", "measures", *MODEL)
        return digest({"reads": reads, "code": code, "needs": digests_of(self.sources[name], self.plan)})


def digests_of(sources: Mapping[str, Source], plan: Plan) -> dict[str, str]:
    """Return the digests of sources, by argument and scene."""
    digests = {}
    for role, source in sources.items():
        if isinstance(source, Path):
            digests[role] = file_digest(source)
        else:
            for stage, scene in source if isinstance(source, list) else [source]:
                digests[f"{role} {scene.name}"] = plan.digest(stage, scene)
    return digests
