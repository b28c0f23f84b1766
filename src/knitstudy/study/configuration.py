"""From the files of the configuration folder to scenes.

A scene is put together in layers, each over the one before: the calibrated loop (``pattern.loop`` names its
file), ``defaults.yaml``, and one row of ``scenes.tsv``. Columns of the table are dotted key names, cells
are YAML values, and an empty cell leaves the default.
"""

from __future__ import annotations

import copy
import csv
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice
from knitstudy.study.differences import flat
from knitstudy.study.kinds import FIDELITIES, INTERACTIONS
from knitstudy.study.scene import Scene, all_sections, set_dotted
from knitstudy.study.sections.labels import Labels

CONFIG = Path(__file__).resolve().parents[3] / "config"
"""The checkout's own configuration folder, wherever the current directory is."""

STUDIES = ("ci", "reduced", "full")
"""Names of the studies that a row of the table can belong to (column ``study``)."""

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
        Folder with ``defaults.yaml``, ``scenes.tsv`` and the loop file that the defaults name.

    Raises
    ------
    ConfigurationError
        Naming file, scene, key, value and what is allowed.
    """
    config = Path(config)
    default_keys(config)  # what is wrong in the defaults is said of the defaults
    defaults = _over_loop(read_yaml(config / "defaults.yaml"), config)
    scenes = {row["scene"]: _scene(row, defaults, config) for row in _read_table(config / "scenes.tsv")}
    check_scenes_together(scenes, str(config / "scenes.tsv"))
    return scenes


def default_keys(config: Path = CONFIG) -> dict[str, Any]:
    """Return the defaults by dotted key, those of the loop file among them.

    Raises
    ------
    ConfigurationError
        Naming the file and the key whose default is not known or not allowed.
    """
    path = Path(config) / "defaults.yaml"
    document = _over_loop(read_yaml(path), Path(config))
    for name, value in document.items():
        known = all_sections().get(name)
        if known is None and name not in Labels.model_fields:
            message = unknown_choice(
                "unknown key", name, name, sorted({*all_sections(), *Labels.model_fields})
            )
            raise ConfigurationError(f"{path}: {message}")
        if known is not None and not isinstance(value, dict):
            raise ConfigurationError(f"{path}: {name} is {value!r} but must be a group of keys")
        for inner in value if known is not None else ():
            if inner not in known:
                message = unknown_choice("unknown key", f"{name}.{inner}", str(inner), sorted(known))
                raise ConfigurationError(f"{path}: {message}")
    for labels in _kinds():
        needed = {"rom": {"contacts_from": "defaults"}, "load": {"path": [[0.0, 0.0, 0.0]]}}
        below = _merged(needed, {name: value for name, value in document.items() if name not in labels})
        Scene.from_dict({"name": "defaults", "knit": "defaults"} | labels, str(path), below)
    return flat(document)


def _kinds() -> Iterator[dict]:
    """Yield the labels of one scene of every kind."""
    for fidelity in FIDELITIES.names():
        model = FIDELITIES.find(fidelity, "")
        for interaction in INTERACTIONS.names():
            if INTERACTIONS.find(interaction, "").touches or model.tied:
                for specimen in model.specimens:
                    yield {
                        "fidelity": fidelity,
                        "interaction": interaction,
                        "specimen": specimen,
                        "outputs": [],
                    }


def load_knits(config: Path = CONFIG) -> dict[str, Scene]:
    """Return for every knit or pair the first scene of it: the geometry of all that share the label is the same."""
    found: dict[str, Scene] = {}
    for scene in load_scenes(config).values():
        found.setdefault(scene.knit, scene)
    return found


def load_scene(name: str, config: Path = CONFIG) -> Scene:
    """Return one scene by its name; see `load_scenes`."""
    scenes = load_scenes(config)
    if name not in scenes:
        raise ConfigurationError(
            f"{Path(config) / 'scenes.tsv'}: {unknown_choice('unknown scene', name, name, sorted(scenes))}"
        )
    return scenes[name]


def load_study(name: str, config: Path = CONFIG) -> tuple[str, ...]:
    """Return the names of the scenes that belong to a study, in the order of the table.

    Raises
    ------
    ConfigurationError
        When there is no such study.
    """
    if name not in STUDIES:
        raise ConfigurationError(unknown_choice("unknown study", name, name, list(STUDIES)))
    rows = _read_table(Path(config) / "scenes.tsv")
    return tuple(row["scene"] for row in rows if name in _studies(row))


def check_scenes_together(scenes: dict[str, Scene], where: str) -> None:
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
                f"{where}, scene {scene.name!r}: knit is {scene.knit!r}, as in scene {first.name!r}, but"
                f" {_first_difference(first, scene)}; scenes of one knit share its geometry"
            )
        _check_sources(scene, scenes, where)


ALIKE = {
    "rom.contacts_from": ("knit", "interaction", "load.direction"),
    "rom.springs_from": ("knit", "interaction"),
}
"""Keys that a scene shares with the direct simulation that another key of it names."""


def _check_sources(scene: Scene, scenes: dict[str, Scene], where: str) -> None:
    """Check that a reduced model takes joints from a direct simulation like it, and springs of the same interaction."""
    for source in scene.kind.fidelity.sources:
        name = scene.value(source)
        if name is None:
            continue
        direct = sorted(other.name for other in scenes.values() if other.fidelity == "dns")
        if name not in direct:
            message = unknown_choice(f"{source} names the unknown dns scene", name, name, direct)
            raise ConfigurationError(f"{where}, scene {scene.name!r}: {message}")
        for key in ALIKE.get(source, ("knit",)):
            here, there = scene.value(key), scenes[name].value(key)
            if here != there:
                raise ConfigurationError(
                    f"{where}, scene {scene.name!r}: {key} is {here!r} but must be {there!r} as in {source}, {name!r}"
                )


def _first_difference(first: Scene, second: Scene) -> str:
    """Name the first key of the geometry that differs between two scenes."""
    there = first.geometry_inputs
    differing = ((key, value) for key, value in second.geometry_inputs.items() if there.get(key) != value)
    key, value = next(differing)
    return f"{key} is {value!r}, there {there.get(key)!r}"


def _scene(row: dict[str, str], defaults: dict, config: Path) -> Scene:
    where = f"{config / 'scenes.tsv'}, scene {row['scene']!r}"
    own: dict[str, Any] = {}
    for key, cell in row.items():
        if key not in ("scene", "study") and cell.strip():
            set_dotted(own, key, _parse_cell(cell, key, where), where)
    return Scene.from_dict({"name": row["scene"]} | own, where, defaults)


def _over_loop(document: dict, config: Path) -> dict:
    """Return a document with the loop file that ``pattern.loop`` names laid under it."""
    pattern = document.get("pattern")
    if not isinstance(pattern, dict) or "loop" not in pattern:
        return document
    rest = {key: value for key, value in pattern.items() if key != "loop"}
    return _merged(_read_loop(config / str(pattern["loop"])), document | {"pattern": rest})


def _read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of the scene table, checked for all but the values of the scenes' keys."""
    lines = _read_text(path).splitlines()
    rows = list(csv.DictReader(lines, delimiter="\t", restkey="surplus"))
    if not rows or not {"scene", "study"} <= set(rows[0]):
        raise ConfigurationError(f"{path}: must have the columns 'scene' and 'study', and at least one scene")
    names: set[str] = set()
    for number, row in enumerate(rows, start=2):
        where = f"{path}, line {number}"
        if "surplus" in row or None in row.values():
            raise ConfigurationError(f"{where}: must have as many cells as the first line, tabs between them")
        if row["scene"] in names:
            raise ConfigurationError(f"{where}: scene {row['scene']!r} is there twice")
        unknown = next((name for name in _studies(row) if name not in STUDIES), None)
        if unknown is not None:
            message = unknown_choice("unknown study", unknown, unknown, list(STUDIES))
            raise ConfigurationError(f"{where}: {message}")
        names.add(row["scene"])
    return rows


