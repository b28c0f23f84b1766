"""From a scene to its results in one call, for notebooks and for the `knitstudy` command.

Stages and files are the same as in the workflow (`run.stages`), and the same digests decide which results are up to
date.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from knitstudy.knit.loading.run import IN_MEMORY, ReportProgress, Run, restart_of, silent
from knitstudy.knit.scene.scene import Scene, questions
from knitstudy.run.configuration import CONFIG
from knitstudy.run.plan import Plan, kept_of, make, result_of
from knitstudy.run.stages import STAGES, Stage

log = logging.getLogger(__name__)

OF_STUDY = Path("results")  # Where studies leave results, which are read and never written here

BeginProgress = Callable[[str], ReportProgress]
"""Returns the receiver of the progress of a stage, for example `knitstudy.knit.loading.run.Progress`."""


@dataclass(frozen=True, eq=False)
class Results:
    """All that a simulation gives, in the formats of docs/reference/files.md.

    Files have the name of the scene; only solid yarns have a `mesh`. `contacts` are at the crossings of solid yarns;
    for a reduced model, they are the contacts that its joints come from. `path` is the file of the history.
    """

    scene: Scene
    geometry: xr.Dataset
    history: xr.Dataset
    mesh: xr.Dataset | None = None
    contacts: xr.Dataset | None = None
    path: Path | None = None

    def _repr_html_(self) -> str:
        """Notebooks show the name and the history."""
        return f"<b>{self.scene.name}</b>{self.history._repr_html_()}"


def simulate(
    scene: Scene,
    folder: Path | str | None = None,
    *,
    config: Path = CONFIG,
    progress: BeginProgress | None = None,
    anew: bool = False,
    plan: Plan | None = None,
) -> Results:
    """Simulate a scene, and before it whatever it takes joints or springs from.

    Parameters
    ----------
    scene : Scene
        Of the configuration (`knitstudy.run.configuration.load_scene`), or a changed one (`Scene.vary`). Other keys
        under a name of the configuration get a name of their own. If the geometry of a reduced model has changed, so
        has that of the simulations that its joints and springs come from; their other keys are their own.
    folder : Path or str, optional
        Where results are kept, and taken from if they are up to date; restart files of runs that were ended lie in its
        folder ``restart``. Results of a study in the working folder are taken as well. Without it, all stays in memory.
    config, plan
        Configuration folder that names of other scenes refer to; its plan, where it has been read already.
    progress : callable, optional
        Called with the label of a stage, returns the receiver of its progress; for example
        `knitstudy.knit.loading.run.Progress`, which prints lines with the time left.
    anew : bool
        Simulate the scene even if its result is there.

    Raises
    ------
    KnitstudyError
        Where a stage ends in an error; earlier results stay.
    ConvergenceError
        Where the simulation ends before full load. The history so far is its attribute `history`, and in a file of
        the folder.
    """
    plan = plan or Plan.of(config)
    scene = plan.labelled(scene)
    maker = _Maker(plan, None if folder is None else Path(folder), progress or (lambda label: silent))
    for question in questions(scene):
        log.warning(question)
    stage = STAGES["simulation"]
    history = maker.obtain(stage, scene, anew)
    beside = {name: maker.obtain(*step) for name, step in plan.needs(stage, scene).items()}
    contacts = beside.get("contacts")
    if STAGES["contacts"].of(scene):
        contacts = maker.obtain(STAGES["contacts"], scene)
    path = maker.folder and maker.folder / stage.path(scene)
    return Results(scene, beside["geometry"], history, beside.get("mesh"), contacts, path)


def write_outputs(results: Results, folder: Path) -> None:
    """Write the files for other programs that the outputs of a scene ask for.

    Raises DataFileError if a file cannot be written.
    """
    scene = results.scene
    for stage in STAGES.values():
        if not stage.is_dataset and stage.of(scene) and stage.wanted(scene):
            needed = {name: getattr(results, name) for name in stage.needs(scene, lambda _: scene)}
            path = folder / stage.path(scene)
            stage.function(scene, path=path, **needed)
            log.info(f"{stage.name} {scene.name}: written to %s", path)


@dataclass
class _Maker:
    """Takes results from where they are kept, or makes them."""

    plan: Plan
    folder: Path | None
    progress: BeginProgress
    made: dict[Path, xr.Dataset] = field(default_factory=dict)

    def obtain(self, stage: Stage, scene: Scene, anew: bool = False) -> xr.Dataset:
        """Return a result: from memory, from its file if that is up to date, else made and written."""
        name, label = stage.path(scene), f"{stage.name} {scene.name}"
        if name in self.made:
            return self.made[name]
        path, wanted = self.folder and self.folder / name, self.plan.digest(stage, scene)
        result = None
        if path is not None and anew:
            kept_of(path).unlink(missing_ok=True)
        elif path is not None:
            for there in filter(Path.is_file, (path, OF_STUDY / name)):
                if (result := result_of(there, wanted)) is not None:
                    log.info(f"{label}: taken from %s", there)
                    break
                log.info(f"{label}: %s is not up to date", there)
        if result is None:
            if stage.restarts:
                stage.require_machine(scene)  # before anything is made for it
            needed = {
                argument: self.obtain(*step) for argument, step in self.plan.needs(stage, scene).items()
            }
            restart = None
            if stage.restarts and self.folder is not None:
                restart = restart_of(self.folder / "restart", scene.name, wanted)
            run = Run(restart, self.progress(label)) if stage.reports else IN_MEMORY
            seen = scene.only(stage.document(scene), stage.keys(scene))
            record = self.plan.record(stage, scene)
            result = make(stage, seen, needed, path, wanted, run, record)
            if path is not None:
                log.info(f"{label}: written to %s", path)
        self.made[name] = result
        return result
