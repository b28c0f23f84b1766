"""The stages, each declared once: the keys that it reads, its inputs, its function, its file, and its code.

    geometry -> mesh, rest -> simulation, bending -> contacts, stress -> exports

The rules of the workflow, `simulate`, the command and the benchmarks take the stages from `STAGES`. The code behind a
result counts by the packages that its stage declares (`code_digest`). Files of loaded plugins always count.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from knitstudy.knit.scene.alternatives import SECTIONS
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import lazy_import, optional_packages
from knitstudy.run.code_digest import MESH, MODEL
from knitstudy.run.cost import Cost, expected_cost

KIND = ("specimen", "fidelity", "interaction")
REPEATS = ("pattern.stitches", "pattern.loops", "pattern.rows")
TOLERANCES = ("solver.residual_tolerance", "solver.correction_tolerance")
MODEL_KEYS = (*KIND, "pattern", "pair", *SECTIONS, "load", "mesh", "tie", "contact", "solver")

Check = Callable[[Scene], bool]


@dataclass(frozen=True)
class Need:
    """A result that a stage takes: of the same scene if that has the stage, or of the scene that a dotted key names."""

    stage: str
    key: str = ""
    where: Check = lambda scene: True  # of the scenes that have the stage, those that need it


GEOMETRY = {"geometry": Need("geometry")}
SOLIDS = GEOMETRY | {"mesh": Need("mesh")}
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
    of: Check = lambda scene: True  # whether a scene has this stage
    needs: Mapping[str, Need] = field(default_factory=dict)  # by the parameters of the function
    code: tuple[str, ...] = MODEL  # packages and files whose code makes the result
    outputs: tuple[str, ...] = ()  # entries of the scene's outputs that the result depends on
    intermediate: bool = False  # whether a study asks for it only as the input of another stage
    asked_by: frozenset[str] = frozenset()  # outputs of the scene without which no study asks for it
    reports: bool = False  # whether its function takes a run, for its progress
    restarts: bool = False  # whether the run has a restart file as well
    shared: bool = False  # whether scenes that it reads the same of have one file, that of the first one
    queued: bool = False  # whether a cluster's queue runs it; others take seconds
    cost: Callable[[Scene], Cost] = lambda scene: Cost()  # expected

    @property
    def is_dataset(self) -> bool:
        """Whether its result is a netCDF file, which records its inputs."""
        return self.path_pattern.endswith(".nc")

    @property
    def label(self) -> str:
        """The wildcard of its file, which names the file of its log: {scene} or {knit}."""
        return "{knit}" if "{knit}" in self.path_pattern else "{scene}"

    def path(self, name: str) -> Path:
        """Return the path of a result under the folder of results, by the name that its `label` stands for."""
        return Path(self.path_pattern.replace(self.label, name))


EXPORTS = {name: function for package in optional_packages() for name, function in package.exports.items()}
"""Functions of the optional packages that write files for other programs, by the name of their stage."""


def has_fields(scene: Scene) -> bool:
    """Whether the history of a scene keeps the displacements of a mesh, which stresses and pictures come from."""
    return scene.kind.direct and "fields" in scene.outputs


def _export(name: str, path: str, what: str, output: str, **known: Any) -> Stage:
    """Return a stage that writes a file for another program, of scenes with an output.

    Unless `known` says otherwise, scenes with a mesh have the stage that may have this output, and cells of solid yarns
    in contact their deck.
    """
    usual: dict[str, Any] = {
        "reads": lambda scene: MODEL_KEYS,
        "code": ("use/decks", "use/vtu.py", *MODEL),
        "of": lambda scene: (
            output in scene.kind.outputs
            and (
                scene.kind.direct
                or (output == "deck" and scene.kind.fidelity.solid and scene.kind.interaction.touches)
            )
        ),
        "needs": SOLIDS,
        "asked_by": frozenset({output}),
    }
    message = f"Write {what} of {{wildcards.scene}}"
    return Stage(name, path, message, lazy_import(EXPORTS.get(name, "")), **usual | known)


_STAGES = (
    Stage(
        name="geometry",
        path_pattern="geometry/{knit}.nc",
        message="Lay out {wildcards.knit}",
        function=lazy_import("knitstudy.knit.geometry.lay_out:lay_out"),
        reads=lambda scene: ("specimen", *scene.of_geometry),
        code=("knit/geometry",),
        intermediate=True,
        cost=lambda scene: Cost(memory=500),
    ),
    Stage(
        name="mesh",
        path_pattern="mesh/{scene}.nc",
        message="Mesh {wildcards.scene}",
        function=lazy_import("knitstudy.knit.mesh.mesher:mesh"),
        reads=lambda scene: ("load.direction", "mesh.size", "mesh.refinement"),
        of=lambda scene: scene.kind.direct,
        needs=GEOMETRY,
        code=MESH,
        intermediate=True,
    ),
    Stage(
        name="rest",
        path_pattern="rest/{scene}.nc",
        message="Relax {wildcards.scene}",
        function=lazy_import("knitstudy.knit.models.beam.rest:relax"),
        reads=lambda scene: (
            *KIND,
            *SECTIONS,
            *REPEATS,
            "mesh",
            "contact.friction",
            "beam",
            *TOLERANCES,
            "load.start",
            "gates.overlap",
        ),
        of=lambda scene: scene.value("load.start") not in (None, "drawn"),
        needs=GEOMETRY,
        intermediate=True,
        shared=True,
        reports=True,
        queued=True,
        cost=lambda scene: Cost(seconds=60.0),
    ),
    Stage(
        name="bending",
        path_pattern="bending/{scene}.nc",
        message="Bend {wildcards.scene}",
        function=lazy_import("knitstudy.knit.models.beam.bending:bend"),
        reads=lambda scene: (*KIND, *scene.sections),
        of=lambda scene: scene.specimen == "cell" and scene.fidelity == "beam",
        needs=GEOMETRY | {"rest": Need("rest")},
        intermediate=True,
        reports=True,
        queued=True,
        cost=lambda scene: Cost(seconds=60.0),
    ),
    Stage(
        name="simulation",
        path_pattern="simulation/{scene}.nc",
        message="Simulate {wildcards.scene}",
        function=lazy_import("knitstudy.knit.simulate:simulate"),
        reads=lambda scene: (*KIND, *scene.sections),
        outputs=("fields",),
        needs=SOLIDS
        | {
            "rest": Need("rest"),
            "contacts": Need("contacts", key="rom.contacts_from"),
            "springs": Need("contacts", key="rom.springs_from"),
            "stresses": Need("stress", key="rom.stress_from"),
        },
        reports=True,
        restarts=True,
        queued=True,
        cost=expected_cost,
    ),
    Stage(
        name="contacts",
        path_pattern="contacts/{scene}.nc",
        message="Find the contacts of {wildcards.scene}",
        function=lazy_import("knitstudy.knit.contacts.contacts:contacts"),
        reads=lambda scene: (),
        of=lambda scene: scene.kind.fidelity.solid and scene.specimen != "cell",
        needs=GEOMETRY | HISTORY,
    ),
    Stage(
        name="stress",
        path_pattern="stress/{scene}.nc",
        message="Average the stress of {wildcards.scene}",
        function=lazy_import("knitstudy.knit.stress:stress"),
        reads=lambda scene: MODEL_KEYS,
        of=lambda scene: has_fields(scene) and scene.is_knit,
        needs=SOLIDS | HISTORY,
        cost=lambda scene: Cost(memory=1000 + expected_cost(scene).memory // 2),
    ),
)

_EXPORTS = (
    _export("mesh_vtu", "mesh/{scene}.vtu", "the mesh", "vtu", reads=lambda scene: ("mesh.element",)),
    _export(
        "series",
        "simulation/{scene}.pvd",
        "all increments",
        "vtu",
        of=lambda scene: True,
        needs=GEOMETRY | HISTORY | {"mesh": Need("mesh", where=has_fields)},
    ),
    _export("deck_abaqus", "mesh/{scene}.abaqus.inp", "the Abaqus deck", "deck"),
    _export("deck_calculix", "mesh/{scene}.calculix.inp", "the CalculiX deck", "deck"),
    _export(
        "shell_section",
        "simulation/{scene}.abaqus.inp",
        "the Abaqus shell section",
        "deck",
        reads=lambda scene: (),
        of=lambda scene: scene.specimen == "cell" and not scene.kind.interaction.touches,
        needs=HISTORY,
    ),
)

# All stages by their names, each after the stages that it needs; exports where an optional package writes them
STAGES = {
    stage.name: stage for stage in (*_STAGES, *(export for export in _EXPORTS if export.name in EXPORTS))
}
