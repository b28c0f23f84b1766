"""Attributes of a result: every key of its scene, its provenance, and the meaning of its variables (CF-1.11).

A result holds its scene, and the scenes of its joints and springs: the file alone can be run again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import provenance, with_coordinates
from knitstudy.knit.scene.scene import NOTHING, Scene

if TYPE_CHECKING:  # a job that needs no dataset starts in half the time
    import xarray as xr

CONVENTIONS = "CF-1.11"  # https://cfconventions.org

KEYS, SOURCES = "scene_keys", "source_keys"
"""Attributes, as JSON: keys of the scene, and of the scenes that it names, by name."""


@dataclass(frozen=True)
class Record:
    """Record in a result of a stage: its scene, and by name the scenes whose results it uses."""

    stage: str
    scene: Scene
    sources: Mapping[str, Scene]

    def describe(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return a result with this record, a unit and a meaning of every variable, and strain as a coordinate."""
        from knitstudy.knit.geometry.columns import COORDINATES, GEOMETRY, MESH

        scene, (code, *others) = self.scene, provenance().items()
        versions = ", ".join(f"{name} {version}" for name, version in others)
        attributes = {
            "Conventions": CONVENTIONS,
            "title": f"{self.stage} of {scene.name}: {scene.specimen}, {scene.fidelity}, {scene.interaction}",
            "source": f"knitstudy {code[1]} with {versions}",
            "history": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} knitstudy: {self.stage} of {scene.name}",
            KEYS: json.dumps(scene.to_dict()),
            SOURCES: json.dumps({name: source.to_dict() for name, source in self.sources.items()}),
        }
        described = with_coordinates(dataset.assign_attrs(attributes))
        # Functions of the other stages describe their variables themselves, but for names along a dimension.
        own = {"geometry": GEOMETRY, "mesh": MESH}.get(self.stage, COORDINATES)
        for columns in (COORDINATES, own):
            for row in columns.table.loc[columns.table.index.isin(list(described.variables))].itertuples():
                units = {} if described[row.Index].dtype.kind in "OSU" else {"units": row.unit}
                described[row.Index].attrs.update(units | {"long_name": row.meaning})
        return described


def keys_of(dataset: xr.Dataset, path: Path | str) -> tuple[dict, dict]:
    """Return the keys of the scene of a result, nested, and the keys of the scenes that it names, by name.

    Raises DataFileError where it holds none.
    """
    try:
        keys, sources = (json.loads(dataset.attrs[name]) for name in (KEYS, SOURCES))
    except (KeyError, TypeError, ValueError) as error:
        made = dataset.attrs.get("code_version", "?")
        fact = f"has no keys of its scene (attributes {KEYS}, {SOURCES}), made by knitstudy {made}"
        raise DataFileError(f"{path}: {fact}; make it again from its scene, with this version") from error
    return keys, sources


def scenes_of(dataset: xr.Dataset, path: Path | str, defaults: Mapping = NOTHING) -> tuple[Scene, dict]:
    """Return the scene of a result, and the scenes that it names, by name.

    `defaults` are values of keys that the file does not have. Raises DataFileError where it holds no keys, and
    ConfigurationError where this version of the code does not allow them.
    """
    keys, sources = keys_of(dataset, path)
    where = f"{path}, made by knitstudy {dataset.attrs.get('code_version', '?')}"
    try:
        scenes = {name: Scene.from_dict(own, where, defaults) for name, own in sources.items()}
        return Scene.from_dict(keys, where, defaults), scenes
    except (AttributeError, TypeError) as error:
        raise ConfigurationError(f"{where}: its attributes {KEYS}, {SOURCES} hold no keys") from error
