"""From the files of the configuration folder to scenes.

A scene is put together in layers, each over the one before: the calibrated loop (``pattern.loop`` names its
file), ``defaults.yaml``, and what its family in ``scenes`` sets (see `knitstudy.study.families`).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.study.documents import read_yaml
from knitstudy.study.families import STUDIES, Member, read_families
from knitstudy.study.scene import Scene, set_dotted
from knitstudy.study.schema import unknown_choice

CONFIG = Path(__file__).resolve().parents[3] / "config"
"""The checkout's own configuration folder, wherever the current directory is."""

FAMILIES = "scenes"
"""The folder of families in a configuration folder."""

# Where the keys of a calibrated loop go in a scene.
_LOOP_KEYS = {
    "control_points": "pattern.control_points",
    "course_spacing": "pattern.course_spacing",
    "wale_spacing": "pattern.wale_spacing",
    "diameter": "yarn.diameter",
    "free": "geometry.free",
}


def load_scenes(config: Path = CONFIG) -> dict[str, Scene]:
    """Return every scene of a configuration folder by its name, each checked and all checked together.

    Parameters
    ----------
    config
        Folder with ``defaults.yaml``, the families in ``scenes``, and the loop file that the defaults name.

    Raises
    ------
    ConfigurationError
        Naming file, scene, key, value and what is allowed.
    """
    config = Path(config)
    default_scene(config)  # what is wrong in the defaults is said of the defaults
    defaults = read_yaml(config / "defaults.yaml")
    members = read_families(config / FAMILIES)
    scenes = {name: _scene(member, defaults, config) for name, member in members.items()}
    check_scenes_together(scenes, {name: member.where for name, member in members.items()})
    return scenes


def default_scene(config: Path = CONFIG) -> Scene:
    """Return the scene that the defaults and their loop describe."""
    path = Path(config) / "defaults.yaml"
    document = _over_loop(read_yaml(path), Path(config))
    return Scene.from_dict({"name": "defaults", "knit": "defaults", **document}, str(path))


def load_knits(config: Path = CONFIG) -> dict[str, Scene]:
    """Return for every knit or pair a scene of what its geometry depends on, with defaults for all else.

    The geometry stage is parametrised by it: another load or mesh of one scene then leaves the geometry as
    it is.
    """
    base = default_scene(config)
    return {scene.knit: _geometry_scene(scene, base) for scene in load_scenes(config).values()}


def _geometry_scene(scene: Scene, base: Scene) -> Scene:
    """Return the base scene with all that the geometry of a scene depends on."""
    document = base.to_dict() | {"name": scene.knit, "knit": scene.knit, "interaction": "tie"}
    for key, value in scene.geometry_inputs.items():
        set_dotted(document, key, value, f"knit {scene.knit!r}")
    # A load that the specimen may have, whatever the scene's own is.
    pair = scene.specimen == "pair"
    path = [[0.0, 0.0, 0.0]] if pair else []
    document["load"] |= {"direction": "path" if pair else "course", "path": path, "stops": []}
    return Scene.from_dict(document, f"knit {scene.knit!r}")


def load_scene(name: str, config: Path = CONFIG) -> Scene:
    """Return one scene by its name; see `load_scenes`."""
    scenes = load_scenes(config)
    if name not in scenes:
        raise ConfigurationError(
            f"{Path(config) / FAMILIES}: {unknown_choice('unknown scene', name, name, sorted(scenes))}"
        )
    return scenes[name]


def load_study(name: str, config: Path = CONFIG) -> tuple[str, ...]:
    """Return the names of the scenes that belong to a study, in the order of the families.

    Raises
    ------
    ConfigurationError
        When there is no such study.
    """
    if name not in STUDIES:
        raise ConfigurationError(unknown_choice("unknown study", name, name, list(STUDIES)))
    members = read_families(Path(config) / FAMILIES).values()
    return tuple(member.name for member in members if name in member.studies)


def check_scenes_together(scenes: Mapping[str, Scene], where: Mapping[str, str]) -> None:
    """Check what scenes say of each other: shared knits, and where reduced models take their joints from.

    Raises
    ------
    ConfigurationError
        Naming both scenes and the key.
    """
    knits: dict[str, Scene] = {}
    for scene in scenes.values():
        first = knits.setdefault(scene.knit, scene)
        if scene.geometry_key != first.geometry_key:
            raise ConfigurationError(
                f"{where[scene.name]}: knit is {scene.knit!r}, as in scene {first.name!r}, but"
                f" {_first_difference(first, scene)}; scenes of one knit share its geometry"
            )
        if scene.rom.contacts_from is not None:
            _check_sources(scene, scenes, where[scene.name])


def _check_sources(scene: Scene, scenes: Mapping[str, Scene], where: str) -> None:
    """Check that a reduced model takes joints from a DNS like it, and springs from one of the same interaction."""
    direct = sorted(other.name for other in scenes.values() if other.fidelity == "dns")
    alike = {
        "contacts_from": ("knit", "interaction", "load.direction"),
        "springs_from": ("knit", "interaction"),
    }
    for source, keys in alike.items():
        name = getattr(scene.rom, source)
        if name is None:
            continue
        if name not in direct:
            message = unknown_choice(f"rom.{source} names the unknown dns scene", name, name, direct)
            raise ConfigurationError(f"{where}: {message}")
        for key in keys:
            here, there = (attrgetter(key)(each) for each in (scene, scenes[name]))
            if here != there:
                raise ConfigurationError(
                    f"{where}: {key} is {here!r} but must be {there!r} as in rom.{source}, {name!r}"
                )


def _first_difference(first: Scene, second: Scene) -> str:
    """Name the first key of the geometry that differs between two scenes."""
    there = first.geometry_inputs
    differing = ((key, value) for key, value in second.geometry_inputs.items() if there.get(key) != value)
    key, value = next(differing)
    return f"{key} is {value!r}, there {there.get(key)!r}"


def _scene(member: Member, defaults: dict, config: Path) -> Scene:
    """Return the scene of a member of a family, what it sets laid over the defaults."""
    overrides: dict[str, Any] = {}
    for key, value in member.keys.items():
        set_dotted(overrides, key, value, member.where)
    document = _over_loop(_merged(defaults, overrides), config)
    return Scene.from_dict({"name": member.name, **document}, member.where)


def _over_loop(document: dict, config: Path) -> dict:
    """Return a document with the loop file that ``pattern.loop`` names laid under it."""
    pattern = document.get("pattern")
    if not isinstance(pattern, dict) or "loop" not in pattern:
        return document
    rest = {key: value for key, value in pattern.items() if key != "loop"}
    return _merged(_read_loop(config / str(pattern["loop"])), document | {"pattern": rest})


def _read_loop(path: Path) -> dict:
    """Return the layer of a scene that a file of a calibrated loop gives."""
    loop = read_yaml(path)
    layer: dict[str, Any] = {}
    for key, target in _LOOP_KEYS.items():
        if key in loop:
            set_dotted(layer, target, loop[key], str(path))
        else:
            raise ConfigurationError(f"{path}: the key {key!r} of a calibrated loop is missing")
    return layer


def _merged(below: dict, above: dict) -> dict:
    """Return nested mappings laid over each other; lists and values are replaced whole."""
    result = copy.deepcopy(below)
    for key, value in above.items():
        nested = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merged(result[key], value) if nested else copy.deepcopy(value)
    return result
