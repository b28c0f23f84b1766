"""Results of the scenes of a configuration: their inputs, and which of them are up to date."""

from __future__ import annotations

import logging
from collections import ChainMap
from collections.abc import Iterable, Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from knitstudy.errors import ConvergenceError, DataFileError, EndedEarly
from knitstudy.files import read_dataset, read_result, recorded_digest, write_dataset
from knitstudy.knit.loading.run import IN_MEMORY, Run
from knitstudy.knit.scene.scene import Scene, digest
from knitstudy.mechanics.batches import serial_blas
from knitstudy.run.code import code_digest
from knitstudy.run.configuration import CONFIG, SPRINGS, check_source, knits_of, measures, scenes_at_need
from knitstudy.run.record import Record
from knitstudy.run.stages import STAGES, Stage

if TYPE_CHECKING:  # a job that needs no dataset starts in half the time
    import xarray as xr

log = logging.getLogger(__name__)

DIGITS = 8  # Digits of a hash in the name of a scene or knit that the configuration does not have

Step = tuple[Stage, Scene]


def digest_or_warning(path: Path) -> str:
    """Return the digest that a result was written with; an empty text, and a warning, where the file cannot be used."""
    try:
        return recorded_digest(path)
    except DataFileError as error:
        log.warning("%s; it will be made again", error)
        return ""


def result_of(path: Path, wanted: str) -> xr.Dataset | None:
    """Return the dataset of a file if it is complete and was written with a digest; a file that is damaged warns."""
    if digest_or_warning(path) != wanted:
        return None
    try:
        return read_result(path)
    except DataFileError as error:
        log.warning("%s", error)
        return None


def make(
    stage: Stage,
    scene: Scene,
    needed: Mapping[str, xr.Dataset],
    path: Path | None,
    wanted: str,
    run: Run = IN_MEMORY,
    record: Record | None = None,
) -> xr.Dataset | None:
    """Make a result, write it with its digest if there is a path, and then delete the restart file.

    The function sees the keys of `scene` alone; the `record` in the file has all of them.

    A history that ends before full load has a file of its own, and is not computed again for the same digest.
    Raises EndedEarly where it is there.
    """
    if not stage.is_dataset:
        return stage.function(scene, path=path, **needed)
    record = record or Record(stage.name, scene, {})
    if path is not None:
        _require_open_end(path, wanted)
    try:
        with serial_blas():  # the last bits of its sums depend on its threads
            dataset = stage.make(scene, **needed, **({"run": run} if stage.reports else {}))
    except ConvergenceError as error:
        if path is None or error.history is None:
            raise
        write_dataset(record.describe(error.history), kept_of(path), scene.name, wanted)
        run.forget()
        _require_open_end(path, wanted)
    dataset = record.describe(dataset)
    if path is not None:
        write_dataset(dataset, path, scene.name, wanted)
        kept_of(path).unlink(missing_ok=True)
        run.forget()
    return dataset


def kept_of(path: Path) -> Path:
    """Return the file of a history that ended before full load, next to that of a whole one."""
    return path.with_suffix(".incomplete.nc")


def _require_open_end(path: Path, wanted: str) -> None:
    """Refuse a result that is known to end early."""
    if why := why_incomplete(path, wanted):
        kept = kept_of(path)
        raise EndedEarly(f"{why} The curve up to there is in {kept}; to compute it again, delete it")


