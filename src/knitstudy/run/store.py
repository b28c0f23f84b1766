"""Results where they are kept: found, or made and written with the scene that they are of.

The workflow, the command `run` and `run.simulations` all take a `Step` of a plan from a `Store`. A result holds its
scene, and the scenes of its joints and springs: the file alone can be run again.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knitstudy.datasets import (
    REMEDY,
    fault_of,
    provenance,
    read_dataset,
    read_result,
    recorded_digest,
    seal,
    with_coordinates,
    write_dataset,
)
from knitstudy.errors import ConfigurationError, ConvergenceError, DataFileError, EndedEarly, HeldOpenError
from knitstudy.files import require_writable
from knitstudy.knit.loading.run import ReportProgress, Run, restart_of, silent
from knitstudy.knit.scene.scene import LABELS, NOTHING, Scene, flat
from knitstudy.mechanics.core.batches import serial_blas
from knitstudy.run.plan import Step

if TYPE_CHECKING:  # the workflow needs no dataset, and starts in half the time
    import xarray as xr

log = logging.getLogger(__name__)

OF_STUDY = Path("results")  # Where studies leave results, which `simulate` reads and never writes
INCOMPLETE = ".incomplete.nc"  # Suffix of a history that ended before full load

BeginProgress = Callable[[str], ReportProgress]
"""Returns the receiver of the progress of a step, for example `knitstudy.knit.loading.run.Progress`."""


class NotKept(Exception):
    """A result that a store which makes none has not."""


@dataclass
class Store:
    """Takes results from where they are kept, or makes them."""

    # Where results are written, with its folder ``restart`` for runs that were ended; without it, all stays in memory
    folder: Path | None = None
    also: tuple[Path, ...] = ()  # other folders that results are taken from
    progress: BeginProgress = lambda label: silent
    made: dict[str, xr.Dataset] = field(default_factory=dict)  # by digest
    makes: bool = True  # else NotKept is raised where a result would be made

    def get(self, step: Step, force: bool = False) -> Any:
        """Return a result: from memory, from its file if that is up to date, else made and written.

        Scenes whose keys differ only where the stage does not read them share one result in memory. A result that is no
        dataset is a file alone, and None is returned. With `force` the result itself is made again.
        """
        if step.digest in self.made:
            return self.made[step.digest]
        result = None if force or not step.stage.is_dataset else self.found(step)
        if result is None and not force:
            result = self._shared(step)
        if result is None:
            step.require_machine()  # before anything is made for it
            result = self.make(step, {name: self.get(need) for name, need in step.needs.items()}, force)
        if result is not None:
            self.made[step.digest] = result
        return result

    def found(self, step: Step) -> xr.Dataset | None:
        """Return the dataset of a step that is kept, whole and up to date; one that is damaged is a warning."""
        for path in self._paths(step):
            if (result := _kept(path, step.digest)) is not None:
                log.info(f"{step}: taken from %s", path)
                return result
            log.info(f"{step}: %s is not up to date", path)
        return None

    def _shared(self, step: Step) -> xr.Dataset | None:
        """Return the dataset of another scene that is this one's as well, such as a shape at rest, under its name."""
        folders = self._folders() if step.stage.shared else []
        for other in (
            file for folder in folders for file in sorted((folder / step.path).parent.glob("[!.]*.nc"))
        ):
            with suppress(DataFileError, HeldOpenError, OSError):  # nobody has asked for this file
                if recorded_digest(other) == step.digest:
                    result = described(read_result(other), step)
                    if (path := self._path(step)) is not None:
                        write_dataset(result, path, step.scene.name, step.digest)
                    log.info(f"{step}: taken from %s", other)
                    return result
        return None

    def holds(self, step: Step) -> bool:
        """Return whether the result of a step is kept, unchanged and up to date; `found` warns where it is not."""
        for path in self._paths(step):
            with suppress(DataFileError):
                if recorded_digest(path) == step.digest:
                    return True
        return False

    def make(self, step: Step, needed: Mapping[str, xr.Dataset], force: bool = False) -> xr.Dataset | None:
        """Make a result, write it with its digest if there is a folder, and then delete the restart file.

        A history that ends before full load has a file of its own, and is computed again for the same digest only
        with `force`. Raises EndedEarly where it is there.
        """
        path = self._path(step)
        if path is not None:
            require_writable(path)
        if not step.stage.is_dataset:
            self._write(step, path, needed)
            return None
        if path is not None and not force:
            self._require_open_end(step)
        if not self.makes:
            raise NotKept(step)
        run = self._run_of(step)
        try:
            dataset = _made(step, needed if run is None else {**needed, "run": run})
            ended = None
        except ConvergenceError as error:
            if path is None or error.history is None:
                raise
            dataset = error.history
            ended = error
            path = _early(path)
        dataset = described(dataset, step)
        if ended is None and (fault := fault_of(dataset)):
            raise DataFileError(f"the {step.stage.name} of {step.scene.name} {fault}: it is not written")
        if path is not None:
            write_dataset(dataset, path, step.scene.name, step.digest)
            if run is not None:
                run.forget()
            if ended is not None:
                self._require_open_end(step)
            _early(path).unlink(missing_ok=True)
            log.info(f"{step}: written to %s", path)
        return dataset

    def why_ended(self, step: Step) -> str:
        """Return where and why the history of a step ended before full load; an empty text where it did not."""
        path = _early(self._path(step) or Path())
        try:
            known = read_dataset(path).attrs if path.is_file() else {}
        except DataFileError:
            return ""
        return f"{known['incomplete'].rstrip('.')}." if known.get("digest") == step.digest else ""

    def ended_early(self, simulations: Iterable[Step]) -> dict[str, str]:
        """Return why scenes have no history to full load, by name: their own ended early, or one that they need."""

        def why(step: Step) -> str:
            own = self.why_ended(step)
            return (
                f"{step.scene.name} {own}" if own else next(filter(None, map(why, step.needs.values())), "")
            )

        if self.folder is None or not any((self.folder / "simulation").glob(f"*{INCOMPLETE}")):
            return {}
        reasons = {step.scene.name: why(step) for step in simulations}
        return {name: reason for name, reason in reasons.items() if reason}

    def _paths(self, step: Step) -> list[Path]:
        return [path for folder in self._folders() if (path := folder / step.path).is_file()]

    def _folders(self) -> list[Path]:
        return [folder for folder in (self.folder, *self.also) if folder is not None]

    def _path(self, step: Step) -> Path | None:
        return None if self.folder is None else self.folder / step.path

    def _require_open_end(self, step: Step) -> None:
        """Refuse a result that is known to end early."""
        if why := self.why_ended(step):
            kept = _early(self._path(step) or Path())
            ended = EndedEarly(f"{why} The curve up to there is in {kept}; to compute it again, delete it")
            ended.history = read_dataset(kept)
            raise ended

    def _run_of(self, step: Step) -> Run | None:
        """Return the run of a long stage, with its restart file and its progress; None of a short one."""
        if not step.stage.reports:
            return None
        restart = None
        if step.stage.restarts and self.folder is not None:
            restart = restart_of(self.folder / "restart", step.scene.name, step.digest)
        return Run(restart, self.progress(str(step)))

    def _write(self, step: Step, path: Path | None, needed: Mapping[str, xr.Dataset]) -> None:
        """Write a file for another program."""
        if path is None:
            raise ConfigurationError(f"{step}: is a file, and there is no folder for it")
        step.stage.function(step.seen, path=path, **needed)
        seal(path, step.digest)
        log.info(f"{step}: written to %s", path)


