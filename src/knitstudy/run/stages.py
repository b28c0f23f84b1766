"""The stages, each declared once: the keys that it reads, its inputs, its function, and its file.

    geometry -> mesh, rest -> simulation -> contacts, stress -> exports

The rules of the workflow, `simulate`, the command and the benchmarks take the stages from `STAGES`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import fault_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import later, wings
from knitstudy.run.code import MESH, MODEL
from knitstudy.run.cost import expected_memory, expected_seconds, machine_memory

if TYPE_CHECKING:  # a job that needs no dataset starts in half the time
    import xarray as xr

Needs = Mapping[str, tuple[str, Scene]]
"""The results that a function takes, by its parameters: the stage that makes each, and of which scene."""

Named = Callable[[str], Scene]  # Returns the scene that a dotted key names

OF_SIZE = ("pattern.loops", "pattern.rows", "pair.length", "mesh.size", "mesh.crossing_degree")
"""Keys that memory depends on."""

KIND = ("specimen", "fidelity", "interaction")

PAIR = ("pair.angle", "pair.length", "pair.clearance")

OF_GEOMETRY = ("specimen", "pattern", *PAIR, "yarn.diameter", "geometry")

MODEL_KEYS = (*KIND, "pattern", "pair", "yarn", "load", "mesh", "tie", "contact", "solver")


@dataclass(frozen=True)
class Stage:
    """A step from a scene to one of its results.

    The function is called with the scene, the datasets that it needs by name, and ``run``
    (`knitstudy.knit.loading.run.Run`) if the stage is long. It returns a dataset; if the result is no netCDF file, it
    writes the file ``path``.
    """

    name: str  # of the stage and of its rule
    path_pattern: str  # under the folder of results, with {scene} or {knit}
    message: str  # that a study shows when it makes the result
    function: Callable
    # Sections and dotted keys that the result depends on; the function sees no others. None: all sections
    reads: tuple[str, ...] | None
    of: Callable[[Scene], bool]  # whether a scene has this stage
    needs: Callable[[Scene, Named], Needs] = lambda scene, named: {}
    code: tuple[str, ...] = MODEL  # rooms whose code makes the result (`run.code`)
    outputs: tuple[str, ...] = ()  # entries of the scene's outputs that the result depends on
    # Whether a study asks for it, in addition to the inputs of stages
    wanted: Callable[[Scene], bool] = lambda scene: True
    reports: bool = False  # whether its function takes a run, for its progress
    restarts: bool = False  # whether the run has a restart file as well
    queued: bool = False  # whether a cluster's queue runs it; others take seconds
    memory: Callable[[Scene], int] = lambda scene: 1000  # expected [MB]
    seconds: Callable[[Scene], float] = lambda scene: 60.0  # expected at most, of one processor

    @property
    def is_dataset(self) -> bool:
        """Whether its result is a netCDF file, which records its inputs."""
        return self.path_pattern.endswith(".nc")

    @property
    def label(self) -> str:
        """The wildcard of its file, which names the file of its log: {scene} or {knit}."""
        return "{knit}" if "{knit}" in self.path_pattern else "{scene}"

    def make(self, scene: Scene, **needed: Any) -> xr.Dataset:
        """Return its result as a dataset, with the processor time of all threads; refuse an incomplete history.

        A stage that may go on from a restart file counts its own time.
        """
        started = time.process_time()
        dataset = self.function(scene, **needed)
        if fault := fault_of(dataset):
            raise DataFileError(f"the {self.name} of {scene.name} {fault}: it is not written")
        seconds = time.process_time() - started
        return dataset if self.restarts else dataset.assign_attrs(processor_seconds=seconds)

    def require_machine(self, scene: Scene) -> None:
        """Refuse a scene that is expected to take more memory than the machine has."""
        need, has = self.memory(scene) / 1000, machine_memory() / 1000
        if need > has:
            sizes = {key: scene.value(key) for key in OF_SIZE}
            text = ", ".join(f"{key} is {value:g}" for key, value in sizes.items() if value is not None)
            much = f"the stage {self.name!r} would take some {need:.3g} GB, and this machine has {has:.3g}"
            remedy = "take a smaller specimen"
            if scene.kind.fidelity.solid:
                remedy += ", larger elements, a lower degree, or spline yarns instead of hexahedra"
            raise ConfigurationError(f"scene {scene.name!r}: {text}: {much}; {remedy}")

    def path(self, scene: Scene) -> Path:
        """Return the path of its result under the folder of results."""
        return Path(self.path_pattern.format(scene=scene.name, knit=scene.knit))

    def keys(self, scene: Scene) -> tuple[str, ...]:
        """Return the sections and dotted keys of a scene that it reads."""
        return (*KIND, *scene.sections) if self.reads is None else self.reads

    def document(self, scene: Scene) -> dict:
        """Return the keys that it reads of a scene, as plain data."""
        document = scene.read(self.keys(scene))
        if self.outputs:
            document["outputs"] = [name for name in self.outputs if name in scene.outputs]
        return document


def has_mesh(scene: Scene) -> bool:
    """Whether solid yarns of a scene are swept through its whole geometry."""
    return scene.kind.direct


def starts_from_rest(scene: Scene) -> bool:
    """Whether the load of a scene begins with a shape at rest."""
    return scene.value("load.start") not in (None, "drawn")


def _model_needs(scene: Scene, named: Named) -> Needs:
    """Return geometry and mesh, and the results of other scenes that joints, springs and honeycombs come from."""
    sources = {
        "contacts": ("contacts", "rom.contacts_from"),
        "springs": ("contacts", "rom.springs_from"),
        "stresses": ("stress", "rom.stress_from"),
    }
    needed: dict[str, tuple[str, Scene]] = {"geometry": ("geometry", scene)}
    if has_mesh(scene):
        needed["mesh"] = ("mesh", scene)
    if starts_from_rest(scene):
        needed["rest"] = ("rest", scene)
    needed |= {name: (stage, named(key)) for name, (stage, key) in sources.items() if scene.value(key)}
    if "stresses" in needed:
        _require_fields(needed["stresses"][1])
    return needed


def _require_fields(scene: Scene) -> None:
    """Refuse a scene that does not keep its fields."""
    if "fields" not in scene.outputs:
        why = "node_displacement, which deformed yarns and stresses come from, is kept with it"
        fact = f"outputs is [{', '.join(scene.outputs)}] but must hold 'fields'"
        raise ConfigurationError(f"scene {scene.name!r}: {fact}: {why}")


def _fields(scene: Scene, named: Named) -> Needs:
    """Return the inputs of deformed yarns and stresses."""
    _require_fields(scene)
    return _solids(scene, named) | {"history": ("simulation", scene)}


def _series(scene: Scene, named: Named) -> Needs:
    """Return the inputs of a time series, a mesh among them where solids are drawn."""
    if has_mesh(scene) and "fields" in scene.outputs:
        return _fields(scene, named)
    return {"geometry": ("geometry", scene), "history": ("simulation", scene)}


def _solids(scene: Scene, named: Named) -> Needs:
    return {"geometry": ("geometry", scene), "mesh": ("mesh", scene)}


EXPORTS = {name: function for wing in wings() for name, function in wing.exports.items()}
"""Functions of the wings that write files for other programs, by the name of their stage."""


def _export(name: str, path: str, what: str, outputs: str, **known: Any) -> Stage:
    """Return a stage that writes a file for another program, of scenes with some outputs.

    Unless `known` says otherwise, scenes with a mesh have the stage that may have these outputs.
    """
    asked = set(outputs.split())
    known = {
        "reads": MODEL_KEYS,
        "code": ("use/deck.py", "use/inp.py", "use/vtu.py", *MODEL),
        "of": lambda scene: has_mesh(scene) and asked <= set(scene.kind.outputs),
        "needs": _solids,
        "wanted": lambda scene: asked <= set(scene.outputs),
    } | known
    return Stage(name, path, f"Write {what} of {{wildcards.scene}}", later(EXPORTS.get(name, "")), **known)


_STAGES = (
    Stage(
        name="geometry",
        path_pattern="geometry/{knit}.nc",
        message="Lay out {wildcards.knit}",
        function=later("knitstudy.knit.geometry.lay_out:lay_out"),
        reads=OF_GEOMETRY,
        of=lambda scene: True,
        code=("knit/geometry",),
        wanted=lambda scene: False,
        memory=lambda scene: 500,
    ),
    Stage(
        name="mesh",
        path_pattern="mesh/{scene}.nc",
        message="Mesh {wildcards.scene}",
        function=later("knitstudy.knit.mesh.mesher:mesh"),
        reads=("load.direction", "mesh.size", "mesh.growth", "mesh.refinement"),
        of=has_mesh,
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        code=MESH,
        wanted=lambda scene: False,
    ),
    Stage(
        name="rest",
        path_pattern="rest/{scene}.nc",
        message="Relax {wildcards.scene}",
        function=later("knitstudy.knit.models.beam.cell:relax"),
        reads=(*KIND, "yarn", "mesh", "contact.friction", "beam", "solver", "load.start"),
        of=starts_from_rest,
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        reports=True,
        queued=True,
        wanted=lambda scene: False,
    ),
    Stage(
        name="simulation",
        path_pattern="simulation/{scene}.nc",
        message="Simulate {wildcards.scene}",
        function=later("knitstudy.knit.simulate:simulate"),
        reads=None,
        outputs=("fields",),
        of=lambda scene: True,
        needs=_model_needs,
        reports=True,
        restarts=True,
        queued=True,
        memory=expected_memory,
        seconds=expected_seconds,
    ),
    Stage(
        name="contacts",
        path_pattern="contacts/{scene}.nc",
        message="Find the contacts of {wildcards.scene}",
        function=later("knitstudy.knit.contacts.contacts:contacts"),
        reads=(),
        of=lambda scene: scene.kind.fidelity.solid and scene.specimen != "cell",
        needs=lambda scene, named: {"geometry": ("geometry", scene), "history": ("simulation", scene)},
    ),
    Stage(
        name="stress",
        path_pattern="stress/{scene}.nc",
        message="Average the stress of {wildcards.scene}",
        function=later("knitstudy.knit.stress:stress"),
        reads=MODEL_KEYS,
        of=lambda scene: has_mesh(scene) and scene.is_knit and "fields" in scene.outputs,
        needs=_fields,
        memory=lambda scene: 1000 + expected_memory(scene) // 2,
    ),
)

_EXPORTS = (
    _export("mesh_vtu", "mesh/{scene}.vtu", "the mesh", "vtu", reads=("mesh.element",)),
    _export(
        "series",
        "simulation/{scene}.pvd",
        "all increments",
        "vtu",
        of=lambda _: True,
        needs=_series,
    ),
    _export("deck_abaqus", "mesh/{scene}.abaqus.inp", "the Abaqus deck", "deck"),
    _export("deck_calculix", "mesh/{scene}.calculix.inp", "the CalculiX deck", "deck"),
    _export(
        "shell_section",
        "simulation/{scene}.abaqus.inp",
        "the Abaqus shell section",
        "deck",
        reads=(),
        of=lambda scene: scene.specimen == "cell" and not scene.kind.interaction.touches,
        needs=lambda scene, named: {"history": ("simulation", scene)},
    ),
)

# All stages by their names, each after the stages that it needs; of exports those that a wing writes
STAGES = {
    stage.name: stage for stage in (*_STAGES, *(export for export in _EXPORTS if export.name in EXPORTS))
}