def why_incomplete(path: Path, wanted: str) -> str:
    """Return where and why the history of a digest ended before full load; an empty text where none did."""
    try:
        known = read_dataset(kept_of(path)).attrs if kept_of(path).is_file() else {}
    except DataFileError:
        return ""
    return f"{known['incomplete'].rstrip('.')}." if known.get("digest") == wanted else ""


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
        self._digests: dict[Path, str] = {}

    @classmethod
    def of(cls, config: Path = CONFIG) -> Plan:
        """Return the plan of a configuration folder, whose scenes are read when they are asked for."""
        scenes, knits = scenes_at_need(config)
        return cls(scenes, knits=knits)

    @classmethod
    def with_scenes(cls, own: Mapping[str, Scene], config: Path = CONFIG) -> Plan:
        """Return the plan `of` a folder, and of scenes from elsewhere, which never replace its own."""
        configured, knits = scenes_at_need(config)
        return cls(ChainMap(own, configured), configured, knits)

    def record(self, stage: Stage, scene: Scene) -> Record:
        """Return the record of a result: its scene, and the configured scenes that the scene names."""
        named = filter(None, map(scene.value, scene.kind.fidelity.sources))
        return Record(stage.name, scene, {name: self.scenes[name] for name in named if name in self.scenes})

    def needs(self, stage: Stage, scene: Scene) -> dict[str, Step]:
        """Return the inputs of a result, by the parameters of its stage's function.

        A scene that names another one that does not exist or does not fit raises a ConfigurationError.
        """
        needed = stage.needs(scene, lambda key: self.named(scene, key))
        return {name: (STAGES[other], of) for name, (other, of) in needed.items()}

    def digest(self, stage: Stage, scene: Scene) -> str:
        """Return the digest of a result that is up to date: of the keys and code that it depends on, and of its needs.

        The digest decides which results are made again, in the workflow (as a param of the rules) and in `simulate`.
        """
        path = stage.path(scene)
        if path not in self._digests:
            needed = {name: self.digest(*step) for name, step in self.needs(stage, scene).items()}
            reads, code = stage.document(scene), code_digest(*stage.code)
            self._digests[path] = digest({"stage": stage.name, "reads": reads, "code": code, "needs": needed})
        return self._digests[path]

    def up_to_date(
        self, scenes: Iterable[Scene], results: Path, stages: tuple[str, ...] = tuple(STAGES)
    ) -> list[Scene]:
        """Return those scenes whose datasets, of some stages, are all there and up to date."""

        def there(stage: Stage, scene: Scene) -> bool:
            path = results / stage.path(scene)
            return path.is_file() and digest_or_warning(path) == self.digest(stage, scene)

        needed = [stage for stage in STAGES.values() if stage.is_dataset and stage.name in stages]
        return [scene for scene in scenes if all(there(stage, scene) for stage in needed if stage.of(scene))]

    def ended_early(self, scenes: Iterable[Scene], results: Path) -> dict[str, str]:
        """Return why scenes have no history to full load, by name: their own ended early, or one that they need."""
        history = STAGES["simulation"]

        def why(stage: Stage, scene: Scene) -> str:
            path = results / stage.path(scene)
            if kept_of(path).is_file() and (own := why_incomplete(path, self.digest(stage, scene))):
                return f"{scene.name} {own}"
            return next(filter(None, (why(*step) for step in self.needs(stage, scene).values())), "")

        if not any(results.glob(str(kept_of(Path(history.path_pattern.format(scene="*", knit="*")))))):
            return {}
        return {scene.name: reason for scene in scenes if (reason := why(history, scene))}

    def steps(self, scenes: Iterable[Scene]) -> list[Step]:
        """Return all results of scenes, each path once and after its inputs."""
        pairs = [step for step in product(STAGES.values(), scenes) if step[0].of(step[1])]
        return list({stage.path(scene): (stage, scene) for stage, scene in pairs}.values())

    def wanted(self, scenes: Iterable[Scene]) -> list[Path]:
        """Return the paths of all results that a study of scenes asks for."""
        return [stage.path(scene) for stage, scene in self.steps(scenes) if stage.wanted(scene)]

    def named(self, scene: Scene, key: str) -> Scene:
        """Return the direct simulation that a key of a scene names, with the geometry of that scene.

        If springs are measured in it, it takes the scene's yarn and strain as well.
        """
        name, scenes = scene.value(key), self.scenes
        other = scenes.get(name)
        inputs = scene.geometry_inputs
        changed = {}
        if other is not None and any(other.geometry_inputs.get(key) != inputs[key] for key in inputs):
            changed = inputs | {"knit": scene.knit}
        if other is not None and measures(scene, key):
            changed |= {
                key: scene.value(key) for key in SPRINGS if scene.value(key) not in (None, other.value(key))
            }
            if "load.strain" in changed:
                stops = [stop for stop in other.load.stops if 0 < stop / changed["load.strain"] < 1]
                changed["load.stops"] = stops
        if changed:
            scenes = ChainMap({name: other.vary(changed)}, scenes)
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
        return scene.vary(labels) if labels else scene
