"""A folder of results: one file a stage and scene, used again where it belongs to the same inputs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.files.provenance import code_version
from knitstudy.study.configuration import CONFIG, load_knits, load_scenes
from knitstudy.study.scene import Scene

log = logging.getLogger(__name__)

DIGITS = 8
"""Digits of a hash in the name of a scene or knit that the configuration does not have."""


@dataclass(frozen=True)
class Archive:
    """Results under ``folder/{stage}/{scene}.nc``, as the workflow lays them out.

    Attributes
    ----------
    folder : Path or None
        Without a folder nothing is read or written.
    scenes, knits : dict of str to Scene
        What the names of the configuration stand for; see `load_scenes` and `load_knits`.
    """

    folder: Path | None
    scenes: dict[str, Scene]
    knits: dict[str, Scene]

    @classmethod
    def of(cls, folder: Path | str | None = None, config: Path = CONFIG) -> Archive:
        """Return the archive in a folder, with the names of a configuration folder."""
        return cls(None if folder is None else Path(folder), load_scenes(config), load_knits(config))

    def labelled(self, scene: Scene) -> Scene:
        """Return a scene under labels of its own where the configuration gives its labels to other keys.

        A changed scene must not take the place of the one that it was made from: its name, and the label of its
        knit where the geometry has changed, end with digits of their hash.
        """
        named, knit = self.scenes.get(scene.name), self.knits.get(scene.knit)
        labels = {}
        if named is not None and named.hash != scene.hash:
            labels["name"] = f"{scene.name}-{scene.hash[:DIGITS]}"
        if knit is not None and knit.geometry_key != scene.geometry_key:
            labels["knit"] = f"{scene.knit}-{scene.geometry_key[:DIGITS]}"
        return scene.vary(labels)

    def knit_of(self, scene: Scene) -> Scene:
        """Return the scene that the geometry of a labelled scene is laid out from: the same for all that share it."""
        if scene.knit in self.knits:
            return self.knits[scene.knit]
        base = next((knit for knit in self.knits.values() if knit.specimen == scene.specimen), scene)
        return base.vary(scene.geometry_inputs | {"name": scene.knit, "knit": scene.knit})

    def path(self, stage: str, scene: Scene) -> Path | None:
        """Return where the result of a stage lies."""
        return self.folder / stage / f"{scene.name}.nc" if self.folder else None

    def keep(
        self,
        stage: str,
        scene: Scene,
        compute: Callable[[], xr.Dataset],
        *,
        needs: Iterable[str] = (),
        after: Iterable[Path | None] = (),
        anew: bool = False,
    ) -> xr.Dataset:
        """Return the result of a stage: from its file if that belongs to the same inputs, else computed and written.

        Parameters
        ----------
        stage : str
            Folder of the file.
        scene : Scene
            Its hash tells whether a file belongs to it.
        compute : callable
            Returns the dataset.
        needs : iterable of str
            Variables without which a file is not used.
        after : iterable of Path or None
            Files of other scenes or stages that it is made from, and must not be older than.
        anew : bool
            Compute whatever is there.

        Raises
        ------
        DataFileError
            If the file that is there is damaged, or the new one cannot be written.
        """
        path = self.path(stage, scene)
        if path is not None and path.is_file() and not anew:
            dataset = read_dataset(path)
            whole = dataset.attrs.get("scene_hash") == scene.hash and all(name in dataset for name in needs)
            if whole and not any(source and _time(source) > _time(path) for source in after):
                log.info("%s %s: taken from %s%s", stage, scene.name, path, _other_code(dataset))
                return dataset
            log.info("%s %s: %s was made from other inputs and will be replaced", stage, scene.name, path)
        dataset = compute()
        if path is not None:
            write_dataset(dataset, path, scene)
            log.info("%s %s: written to %s", stage, scene.name, path)
        return dataset


def _time(path: Path) -> int:
    """Return when a file was written [ns]."""
    return path.stat().st_mtime_ns


def _other_code(dataset: xr.Dataset) -> str:
    """Say so where a file was made by another version of the code."""
    version = dataset.attrs.get("code_version", "an unknown version")
    return "" if version == code_version() else f", which {version} made"
