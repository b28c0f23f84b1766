"""The stages, each declared once: the keys that it reads, its inputs, its function, its file, and its code.

    geometry -> mesh, rest -> simulation -> contacts, stress -> exports

The rules of the workflow, `simulate`, the command and the benchmarks take the stages from `STAGES`. The code behind a
result counts by the bytes of all files in the rooms that its stage declares: a changed comment is a change. Files of
loaded plugins always count.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import fault_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import later, plugin_files, wings
from knitstudy.run.cost import expected_memory, expected_seconds, machine_memory

if TYPE_CHECKING:  # a job that needs no dataset starts in half the time
    import xarray as xr

PACKAGE = Path(__file__).resolve().parents[1]

MESH = ("knit/geometry", "knit/mesh")
MODEL = (
    *MESH,
    "mechanics",
    "knit/contacts",
    "knit/loading",
    "knit/models",
    "knit/simulate.py",
    "knit/stress.py",
    "knit/yarns",
)
"""Rooms of this package whose code makes the numbers of meshes and of simulations."""

OF_SIZE = ("pattern.loops", "pattern.rows", "pair.length", "mesh.size", "mesh.crossing_degree")
"""Keys that memory depends on."""

KIND = ("specimen", "fidelity", "interaction")
MODEL_KEYS = (*KIND, "pattern", "pair", "yarn", "load", "mesh", "tie", "contact", "solver")

Check = Callable[[Scene], bool]


def always(scene: Scene) -> bool:
    """Whether anything holds of a scene: it does."""
    return True


def never(scene: Scene) -> bool:
    """Whether nothing holds of a scene."""
    return False


def has_mesh(scene: Scene) -> bool:
    """Whether solid yarns of a scene are swept through its whole geometry."""
    return scene.kind.direct


def has_fields(scene: Scene) -> bool:
    """Whether the history of a scene keeps the displacements of a mesh, which stresses and pictures come from."""
    return has_mesh(scene) and "fields" in scene.outputs


def starts_from_rest(scene: Scene) -> bool:
    """Whether the load of a scene begins with a shape at rest."""
    return scene.value("load.start") not in (None, "drawn")


@dataclass(frozen=True)
class Need:
    """A result that a stage takes: of the same scene where a check holds, or of the scene that a dotted key names."""

    stage: str
    key: str = ""
    where: Check = always

    def of(self, scene: Scene) -> bool:
        """Whether a scene needs it."""
        return bool(scene.value(self.key)) if self.key else self.where(scene)


GEOMETRY = {"geometry": Need("geometry")}
SOLIDS = GEOMETRY | {"mesh": Need("mesh", where=has_mesh)}
HISTORY = {"history": Need("simulation")}


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
    function: Callable[..., Any]
    # Sections and dotted keys of a scene that the result depends on; the function sees no others
    reads: Callable[[Scene], tuple[str, ...]]
    of: Check = always  # whether a scene has this stage
    needs: Mapping[str, Need] = field(default_factory=dict)  # by the parameters of the function
    code: tuple[str, ...] = MODEL  # rooms whose code makes the result
    outputs: tuple[str, ...] = ()  # entries of the scene's outputs that the result depends on
    wanted: Check = always  # whether a study asks for it, in addition to the inputs of stages
    reports: bool = False  # whether its function takes a run, for its progress
    restarts: bool = False  # whether the run has a restart file as well
    queued: bool = False  # whether a cluster's queue runs it; others take seconds
    memory: Callable[[Scene], int] = lambda scene: 1000  # expected [MB]
    seconds: Callable[[Scene], float] = lambda scene: 3.0  # expected at most, of one processor

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
        dataset: xr.Dataset = self.function(scene, **needed)
        if fault := fault_of(dataset):
            raise DataFileError(f"the {self.name} of {scene.name} {fault}: it is not written")
        seconds = time.process_time() - started
        return dataset if self.restarts else dataset.assign_attrs(processor_seconds=seconds)

    def require_machine(self, scene: Scene) -> None:
        """Refuse a long run that is expected to take more memory than the machine has."""
        need, has = self.memory(scene) / 1000, machine_memory() / 1000
        if self.restarts and need > has:
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

    def read(self, scene: Scene) -> tuple[dict[str, Any], tuple[str, ...]]:
        """Return what it reads of a scene as plain data, and by which sections and dotted keys."""
        keys = self.reads(scene)
        document = scene.read(keys)
        if self.outputs:
            document["outputs"] = [name for name in self.outputs if name in scene.outputs]
        return document, keys

    def needs_of(self, scene: Scene) -> dict[str, Need]:
        """Return the results that it takes for a scene, by the parameters of its function."""
        return {name: need for name, need in self.needs.items() if need.of(scene)}


def keys(*names: str) -> Callable[[Scene], tuple[str, ...]]:
    """Return the function that returns some sections and dotted keys for every scene."""
    return lambda scene: names


EXPORTS = {name: function for wing in wings() for name, function in wing.exports.items()}
"""Functions of the wings that write files for other programs, by the name of their stage."""


def _export(name: str, path: str, what: str, outputs: str, **known: Any) -> Stage:
    """Return a stage that writes a file for another program, of scenes with some outputs.

    Unless `known` says otherwise, scenes with a mesh have the stage that may have these outputs.
    """
    asked = set(outputs.split())
    usual: dict[str, Any] = {
        "reads": keys(*MODEL_KEYS),
        "code": ("use/decks", "use/vtu.py", *MODEL),
        "of": lambda scene: has_mesh(scene) and asked <= set(scene.kind.outputs),
        "needs": SOLIDS,
        "wanted": lambda scene: asked <= set(scene.outputs),
    }
    message = f"Write {what} of {{wildcards.scene}}"
    return Stage(name, path, message, later(EXPORTS.get(name, "")), **usual | known)


_STAGES = (
    Stage(
        name="geometry",
        path_pattern="geometry/{knit}.nc",
        message="Lay out {wildcards.knit}",
        function=later("knitstudy.knit.geometry.lay_out:lay_out"),
        reads=lambda scene: ("specimen", *scene.kind.specimen.geometry),
        code=("knit/geometry",),
        wanted=never,
        memory=lambda scene: 500,
    ),
    Stage(
        name="mesh",
        path_pattern="mesh/{scene}.nc",
        message="Mesh {wildcards.scene}",
        function=later("knitstudy.knit.mesh.mesher:mesh"),
        reads=keys("load.direction", "mesh.size", "mesh.growth", "mesh.refinement"),
        of=has_mesh,
        needs=GEOMETRY,
        code=MESH,
        wanted=never,
    ),
    Stage(
        name="rest",
        path_pattern="rest/{scene}.nc",
        message="Relax {wildcards.scene}",
        function=later("knitstudy.knit.models.beam.cell:relax"),
        reads=keys(*KIND, "yarn", "mesh", "contact.friction", "beam", "solver", "load.start"),
        of=starts_from_rest,
        needs=GEOMETRY,
        reports=True,
        queued=True,
        wanted=never,
        seconds=lambda scene: 60.0,
    ),
    Stage(
        name="simulation",
        path_pattern="simulation/{scene}.nc",
        message="Simulate {wildcards.scene}",
        function=later("knitstudy.knit.simulate:simulate"),
        reads=lambda scene: (*KIND, *scene.sections),
        outputs=("fields",),
        needs=SOLIDS
        | {
            "rest": Need("rest", where=starts_from_rest),
            "contacts": Need("contacts", key="rom.contacts_from"),
            "springs": Need("contacts", key="rom.springs_from"),
            "stresses": Need("stress", key="rom.stress_from"),
        },
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
        reads=keys(),
        of=lambda scene: scene.kind.fidelity.solid and scene.specimen != "cell",
        needs=GEOMETRY | HISTORY,
    ),
    Stage(
        name="stress",
        path_pattern="stress/{scene}.nc",
        message="Average the stress of {wildcards.scene}",
        function=later("knitstudy.knit.stress:stress"),
        reads=keys(*MODEL_KEYS),
        of=lambda scene: has_fields(scene) and scene.is_knit,
        needs=SOLIDS | HISTORY,
        memory=lambda scene: 1000 + expected_memory(scene) // 2,
    ),
)

_EXPORTS = (
    _export("mesh_vtu", "mesh/{scene}.vtu", "the mesh", "vtu", reads=keys("mesh.element")),
    _export(
        "series",
        "simulation/{scene}.pvd",
        "all increments",
        "vtu",
        of=always,
        needs=GEOMETRY | HISTORY | {"mesh": Need("mesh", where=has_fields)},
    ),
    _export("deck_abaqus", "mesh/{scene}.abaqus.inp", "the Abaqus deck", "deck"),
    _export("deck_calculix", "mesh/{scene}.calculix.inp", "the CalculiX deck", "deck"),
    _export(
        "shell_section",
        "simulation/{scene}.abaqus.inp",
        "the Abaqus shell section",
        "deck",
        reads=keys(),
        of=lambda scene: scene.specimen == "cell" and not scene.kind.interaction.touches,
        needs=HISTORY,
    ),
)

# All stages by their names, each after the stages that it needs; of exports those that a wing writes
STAGES = {
    stage.name: stage for stage in (*_STAGES, *(export for export in _EXPORTS if export.name in EXPORTS))
}


KEYS = "models/*/__init__.py"
"""Files of keys, whose values a digest of a scene has already: their code does not count."""


def code_digest(*rooms: str) -> str:
    """Return a digest of the bytes of all files in rooms: folders or files of this package.

    Examples
    --------
    >>> len(code_digest("knit/geometry"))
    16
    """
    return _digest(rooms, tuple(plugin_files()))


def physics_digest() -> str:
    """Return the digest of all that makes the numbers of meshes and simulations, without plugins."""
    return _digest(MODEL, ())


@cache
def _digest(rooms: tuple[str, ...], plugins: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for room in sorted(set(rooms)):
        path = PACKAGE / room
        inside = sorted(
            file for file in path.rglob("*") if file.suffix in (".py", ".tsv") and not file.match(KEYS)
        )
        for file in [path] if path.is_file() else inside:
            digest.update(f"{file.relative_to(PACKAGE).as_posix()}\n".encode() + file.read_bytes())
    for file in plugins:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
