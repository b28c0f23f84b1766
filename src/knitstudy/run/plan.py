"""Results of the scenes of a configuration: what each is made from, and the digest that decides whether it is old."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.knit.scene.scene import NAMELESS, Scene, digest
from knitstudy.registry import find
from knitstudy.run.code_digest import code_digest
from knitstudy.run.configuration import knits_of, lazy_scenes
from knitstudy.run.cost import Cost, machine_memory
from knitstudy.run.sources import Source
from knitstudy.run.stages import STAGES, Stage

DIGITS = 8  # Digits of a hash in the name of a scene or knit that the configuration does not have


OF_SIZE = ("pattern.loops", "pattern.rows", "pair.length", "mesh.size", "mesh.crossing_degree")
"""Keys that memory depends on."""


@dataclass(frozen=True, eq=False)
class Step:
    """A result of a scene by a stage, and all that it is made from; `Plan.step` makes it."""

    stage: Stage
    scene: Scene
    needs: Mapping[str, Step]  # results that the stage takes, by the parameters of its function
    sources: Mapping[str, Scene]  # that the scene names, by name

    def __str__(self) -> str:
        return f"{self.stage.name} {self.scene.name}"

    @cached_property
    def path(self) -> Path:
        """Path of the result, under the folder of results."""
        return self.stage.path(self.scene.knit if self.stage.label == "{knit}" else self.scene.name)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """Sections and dotted keys of the scene that the stage reads."""
        return self.stage.reads(self.scene)

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """What the stage reads of the scene, as plain data."""
        inputs = self.scene.read(self.keys)
        if self.stage.outputs:
            inputs["outputs"] = [name for name in self.stage.outputs if name in self.scene.outputs]
        return inputs

    @cached_property
    def seen(self) -> Scene:
        """The scene with the keys alone that the stage reads."""
        return self.scene.only(self.inputs, self.keys)

    @cached_property
    def digest(self) -> str:
        """Digest of the keys and the code that the result depends on, and of its needs.

        It decides which results are made again, by the workflow and by `simulate`.
        """
        code = code_digest(*self.stage.code)
        needs = {name: need.digest for name, need in self.needs.items()}
        return digest({"stage": self.stage.name, "reads": self.inputs, "code": code, "needs": needs})

    @property
    def wanted(self) -> bool:
        """Whether a study asks for the result, in addition to the inputs of stages."""
        return not self.stage.intermediate and self.stage.asked_by <= set(self.scene.outputs)

    @cached_property
    def cost(self) -> Cost:
        """Memory and time that it is expected to take."""
        return self.stage.cost(self.scene)

    def require_machine(self) -> None:
        """Refuse a long run that is expected to take more memory than the machine has."""
        if not self.stage.restarts or self.cost.memory <= machine_memory():
            return
        sizes = {key: self.scene.value(key) for key in OF_SIZE}
        text = ", ".join(f"{key} is {value:g}" for key, value in sizes.items() if value is not None)
        need = self.cost.memory / 1000
        has = machine_memory() / 1000
        much = f"the stage {self.stage.name!r} would take some {need:.3g} GB, and this machine has {has:.3g}"
        remedy = "take a smaller specimen"
        if self.scene.kind.fidelity.solid:
            remedy += ", larger elements, a lower degree, or spline yarns instead of hexahedra"
        raise ConfigurationError(f"scene {self.scene.name!r}: {text}: {much}; {remedy}")


class Plan:
    """The results of scenes.

    Other scenes can name the scenes `scenes`. Scenes of the configuration, `configured`, keep their labels (by default
    they are the same scenes); `knits` has the first of them of every geometry, by its label.
    """

    def __init__(
        self,
        scenes: Mapping[str, Scene],
        configured: Mapping[str, Scene] | None = None,
        knits: Mapping[str, Scene] | None = None,
    ) -> None:
        self.scenes = scenes
        self.configured = scenes if configured is None else configured
        self.knits = knits_of(self.configured) if knits is None else knits
        # By stage and identity of the scene, which is kept so that no other one has its identity
        self._steps: dict[tuple[str, int], tuple[Scene, Step]] = {}
        self._shared: dict[str, Step] = {}  # of stages that scenes share, by digest

    @classmethod
    def of(cls, config: Path = CONFIG) -> Plan:
        """Return the plan of a configuration folder, whose scenes are read when they are asked for."""
        scenes, knits = lazy_scenes(config)
        return cls(scenes, knits=knits)

    @classmethod
    def with_scenes(cls, own: Mapping[str, Scene], config: Path = CONFIG) -> Plan:
        """Return the plan `of` a folder, and of scenes from elsewhere, which never replace its own."""
        configured, knits = lazy_scenes(config)
        scenes = ChainMap(dict(own), configured)  # type: ignore[arg-type]  # which nothing writes to
        return cls(scenes, configured, knits)

    def step(self, stage: str, scene: Scene) -> Step:
        """Return the result of a scene by the name of its stage.

        A scene that names another one that does not exist or does not fit raises a ConfigurationError.
        """
        if (stage, id(scene)) in self._steps:
            return self._steps[stage, id(scene)][1]
        needs = {}
        for name, need in STAGES[stage].needs.items():
            if not need.key and STAGES[need.stage].of(scene) and need.where(scene):
                needs[name] = self.step(need.stage, scene)
            elif need.key and scene.value(need.key):
                needs[name] = self.step(need.stage, self.named(scene, need.key))
        named = filter(None, map(scene.value, scene.kind.fidelity.sources))
        sources = {name: self.scenes[name] for name in named if name in self.scenes}
        made = Step(STAGES[stage], scene, needs, sources)
        if made.stage.shared:
            made = self._shared.setdefault(made.digest, made)
        self._steps[stage, id(scene)] = scene, made
        return made

    def steps_of(self, scene: Scene) -> dict[str, Step]:
        """Return all results of a scene by the names of their stages, each after its inputs."""
        return {name: self.step(name, scene) for name, stage in STAGES.items() if stage.of(scene)}

    def step_of(self, stage: str, label: str) -> Step:
        """Return a result by the label in the name of its file, that of a knit or of a scene.

        Raises ConfigurationError where there is none.
        """
        if STAGES[stage].label == "{knit}":
            return self.step(stage, find("knit", self.knits, label))
        scene = find("scene", self.scenes, label)
        if not STAGES[stage].of(scene):
            raise ConfigurationError(f"the scene {label!r} has no {stage}")
        return self.step(stage, scene)

    def steps(self, scenes: Iterable[Scene]) -> list[Step]:
        """Return all results of scenes, each path once and after its inputs."""
        scenes = list(scenes)
        steps = [
            self.step(name, scene) for name, stage in STAGES.items() for scene in scenes if stage.of(scene)
        ]
        return list({step.path: step for step in steps}.values())

    def named(self, scene: Scene, key: str) -> Scene:
        """Return the direct simulation that a key of a scene names, with the geometry of that scene; see `Source`."""
        source = Source.of(scene, key, self.scenes, f"scene {scene.name!r}").adapted()
        source.check()
        return self.labelled(source.other)

    def labelled(self, scene: Scene) -> Scene:
        """Return a scene under labels of its own where the configuration gives its labels to other keys.

        A changed scene must not take the place of the one that it was made from: its name, and the label of its knit
        where the geometry has changed, end with digits of their hash. So do those of scenes that nobody has named.
        """
        new = NAMELESS not in self.configured and scene.name == NAMELESS
        named = _correct(self.configured, scene.name, scene)
        knit = _correct(self.knits, scene.knit, scene)
        return with_digits(
            scene,
            new or named is None or named.hash != scene.hash,
            new or knit is None or knit.geometry_key != scene.geometry_key,
        )


def _correct(scenes: Mapping[str, Scene], name: str, default: Scene) -> Scene | None:
    """Return a scene by its name, or the default if there is none; None where it is wrong, or no model answers it."""
    try:
        return scenes.get(name, default)
    except KnitstudyError:
        return None


def with_digits(scene: Scene, name: bool = True, knit: bool = True) -> Scene:
    """Return a scene with digits of their hash behind its name, and behind the label of its knit; both may be cut."""
    labels = {"name": f"{scene.name[: 199 - DIGITS]}-{scene.hash[:DIGITS]}"} if name else {}
    labels |= {"knit": f"{scene.knit[: 199 - DIGITS]}-{scene.geometry_key[:DIGITS]}"} if knit else {}
    return scene.labelled(labels) if labels else scene
