"""From a scene to its results in one call: what a notebook and the `knitstudy` command use.

The stages are those of the workflow (`stages.table`), with the same files, and the same digests decide what is up to
date.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from knitstudy.loading.restart import ReportProgress, restart_of, run_with, silent
from knitstudy.stages.plan import Plan, make, result_of
from knitstudy.stages.table import STAGES, Stage
from knitstudy.study.configuration import CONFIG
from knitstudy.study.scene import Scene

log = logging.getLogger(__name__)

BeginProgress = Callable[[str], ReportProgress]
"""Returns what the progress of a stage is reported to, for example `knitstudy.loading.restart.Progress`."""


@dataclass(frozen=True, eq=False)
class Results:
    """All that a simulation gives, in the formats of docs/files.md.

    The scene has the name that its files have; `mesh` is there of solid yarns. `contacts` are those at the crossings of
    solid yarns, or those that the joints of a reduced model come from. `path` is the file of the history.
    """

    scene: Scene
    geometry: xr.Dataset
    history: xr.Dataset
    mesh: xr.Dataset | None = None
    contacts: xr.Dataset | None = None
    path: Path | None = None


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
        Of the configuration (`knitstudy.study.configuration.load_scene`), or a changed one (`Scene.vary`). Other keys
        under a name of the configuration get a name of their own. If the geometry of a reduced model has changed, so
        has that of the simulations that its joints and springs come from; their other keys are their own.
    folder : Path or str, optional
        Where results are kept, and taken from if they are up to date, for example ``results`` of the checkout; restart
        files of runs that were ended lie in its folder ``restart``. Without it, all stays in memory.
    config : Path
        Configuration folder that names of other scenes refer to.
    progress : callable, optional
        Called with the label of a stage, returns what its progress is reported to; for example
        `knitstudy.loading.restart.Progress`, which prints lines with the time left.
    anew : bool
        Simulate the scene even if its result is there.
    plan : Plan, optional
        Of that configuration, where it has been read already.

    Raises
    ------
    KnitstudyError
        What the stages raise; results that were there before stay.
    """
    plan = plan or Plan.of(config)
    scene = plan.labelled(scene)
    keeper = _Keeper(plan, None if folder is None else Path(folder), progress or _silence)
    stage = STAGES["simulation"]
    history = keeper.obtain(stage, scene, anew)
    beside = {name: keeper.obtain(*step) for name, step in plan.needs(stage, scene).items()}
    contacts = beside.get("contacts")
    if STAGES["contacts"].of(scene):
        contacts = keeper.obtain(STAGES["contacts"], scene)
    return Results(
        scene, beside["geometry"], history, beside.get("mesh"), contacts, keeper.path(stage, scene)
    )


@dataclass
class _Keeper:
    """Takes results from where they are kept, or makes them."""

    plan: Plan
    folder: Path | None
    progress: BeginProgress
    made: dict[Path, xr.Dataset] = field(default_factory=dict)

    def path(self, stage: Stage, scene: Scene) -> Path | None:
        """Return the file of a result."""
        return self.folder / stage.path(scene) if self.folder else None

    def obtain(self, stage: Stage, scene: Scene, anew: bool = False) -> xr.Dataset:
        """Return a result: from memory, from its file if that is up to date, else made and written."""
        name = stage.path(scene)
        if name not in self.made:
            self.made[name] = self._kept(stage, scene, anew)
        return self.made[name]

    def _kept(self, stage: Stage, scene: Scene, anew: bool) -> xr.Dataset:
        path, wanted = self.path(stage, scene), self.plan.digest(stage, scene)
        if path is not None and path.is_file() and not anew:
            found = result_of(path, wanted)
            if found is not None:
                log.info("%s %s: taken from %s", stage.name, scene.name, path)
                return found
            log.info("%s %s: %s is not up to date and will be replaced", stage.name, scene.name, path)
        if stage.long:
            stage.require_machine(scene)  # before anything is made for it
        needed = {name: self.obtain(*step) for name, step in self.plan.needs(stage, scene).items()}
        restart = self.folder and restart_of(self.folder / "restart", scene.name, wanted)
        progress = self.progress(f"{stage.name} {scene.name}") if stage.long else silent
        seen = scene.only(stage.document(scene), stage.reads)
        dataset = make(stage, seen, needed, path, wanted, run_with(restart, progress))
        if path is not None:
            log.info("%s %s: written to %s", stage.name, scene.name, path)
        return dataset


def _silence(label: str) -> ReportProgress:
    """Report nothing, whatever the stage."""
    return silent
