"""From a scene to its results in one call: what a notebook and the `knitstudy` command use.

The stages are those of the workflow, in the same order and with the same files: geometry -> mesh -> dns -> contacts of
solid yarns, from whose contacts -> rom reduced models, and geometry -> beams of yarns that are beams in contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import xarray as xr

from knitstudy.crossings import contacts
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.build import build
from knitstudy.geometry.pair import Pair
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.specimen import read_specimen
from knitstudy.loading.progress import ReportProgress, silent
from knitstudy.loading.restart import forget_others, restart_path
from knitstudy.loading.run import Run
from knitstudy.mesh.specimen import mesh_specimen
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.networks.beams import run as beams
from knitstudy.networks.rom import run as rom
from knitstudy.registry import unknown_choice
from knitstudy.solids import dns
from knitstudy.stages.archive import Archive
from knitstudy.stages.code import modules_behind
from knitstudy.study.configuration import CONFIG, check_scenes_together
from knitstudy.study.scene import Scene

BeginProgress = Callable[[str], ReportProgress]
"""Returns what the progress of a stage is reported to, for example `knitstudy.loading.progress.Progress`."""


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
        `knitstudy.loading.progress.Progress`, which prints lines with the time left.
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
        inputs = [archive.path("geometry", archive.knit_of(scene)), archive.path("mesh", scene)]
        how = _run(scene, archive, inputs, "knitstudy.solids.dns", progress(f"dns {scene.name}"))
        return dns.run(scene, SweptMesh.from_dataset(mesh), specimen, how)

    needs = ["node_displacement"] if "fields" in scene.outputs else []
    history = archive.keep("dns", scene, load, needs=needs, anew=anew)
    path = archive.path("dns", scene)
    found = archive.keep("contacts", scene, partial(contacts.extract, specimen, history), after=[path])
    return Results(scene, geometry, history, mesh, found, path)


def _beams(scene: Scene, archive: Archive, progress: BeginProgress, anew: bool) -> Results:
    """Load a knit of beams in contact."""
    geometry = _geometry(scene, archive)

    def load() -> xr.Dataset:
        inputs = [archive.path("geometry", archive.knit_of(scene))]
        how = _run(scene, archive, inputs, "knitstudy.networks.beams.run", progress(f"beams {scene.name}"))
        return beams.run(scene, read_specimen(geometry), how)

    history = archive.keep("beams", scene, load, anew=anew)
    return Results(scene, geometry, history, path=archive.path("beams", scene))


def _reduced(scene: Scene, archive: Archive, progress: BeginProgress, anew: bool) -> Results:
    """Load a network of beams whose joints, and perhaps springs, come from direct simulations."""
    sources = _sources(scene, archive)
    found = {key: _direct(source, archive, progress, anew=False) for key, source in sources.items()}
    joints, springs = found["contacts_from"], found.get("springs_from")
    contacts_of = [archive.path("contacts", source) for source in sources.values()]

    def load() -> xr.Dataset:
        report = progress(f"{scene.fidelity} {scene.name}")
        how = _run(scene, archive, contacts_of, "knitstudy.networks.rom.run", report)
        specimen, other = read_specimen(joints.geometry), springs.contacts if springs else None
        return rom.run(scene, specimen, joints.contacts, other, how)

    history = archive.keep("rom", scene, load, after=contacts_of, anew=anew)
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


def _run(
    scene: Scene, archive: Archive, inputs: Iterable[Path | None], module: str, progress: ReportProgress
) -> Run:
    """Return where a run keeps what had converged; that of other inputs is of no use any more."""
    if archive.folder is None:
        return Run(progress=progress)
    restart = restart_path(archive.folder / "restart", scene, [*inputs, *modules_behind(module)])
    forget_others(restart)
    return Run(restart, restart.with_suffix(".nc"), progress)


def _silence(label: str) -> ReportProgress:
    """Report nothing, whatever the stage."""
    return silent