def _studies(row: dict[str, str]) -> list[str]:
    """Return the studies that a row belongs to: names with commas between."""
    return [name.strip() for name in row["study"].split(",") if name.strip()]


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


def _parse_cell(cell: str, key: str, where: str) -> Any:
    try:
        return yaml.load(cell, Loader=_Loader)
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{where}: {key} is {cell!r}, which is not YAML") from error


def _merged(below: dict, above: dict) -> dict:
    """Return nested mappings laid over each other; lists and values are replaced whole."""
    result = copy.deepcopy(below)
    for key, value in above.items():
        nested = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merged(result[key], value) if nested else copy.deepcopy(value)
    return result


def read_yaml(path: Path) -> dict:
    """Return the mapping in a YAML file.

    Raises
    ------
    ConfigurationError
        When the file is missing, is not YAML or holds no mapping.
    """
    try:
        document = yaml.load(_read_text(path), Loader=_Loader)
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{path}: is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(document, dict):
        raise ConfigurationError(f"{path}: must hold a mapping of keys to values")
    return document


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ConfigurationError(f"{path}: is missing; the configuration folder must have it") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{path}: cannot be read: {error}") from error


class _Loader(yaml.SafeLoader):
    """SafeLoader that takes 1e-6 for a number, as YAML 1.2 does and YAML 1.1 does not."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)
