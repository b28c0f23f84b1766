"""Which results there are of the scenes of a configuration, what each is made from, and the digest that it has then."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path

from knitstudy.errors import DataFileError
from knitstudy.files import recorded_digest
from knitstudy.stages.code import code_digest
from knitstudy.stages.table import STAGES, Stage
from knitstudy.study.configuration import CONFIG, OWN, check_source, knits_of, load_scenes
from knitstudy.study.scene import Scene, digest

log = logging.getLogger(__name__)

DIGITS = 8
"""Digits of a hash in the name of a scene or knit that the configuration does not have."""

Step = tuple[Stage, Scene]


def digest_of(stage: Stage, document: Mapping, scene: Scene, needed: Mapping[str, str]) -> str:
    """Return the digest of a result: of what its stage reads, of the code behind it, and of what it is made from.

    Two results of one digest are the same. It decides whether a result is up to date, for the workflow as for the
    command.

    Parameters
    ----------
    stage : Stage
    document : mapping
        What the stage reads of the scene (`Stage.document`).
    scene : Scene
        Chooses modules of code by its kind.
    needed : mapping of str to str
        Digests of what it is made from.
    """
    code = code_digest(*stage.modules(scene))
    return digest({"stage": stage.name, "reads": document, "code": code, "needs": dict(needed)})


def digest_or_warning(path: Path) -> str:
    """Return the digest that a result was written with; nothing, and a warning, where it cannot be read.

    What cannot be read is not up to date: it is made again.
    """
    try:
        return recorded_digest(path)
    except DataFileError as error:
        log.warning("%s; it will be made again", error)
        return ""


class Plan:
    """The results of scenes.

    Attributes
    ----------
    scenes : dict of str to Scene
        Of the configuration.
    knits : dict of str to Scene
        The first scene of every knit or pair: the geometry of all that share a label is the same.
    """

    def __init__(self, scenes: Mapping[str, Scene]) -> None:
        self.scenes = dict(scenes)
        self.knits = knits_of(self.scenes)
        self._digests: dict[Path, str] = {}

    @classmethod
    def of(cls, config: Path = CONFIG) -> Plan:
        """Return the plan of a configuration folder."""
        return cls(load_scenes(config))

    def needs(self, stage: Stage, scene: Scene) -> dict[str, Step]:
        """Return what a result is made from, by the names that its function calls them.

        Raises
        ------
        ConfigurationError
            If the scene names another one that there is not, or that does not go with it.
        """
        found = stage.needs(scene, lambda key: self.named(scene, key))
        return {name: (STAGES[other], of) for name, (other, of) in found.items()}

    def digest(self, stage: Stage, scene: Scene) -> str:
        """Return the digest that a result has when it is up to date."""
        path = stage.path(scene)
        if path not in self._digests:
            needed = {name: self.digest(*step) for name, step in self.needs(stage, scene).items()}
            self._digests[path] = digest_of(stage, stage.document(scene), scene, needed)
        return self._digests[path]

    def is_up_to_date(self, stage: Stage, scene: Scene, results: Path) -> bool:
        """Whether a result is there, in a folder of results, with the digest that it should have."""
        path = results / stage.path(scene)
        return path.is_file() and digest_or_warning(path) == self.digest(stage, scene)

    def steps(self, scenes: Iterable[Scene]) -> list[Step]:
        """Return everything that may be made of scenes, each path once and after what it is made from."""
        scenes = list(scenes)
        found = {
            stage.path(scene): (stage, scene)
            for stage in STAGES.values()
            for scene in scenes
            if stage.of(scene)
        }
        return list(found.values())

    def wanted(self, scenes: Iterable[Scene]) -> list[Path]:
        """Return what a study of scenes consists of."""
        return [stage.path(scene) for stage, scene in self.steps(scenes) if stage.wanted(scene)]

    def named(self, scene: Scene, key: str) -> Scene:
        """Return the direct simulation that a key of a scene names, with the geometry of that scene.

        What `OWN` says of the key stays that simulation's own: a knit of another size has the same loops.
        """
        name, scenes, own = scene.value(key), self.scenes, OWN.get(key, ())
        other = scenes.get(name)
        inputs = {name: value for name, value in scene.geometry_inputs.items() if name not in own}
        if other is not None and any(other.geometry_inputs.get(each) != inputs[each] for each in inputs):
            knit = other.knit if own else scene.knit
            scenes = scenes | {name: other.vary(inputs | {"knit": knit})}
        check_source(scene, key, scenes, f"scene {scene.name!r}")
        return self.labelled(scenes[name])

    def labelled(self, scene: Scene) -> Scene:
        """Return a scene under labels of its own where the configuration gives its labels to other keys.

        A changed scene must not take the place of the one that it was made from: its name, and the label of its knit
        where the geometry has changed, end with digits of their hash.
        """
        named, knit = self.scenes.get(scene.name), self.knits.get(scene.knit)
        labels = {}
        if named is not None and named.hash != scene.hash:
            labels["name"] = f"{scene.name}-{scene.hash[:DIGITS]}"
        if knit is not None and knit.geometry_key != scene.geometry_key:
            labels["knit"] = f"{scene.knit}-{scene.geometry_key[:DIGITS]}"
        return scene.vary(labels) if labels else scene
