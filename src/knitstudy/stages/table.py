"""The stages, each declared once: what it reads of a scene, what it needs, its function, and what it leaves.

Rules of the workflow, `simulate`, the command and the benchmarks all take them from here. A stage of one's own is added
with `STAGES.register`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psutil

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.mechanics.materials import LAWS
from knitstudy.registry import Registry

if TYPE_CHECKING:
    import xarray as xr

    from knitstudy.study.scene import Scene

Needs = Mapping[str, tuple[str, "Scene"]]
"""Results by the names that a function calls them: the stage that leaves each, and of which scene."""

MEGABYTE = 1e6

OF_SIZE = ("pattern.loops", "pattern.rows", "pair.length", "mesh.size", "mesh.crossing_degree")
"""Keys that memory goes with."""

KIND = ("specimen", "fidelity", "interaction")


@dataclass(frozen=True)
class Stage:
    """A step from a scene to its results.

    Attributes
    ----------
    name : str
        Of the stage and of its rule.
    does : str
        What it does, for people; ``{scene}`` stands for the scene.
    of : callable
        Whether a scene has this stage.
    reads : tuple of str
        Sections and dotted keys of the scene that its result depends on; the function sees no others.
    outputs : tuple of str
        Entries of the scene's outputs that its result depends on.
    needs : callable
        `Needs` of a scene; its second argument returns the scene that one of its keys names.
    function : str
        ``module:function``, called with the scene, the datasets that it needs by name, and for long stages ``run``
        (see `knitstudy.loading`); it returns a dataset. Where the stage leaves another format, it is called with
        ``path`` and writes that file.
    code : callable
        Modules that the function finds by names in the scene, whose code the result depends on as well.
    leaves : str
        Path of its result under the folder of results, with ``{scene}`` or ``{knit}``.
    wanted : callable
        Whether a study asks for it of a scene, beside what other stages need.
    long : bool
        Whether it takes a restart file, a place for a partial history, and progress.
    memory : callable
        Megabytes that it may take of a scene.
    priority : int
        Order among what is ready.
    """

    name: str
    does: str
    of: Callable[[Scene], bool]
    reads: tuple[str, ...]
    function: str
    leaves: str
    needs: Callable[[Scene, Callable[[str], Scene]], Needs] = lambda scene, named: {}
    outputs: tuple[str, ...] = ()
    code: Callable[[Scene], tuple[str, ...]] = lambda scene: ()
    wanted: Callable[[Scene], bool] = lambda scene: False
    long: bool = False
    memory: Callable[[Scene], int] = lambda scene: 1000
    priority: int = 0

    @property
    def module(self) -> str:
        """Dotted name of the module of its function."""
        return self.function.partition(":")[0]

    def load(self) -> Callable:
        """Return its function."""
        module, _, name = self.function.partition(":")
        return getattr(import_module(module), name)

    def make(self, scene: Scene, **needed: Any) -> xr.Dataset:
        """Return its result as a dataset, which says what it took of the processor: all threads, none that waits.

        Of a computation that went on after it was killed, that is since then.
        """
        function = self.load()
        started = time.process_time()
        dataset = function(scene, **needed)
        return dataset.assign_attrs(processor_seconds=time.process_time() - started)

    def require_machine(self, scene: Scene) -> None:
        """Refuse a scene that is expected to take more memory than the machine has.

        Raises
        ------
        ConfigurationError
            Saying what it would take, and what would do.
        """
        need, has = self.memory(scene), machine_memory()
        if need > has:
            said = ", ".join(
                f"{key} is {scene.value(key):g}" for key in OF_SIZE if scene.value(key) is not None
            )
            raise ConfigurationError(
                f"scene {scene.name!r}: {said}: the stage {self.name!r} would take some {need / 1000:.3g} GB, "
                f"and this machine has {has / 1000:.3g}; take a smaller specimen, larger elements, a lower degree, or "
                "solid yarns instead of hexahedra"
            )

    def path(self, scene: Scene) -> Path:
        """Return where it leaves its result, under the folder of results."""
        return Path(self.leaves.format(scene=scene.name, knit=scene.knit))

    def document(self, scene: Scene) -> dict:
        """Return what it reads of a scene: what the digest and the parameters of its rule are made of."""
        document = scene.read(self.reads)
        if self.outputs:
            document["outputs"] = [name for name in self.outputs if name in scene.outputs]
        return document


def machine_memory() -> int:
    """Return the memory of this machine [MB]."""
    return int(psutil.virtual_memory().total / MEGABYTE)


STAGES: Registry[Stage] = Registry("stage")


def stage_of(scene: Scene) -> Stage:
    """Return the stage that simulates a scene."""
    return STAGES.find(scene.kind.stage, f"scene {scene.name!r}")


def _solid(scene: Scene) -> bool:
    return scene.kind.stage == "dns"


def _cut(scene: Scene) -> bool:
    return scene.specimen == "cut_knit"


def _window(scene: Scene) -> bool:
    return scene.kind.fidelity.stage == "window"


def _expected(scene: Scene) -> int:
    """Return the megabytes of a direct simulation; who only lists stages does not import geometry."""
    return import_module("knitstudy.stages.memory").expected_memory(scene)


def _laws(scene: Scene) -> tuple[str, ...]:
    """Return the modules of what yarns are divided into, of the material and of the interaction of solid yarns."""
    contact = (scene.kind.interaction.solids,) if scene.kind.interaction.touches else ()
    name = scene.value("mesh.element")
    element = () if name is None else (ELEMENTS.module(name),)
    return (scene.kind.fidelity.solids, *element, LAWS.module(scene.yarn.material), *contact)


STAGES.register(
    Stage(
        name="geometry",
        does="Lay out {knit}",
        of=lambda scene: True,
        reads=(
            "specimen",
            "pattern",
            "pair.angle",
            "pair.length",
            "pair.clearance",
            "yarn.diameter",
            "geometry",
        ),
        function="knitstudy.geometry.lay_out:lay_out",
        leaves="geometry/{knit}.nc",
        memory=lambda scene: 500,
    )
)
STAGES.register(
    Stage(
        name="mesh",
        does="Mesh the yarns of {scene}",
        of=_solid,
        reads=("load.direction", "mesh.size", "mesh.growth", "mesh.refinement"),
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        function="knitstudy.mesh.knit:mesh",
        leaves="mesh/{scene}.nc",
    )
)
STAGES.register(
    Stage(
        name="dns",
        does="Load {scene}",
        of=_solid,
        reads=(*KIND, "pattern", "pair", "yarn", "load", "mesh", "tie", "contact", "solver", "gates"),
        outputs=("fields",),
        needs=lambda scene, named: {"geometry": ("geometry", scene), "mesh": ("mesh", scene)},
        function="knitstudy.models.solid_yarns:simulate",
        code=_laws,
        leaves="dns/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
        memory=lambda scene: _expected(scene),
        priority=10,  # on the longest path: before whatever else is ready
    )
)
STAGES.register(
    Stage(
        name="contacts",
        does="Find the contacts of {scene}",
        of=_solid,
        reads=(),
        needs=lambda scene, named: {"geometry": ("geometry", scene), "history": ("dns", scene)},
        function="knitstudy.contacts.contacts:contacts",
        leaves="contacts/{scene}.nc",
        wanted=lambda scene: True,
    )
)


def _with_fields(scene: Scene, named: Callable[[str], Scene]) -> Needs:
    """Return what deformed yarns and stresses come from; refuse a scene that does not keep its fields."""
    if "fields" not in scene.outputs:
        raise ConfigurationError(
            f"scene {scene.name!r}: outputs is [{', '.join(scene.outputs)}] but must hold 'fields':"
            " node_displacement, which deformed yarns and stresses come from, is kept with it"
        )
    return {"geometry": ("geometry", scene), "mesh": ("mesh", scene), "history": ("dns", scene)}


STAGES.register(
    Stage(
        name="stress",
        does="Average the stress of {scene}",
        of=lambda scene: _solid(scene) and scene.specimen == "knit" and "fields" in scene.outputs,
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "contact", "solver"),
        needs=_with_fields,
        function="knitstudy.models.stress:stress",
        code=_laws,
        leaves="stress/{scene}.nc",
        wanted=lambda scene: True,
        memory=lambda scene: 1000 + _expected(scene) // 2,
    )
)


def _joined(scene: Scene, named: Callable[[str], Scene]) -> Needs:
    """Return the contacts, springs and stresses that a reduced model takes of direct simulations, if it does."""
    sources = {
        "contacts": ("contacts", "rom.contacts_from"),
        "springs": ("contacts", "rom.springs_from"),
        "stresses": ("stress", "rom.stress_from"),
    }
    found = {name: (stage, named(key)) for name, (stage, key) in sources.items() if scene.value(key)}
    if "stresses" in found:
        _with_fields(found["stresses"][1], named)
    return {"geometry": ("geometry", scene)} | found


STAGES.register(
    Stage(
        name="rom",
        does="Pull the reduced model {scene}",
        of=lambda scene: scene.fidelity in ("rom2d", "rom3d"),
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "solver", "gates", "rom"),
        needs=_joined,
        function="knitstudy.models.reduced_models:simulate",
        leaves="rom/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
        memory=lambda scene: 500,
    )
)
STAGES.register(
    Stage(
        name="beams",
        does="Pull the beams in contact of {scene}",
        of=lambda scene: scene.fidelity == "beam",
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "contact", "solver", "gates", "beam"),
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        function="knitstudy.models.beams_in_contact:simulate",
        leaves="beams/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
    )
)
STAGES.register(
    Stage(
        name="cut_knit",
        does="Pull the cells cut out of a knit {scene}",
        of=_cut,
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "contact", "solver", "gates"),
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        function="knitstudy.models.pieces:simulate_cut_knit",
        code=_laws,
        leaves="cut_knit/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
        memory=lambda scene: _expected(scene),
    )
)
STAGES.register(
    Stage(
        name="cut_knit_contacts",
        does="Find the contacts of {scene}",
        of=_cut,
        reads=(),
        needs=lambda scene, named: {"geometry": ("geometry", scene), "history": ("cut_knit", scene)},
        function="knitstudy.models.pieces:contacts_of_cut_knit",
        leaves="cut_knit_contacts/{scene}.nc",
        wanted=lambda scene: True,
    )
)
STAGES.register(
    Stage(
        name="cell",
        does="Deform the cell {scene}",
        of=lambda scene: scene.specimen == "cell",
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "contact", "solver", "gates"),
        needs=lambda scene, named: {"geometry": ("geometry", scene)},
        function="knitstudy.models.cell:simulate",
        code=_laws,
        leaves="cell/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
        memory=lambda scene: _expected(scene),
    )
)
STAGES.register(
    Stage(
        name="cell_deck",
        does="Write the shell section of {scene}",
        of=lambda scene: scene.specimen == "cell" and not scene.kind.interaction.touches,
        reads=(),
        needs=lambda scene, named: {"history": ("cell", scene)},
        function="knitstudy.exchange.inp:write_shell",
        leaves="cell/{scene}.abaqus.inp",
        wanted=lambda scene: "deck" in scene.outputs,
    )
)


def _in_springs(scene: Scene, named: Callable[[str], Scene]) -> Needs:
    """Return the contacts whose springs stand for those outside of a window, where yarns touch."""
    springs = {"springs": ("contacts", named("window.springs_from"))} if scene.window.springs_from else {}
    return {"geometry": ("geometry", scene)} | springs


def _laws_of_window(scene: Scene) -> tuple[str, ...]:
    """Return the modules of the material and of the interaction of the solid yarns in a window."""
    contact = (scene.kind.interaction.solids,) if scene.kind.interaction.touches else ()
    return (LAWS.module(scene.yarn.material), *contact)


STAGES.register(
    Stage(
        name="window",
        does="Pull the knit with a window {scene}",
        of=_window,
        reads=(*KIND, "pattern", "yarn", "load", "mesh", "tie", "contact", "solver", "gates", "window"),
        needs=_in_springs,
        function="knitstudy.models.window:simulate",
        code=_laws_of_window,
        leaves="window/{scene}.nc",
        wanted=lambda scene: True,
        long=True,
        memory=lambda scene: 1500,
    )
)
STAGES.register(
    Stage(
        name="window_contacts",
        does="Find the contacts in the window of {scene}",
        of=_window,
        reads=(),
        needs=lambda scene, named: {"geometry": ("geometry", scene), "history": ("window", scene)},
        function="knitstudy.models.window_contacts:contacts",
        leaves="window_contacts/{scene}.nc",
        wanted=lambda scene: True,
    )
)


STAGES.register(
    Stage(
        name="mesh_vtu",
        does="Write the mesh of {scene} for ParaView",
        of=_solid,
        reads=("mesh.element",),
        needs=lambda scene, named: {"geometry": ("geometry", scene), "mesh": ("mesh", scene)},
        function="knitstudy.exchange.vtu:write_mesh",
        leaves="mesh/{scene}.vtu",
        wanted=lambda scene: "vtu" in scene.outputs,
    )
)
STAGES.register(
    Stage(
        name="dns_vtu",
        does="Write the deformed yarns of {scene} for ParaView",
        of=_solid,
        reads=(*KIND, "pattern", "pair", "yarn", "load", "mesh", "tie", "contact"),
        needs=_with_fields,
        function="knitstudy.exchange.vtu:write_deformed",
        leaves="dns/{scene}.vtu",
        wanted=lambda scene: {"fields", "vtu"} <= set(scene.outputs),
    )
)
for dialect in ("abaqus", "calculix"):
    STAGES.register(
        Stage(
            name=f"deck_{dialect}",
            does=f"Write the {dialect} deck of {{scene}}",
            of=lambda scene: _solid(scene) and "deck" in scene.kind.outputs,
            reads=(*KIND, "pattern", "pair", "yarn", "load", "mesh", "tie", "contact", "solver"),
            needs=lambda scene, named: {"geometry": ("geometry", scene), "mesh": ("mesh", scene)},
            function=f"knitstudy.exchange.inp:write_{dialect}",
            leaves=f"mesh/{{scene}}.{dialect}.inp",
            wanted=lambda scene: "deck" in scene.outputs,
        )
    )
