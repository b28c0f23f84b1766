"""From a scene to its results in one call: what a notebook and the `knitstudy` command use.

The stages are those of the workflow, in the same order and with the same files: geometry -> mesh -> dns -> contacts of
solid yarns, from whose contacts -> rom reduced models, and geometry -> beams of yarns that are beams in contact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import ceil
from pathlib import Path

import xarray as xr

from knitstudy.crossings import contacts
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.build import build
from knitstudy.geometry.pair import Pair
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.specimen import read_specimen
from knitstudy.mechanics.increment import Increment
from knitstudy.mesh.specimen import mesh_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.networks.beams import run as beams
from knitstudy.networks.rom import run as rom
from knitstudy.progress import ReportProgress, silent
from knitstudy.registry import unknown_choice
from knitstudy.restart import forget_others, restart_path
from knitstudy.solids import dns
from knitstudy.stages.archive import Archive
from knitstudy.stages.imports import modules_behind
from knitstudy.study.configuration import CONFIG, check_scenes_together
from knitstudy.study.scene import Scene

BeginProgress = Callable[[str], ReportProgress]
"""Returns what the progress of a stage is reported to, for example `knitstudy.progress.Progress`."""


@dataclass(frozen=True, eq=False)
class Results:
    """All that a simulation gives, in the formats of docs/architecture.md.

    Attributes
    ----------
    scene : Scene
        What was simulated, under the name that its files have.
    geometry, history : Dataset
    mesh : Dataset or None
        Of solid yarns.
    contacts : Dataset or None
        At the crossings of solid yarns; of a reduced model, those that its joints come from.
    path : Path or None
        File of the history.
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
) -> Results:
    """Simulate a scene, and before it whatever it takes joints or springs from.

    Parameters
    ----------
    scene : Scene
        Of the table (`knitstudy.study.configuration.load_scene`), or a changed one (`Scene.replace`,
        `Scene.vary`). Other keys under a name of the table get a name of their own. If the geometry of
        a reduced model has changed, so has that of the simulations that its joints and springs come from; their other
        keys are those of the table.
    folder : Path or str, optional
        Where results are kept, and taken from if they belong to the same inputs, for example ``results`` of the
        checkout; restart files of runs that were ended lie in its folder ``restart``. Without it, all stays in memory.
    config : Path
        Configuration folder that names of other scenes refer to.
    progress : callable, optional
        Called with the label of a stage, returns what its progress is reported to; for example
        `knitstudy.progress.Progress`, which prints lines with the time left.
    anew : bool
        Simulate the scene even if its result is there.

    Raises
    ------
    KnitstudyError
        What the stages raise; results that were there before stay.
    """
    archive = Archive.of(folder, config)
    run = {"dns": _direct, "beam": _beams}.get(scene.fidelity, _reduced)
    return run(archive.labelled(scene), archive, progress or _silence, anew)


def lay_out(
    scene: Scene, folder: Path | str | None = None, *, config: Path = CONFIG
) -> tuple[Scene, Knit | Pair, SweptMesh]:
    """Return a labelled scene, its knit or pair, and the solid mesh; see `simulate` for the arguments.

    Raises
    ------
    ConfigurationError
        If the scene is not one of solid yarns.
    """
    if scene.fidelity != "dns":
        raise ConfigurationError(
            f"scene {scene.name!r}: fidelity is {scene.fidelity!r} but must be dns: beams have no mesh of solid yarns"
        )
    archive = Archive.of(folder, config)
    scene = archive.labelled(scene)
    specimen = read_specimen(_geometry(scene, archive))
    return scene, specimen, SweptMesh.from_dataset(_mesh(scene, specimen, archive))


def _geometry(scene: Scene, archive: Archive) -> xr.Dataset:
    knit = archive.knit_of(scene)
    return archive.keep("geometry", knit, partial(build, knit))


def _mesh(scene: Scene, specimen: Knit | Pair, archive: Archive) -> xr.Dataset:
    return archive.keep(
        "mesh", scene, lambda: mesh_specimen(specimen, scene.mesh.size, scene.mesh.growth).to_dataset()
    )