def _made(step: Step, given: Mapping[str, Any]) -> xr.Dataset:
    """Return a dataset with the processor time of all threads; a stage with a restart file counts its own time."""
    started = time.process_time()
    with serial_blas():  # the last bits of its sums depend on its threads
        dataset: xr.Dataset = step.stage.function(step.seen, **given)
    seconds = time.process_time() - started
    return dataset if step.stage.restarts else dataset.assign_attrs(processor_seconds=seconds)


def digest_or_warning(path: Path) -> str:
    """Return the digest of a result that is whole and unchanged; an empty text, and a warning, of any other."""
    try:
        return recorded_digest(path)
    except DataFileError as error:
        _warn_of_unsound(error)
        return ""


def _kept(path: Path, digest: str) -> xr.Dataset | None:
    """Return the dataset of a file with a digest; None where it has another one, or is damaged, which is a warning."""
    try:
        return read_result(path) if recorded_digest(path) == digest else None
    except DataFileError as error:
        _warn_of_unsound(error)
        return None


def _warn_of_unsound(error: DataFileError) -> None:
    """Warn of a result that nobody uses; the remedy of its message is not needed."""
    log.warning("%s; it is made again", str(error).removesuffix(f"; {REMEDY}"))


def _early(path: Path) -> Path:
    """Return the file of a history that ended before full load, next to that of a whole one."""
    return path.with_suffix(INCOMPLETE)


