"""Results of the scenes of a configuration: what each is made from, and the digest that decides whether it is old."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import CONFIG
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.registry import find
from knitstudy.run.configuration import SPRINGS, check_source, gives_springs, knits_of, scenes_at_need
from knitstudy.run.stages import STAGES, Stage, code_digest

DIGITS = 8  # Digits of a hash in the name of a scene or knit that the configuration does not have


@dataclass(frozen=True, eq=False)
class Step:
    """A result of a scene by a stage, and all that it is made from; `Plan.step` makes it.

    Attributes
    ----------
    needs : mapping of str to Step
        Results that the stage takes, by the parameters of its function.
    sources : mapping of str to Scene
        Scenes that the scene names, by name.
    seen : Scene
        The scene with the keys alone that the stage reads.
    path : Path
        Of the result, under the folder of results.
    digest : str
        Of the keys and the code that the result depends on, and of its needs. It decides which results are made again,
        by the workflow and by `simulate`.
    """

    stage: Stage
    scene: Scene
    needs: Mapping[str, Step]
    sources: Mapping[str, Scene]
    seen: Scene
    path: Path
    digest: str

    def __str__(self) -> str:
        return f"{self.stage.name} {self.scene.name}"


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
        self.scenes, self.configured = scenes, scenes if configured is None else configured
        self.knits = knits_of(self.configured) if knits is None else knits
        self._steps: dict[
            tuple[str, int], Step
        ] = {}  # by stage and identity of the scene, which a step holds

    @classmethod
    def of(cls, config: Path = CONFIG) -> Plan:
        """Return the plan of a configuration folder, whose scenes are read when they are asked for."""
        scenes, knits = scenes_at_need(config)
        return cls(scenes, knits=knits)

    @classmethod
    def with_scenes(cls, own: Mapping[str, Scene], config: Path = CONFIG) -> Plan:
        """Return the plan `of` a folder, and of scenes from elsewhere, which never replace its own."""
        configured, knits = scenes_at_need(config)
        return cls(_over(own, configured), configured, knits)

    def step(self, stage: str, scene: Scene) -> Step:
        """Return the result of a scene by the name of its stage.

        A scene that names another one that does not exist or does not fit raises a ConfigurationError.
        """
        known = self._steps.get((stage, id(scene)))
        if known is None:
            known = self._steps[stage, id(scene)] = self._step(STAGES[stage], scene)
        return known

    def _step(self, stage: Stage, scene: Scene) -> Step:
        path, (document, keys) = stage.path(scene), stage.read(scene)
        needs = {
            name: self.step(need.stage, self.named(scene, need.key) if need.key else scene)
            for name, need in stage.needs_of(scene).items()
        }
        digests = {name: need.digest for name, need in needs.items()}
        of = {"stage": stage.name, "reads": document, "code": code_digest(*stage.code), "needs": digests}
        named = filter(None, map(scene.value, scene.kind.fidelity.sources))
        sources = {name: self.scenes[name] for name in named if name in self.scenes}
        return Step(stage, scene, needs, sources, scene.only(document, keys), path, digest(of))

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
        """Return the direct simulation that a key of a scene names, with the geometry of that scene.

        If springs are measured in it, it takes the scene's yarn and strain as well.
        """
        name, scenes = scene.value(key), self.scenes
        if (other := scenes.get(name)) is not None:
            inputs, changed = scene.geometry_inputs, {}
            if any(other.geometry_inputs.get(key) != inputs[key] for key in inputs):
                changed = inputs | {"knit": scene.knit}
            if gives_springs(scene, key):
                given = {of: scene.value(of) for of in SPRINGS}
                changed |= {of: value for of, value in given.items() if value not in (None, other.value(of))}
                if strain := changed.get("load.strain"):
                    changed["load.stops"] = [
                        stop for stop in other.value("load.stops") if 0 < stop / strain < 1
                    ]
            if changed:
                scenes = _over({name: other.vary(changed)}, scenes)
        check_source(scene, key, scenes, f"scene {scene.name!r}")
        return self.labelled(scenes[name])

    def labelled(self, scene: Scene) -> Scene:
        """Return a scene under labels of its own where the configuration gives its labels to other keys.

        A changed scene must not take the place of the one that it was made from: its name, and the label of its knit
        where the geometry has changed, end with digits of their hash.
        """
        named, knit = self.configured.get(scene.name), self.knits.get(scene.knit)
        labels = {}
        if named is not None and named.hash != scene.hash:
            labels["name"] = f"{scene.name}-{scene.hash[:DIGITS]}"
        if knit is not None and knit.geometry_key != scene.geometry_key:
            labels["knit"] = f"{scene.knit}-{scene.geometry_key[:DIGITS]}"
        return scene.labelled(labels) if labels else scene


def _over(own: Mapping[str, Scene], others: Mapping[str, Scene]) -> Mapping[str, Scene]:
    """Return scenes by name, the own ones first."""
    return ChainMap(dict(own), others)  # type: ignore[arg-type]  # which nothing writes to