def _direct(scene: Scene, archive: Archive, progress: BeginProgress, anew: bool) -> Results:
    """Load solid yarns, and find what acts at their crossings."""
    geometry = _geometry(scene, archive)
    specimen = read_specimen(geometry)
    mesh = _mesh(scene, specimen, archive)

    def load() -> xr.Dataset:
        checkpoint = _checkpoint(scene, archive)
        return dns.run(
            scene,
            SweptMesh.from_dataset(mesh),
            specimen,
            checkpoint=checkpoint,
            partial=checkpoint and checkpoint.with_suffix(".nc"),
            progress=_watcher(scene, progress(f"dns {scene.name}")),
        )

    needs = ["node_displacement"] if "fields" in scene.outputs else []
    history = archive.keep("dns", scene, load, needs=needs, anew=anew)
    path = archive.path("dns", scene)
    found = archive.keep("contacts", scene, partial(contacts.extract, specimen, history), after=[path])
    return Results(scene, geometry, history, mesh, found, path)


def _beams(scene: Scene, archive: Archive, progress: BeginProgress, anew: bool) -> Results:
    """Load a knit of beams in contact."""
    geometry = _geometry(scene, archive)
    watch = _watcher(scene, progress(f"beams {scene.name}"))
    history = archive.keep(
        "beams", scene, lambda: beams.run(scene, read_specimen(geometry), watch), anew=anew
    )
    return Results(scene, geometry, history, path=archive.path("beams", scene))


def _reduced(scene: Scene, archive: Archive, progress: BeginProgress, anew: bool) -> Results:
    """Load a network of beams whose joints, and perhaps springs, come from direct simulations."""
    sources = _sources(scene, archive)
    found = {key: _direct(source, archive, progress, anew=False) for key, source in sources.items()}
    joints, springs = found["contacts_from"], found.get("springs_from")
    history = archive.keep(
        "rom",
        scene,
        lambda: rom.run(
            scene, read_specimen(joints.geometry), joints.contacts, springs.contacts if springs else None
        ),
        after=[archive.path("contacts", source) for source in sources.values()],
        anew=anew,
    )
    return Results(scene, joints.geometry, history, contacts=joints.contacts, path=archive.path("rom", scene))


def _sources(scene: Scene, archive: Archive) -> dict[str, Scene]:
    """Return the direct simulations that a reduced model takes something from, with the geometry of that model."""
    named = {
        key: name
        for key in ("contacts_from", "springs_from")
        if (name := getattr(scene.rom, key)) is not None
    }
    direct = {name: other for name, other in archive.scenes.items() if other.fidelity == "dns"}
    for key, name in named.items():
        if name not in direct:
            message = unknown_choice(f"rom.{key} names the unknown dns scene", name, name, sorted(direct))
            raise ConfigurationError(f"scene {scene.name!r}: {message}")
    geometry = scene.geometry_inputs | {"knit": scene.knit}
    alike = {name: direct[name].vary(geometry) for name in named.values()}
    check_scenes_together(alike | {scene.name: scene}, "configuration")
    return {key: archive.labelled(alike[name]) for key, name in named.items()}


def _checkpoint(scene: Scene, archive: Archive) -> Path | None:
    """Return the restart file of a scene; those of the same scene with other inputs are of no use any more."""
    if archive.folder is None:
        return None
    inputs = [archive.path("geometry", archive.knit_of(scene)), archive.path("mesh", scene)]
    checkpoint = restart_path(
        archive.folder / "restart", scene, [*inputs, *modules_behind("knitstudy.solids.dns")]
    )
    forget_others(checkpoint)
    return checkpoint


def _watcher(scene: Scene, report: ReportProgress) -> Callable[[Increment], None]:
    """Return what reports the share and the place of every increment."""
    legs = len(scene.load.path)

    def watch(increment: Increment) -> None:
        load = increment.load
        report(
            load, f"leg {ceil(load * legs)} of {legs}" if legs else f"strain {load * scene.load.strain:.2%}"
        )

    return watch


def _silence(label: str) -> ReportProgress:
    """Report nothing, whatever the stage."""
    return silent