# Attributes of a result: every key of its scene, its provenance, and the meaning of its variables

CONVENTIONS = "CF-1.11"  # https://cfconventions.org

KEYS, SOURCES = "scene_keys", "source_keys"
"""Attributes, as JSON: keys of the scene, and of the scenes that it names, by name."""


def described(dataset: xr.Dataset, step: Step) -> xr.Dataset:
    """Return a result with the record of its step, units and meanings of variables, and strain as a coordinate."""
    from knitstudy.knit.geometry.columns import COORDINATES, GEOMETRY, MESH

    scene = step.scene
    stage = step.stage.name
    (code, *others) = provenance().items()
    versions = ", ".join(f"{name} {version}" for name, version in others)
    attributes = {
        "Conventions": CONVENTIONS,
        "title": f"{stage} of {scene.name}: {scene.specimen}, {scene.fidelity}, {scene.interaction}",
        "source": f"knitstudy {code[1]} with {versions}",
        "history": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} knitstudy: {stage} of {scene.name}",
        KEYS: json.dumps(scene.to_dict()),
        SOURCES: json.dumps({name: source.to_dict() for name, source in step.sources.items()}),
    }
    described = with_coordinates(dataset.assign_attrs(attributes))
    # Functions of the other stages describe their variables themselves, but for names along a dimension.
    own = {"geometry": GEOMETRY, "mesh": MESH}.get(stage, COORDINATES)
    for columns in (COORDINATES, own):
        for row in columns.table.loc[columns.table.index.isin(list(described.variables))].itertuples():
            units = {} if described[row.Index].dtype.kind in "OSU" else {"units": row.unit}
            described[row.Index].attrs.update(units | {"long_name": row.meaning})
    return described


def warn_of_another(scene: Scene, path: Path) -> None:
    """Warn where a file holds another scene of the same name, which the result of this one replaces."""
    with suppress(DataFileError, HeldOpenError, OSError, ValueError):
        there = flat(json.loads(recorded_digest(path, KEYS)))
        keys = flat(scene.to_dict())
        if differ := [key for key in keys.keys() & there.keys() - {*LABELS} if keys[key] != there[key]]:
            which = ", ".join(sorted(differ)[:3])
            log.warning("%s: another scene of this name (%s) is replaced; set name to keep both", path, which)


Keys = dict[str, Any]


def keys_of(dataset: xr.Dataset, path: Path | str) -> tuple[Keys, dict[str, Keys]]:
    """Return the keys of the scene of a result, nested, and the keys of the scenes that it names, by name.

    Raises DataFileError where it holds none.
    """
    made = f"made by knitstudy {dataset.attrs.get('code_version', '?')}"
    try:
        keys, sources = (json.loads(dataset.attrs[name]) for name in (KEYS, SOURCES))
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        fact = f"has no keys of its scene (attributes {KEYS}, {SOURCES}), {made}"
        raise DataFileError(f"{path}: {fact}; make it again from its scene, with this version") from error
    if not (isinstance(sources, dict) and all(isinstance(each, dict) for each in (keys, *sources.values()))):
        raise ConfigurationError(f"{path}, {made}: its attributes {KEYS}, {SOURCES} hold no keys")
    return keys, sources


def recorded_scenes(
    dataset: xr.Dataset, path: Path | str, defaults: Mapping[str, Any] = NOTHING
) -> tuple[Scene, dict[str, Scene]]:
    """Return the scene of a result, and the scenes that it names, by name.

    `defaults` are values of keys that the file does not have. Raises DataFileError where it holds no keys, and
    ConfigurationError where this version of the code does not allow them.
    """
    keys, sources = keys_of(dataset, path)
    where = f"{path}, made by knitstudy {dataset.attrs.get('code_version', '?')}"
    scenes = {name: Scene.from_dict(own, where, defaults) for name, own in sources.items()}
    return Scene.from_dict(keys, where, defaults), scenes
