"""From the files of the configuration folder to scenes.

A scene is put together in layers, each over the one before: the calibrated loop (``pattern.loop`` names its file),
``defaults.yaml``, and the keys that its family in ``scenes`` sets (see `knitstudy.run.families`). A file of one
family, or a folder without ``defaults.yaml``, adds its scenes to the scenes of the default configuration.
"""

from __future__ import annotations

import logging
from collections import UserDict
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import CONFIG, base_of, layered_defaults, read_yaml
from knitstudy.knit.scene.keys import Section, output, validated
from knitstudy.knit.scene.kinds import Kind, Labels, all_keys, all_kinds, defaults_of_fields, unknown_key
from knitstudy.knit.scene.scene import NOTHING, Scene, flat, nested
from knitstudy.registry import find, unknown_choice
from knitstudy.run.advice import AUTO, DEFAULT_ASK, Requirements, asked, choose, is_open
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.families import STUDIES, Member, Study, family_files, read_families
from knitstudy.run.sources import Source

log = logging.getLogger(__name__)

FAMILIES = "scenes"  # The folder of families in a configuration folder


class Workflow(Section):
    """The study of scenes that is made, the folder that they stand in, and modules of kinds from outside."""

    study: Study = output("choice", default="reduced")
    """Which scenes are run; no result depends on it. Checked: all."""
    folder: Annotated[str, Field(min_length=1)] = output(
        "choice",
        allowed="the path of a folder with defaults.yaml, families of scenes and a calibrated loop",
        default=CONFIG.name,
    )
    """Where files are. Checked: config, and folders of tests."""
    plugins: tuple[Annotated[str, Field(pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*$")], ...] = output(
        "choice",
        allowed="a list of the dotted names of modules, for example [my_elements], that register kinds of their own",
        default=(),
    )
    """Plugins that extend the study. Checked: kinds of the tests."""


def workflow_configuration(config: Any) -> Workflow:
    """Return the checked configuration of the workflow: ``config/config.yaml`` under the options of the command line.

    Raises ConfigurationError, naming the key, its value and the allowed values.
    """
    return validated(Workflow, config, "the workflow's configuration")


def folder_of(configuration: Workflow) -> Path:
    """Return the folder that a configuration of the workflow names: from the working folder, or the default one."""
    named = Path(configuration.folder)
    return CONFIG if str(named) == CONFIG.name and not named.exists() else named


def load_scenes(config: Path = CONFIG) -> dict[str, Scene]:
    """Return every scene of a configuration folder by its name, each checked and all checked together.

    The folder has ``defaults.yaml``, the families in ``scenes``, and the loop file that the defaults name. Scenes of a
    file, or of a folder without defaults, are added to the scenes of the default configuration.
    Raises ConfigurationError, naming file, scene, key, value and the allowed values.
    """
    default_keys(config)  # errors in the defaults name the defaults
    scenes = dict(lazy_scenes(config)[0])
    check_together(scenes.values(), scenes, knits_of(scenes), config)
    return scenes


def lazy_scenes(config: Path = CONFIG) -> tuple[Mapping[str, Scene], Mapping[str, Scene]]:
    """Return the scenes of a configuration by name, and the first correct scene of every knit or pair by its label.

    A scene is read and checked on first access: jobs and commands need few of hundreds.
    """
    members, defaults = load_families(config), layered_defaults(config)

    @cache
    def read(name: str) -> Scene:
        member = members[name]
        return (
            choose(*asked(member, {}, defaults)).scene if is_open(member.keys) else _scene(member, defaults)
        )

    def first(names: list[str]) -> Scene:
        for name in names[:-1]:
            with suppress(ConfigurationError):  # a wrong scene stops no other one of its knit
                return read(name)
        return read(names[-1])

    of_knit: dict[str, list[str]] = {}
    for name, member in members.items():
        of_knit.setdefault(str(member.keys.get("knit")), []).append(name)
    return LazyScenes({name: name for name in members}, read), LazyScenes(of_knit, first)


class LazyScenes(UserDict[str, Scene]):
    """Scenes that are read on access, each from the name, or the names, that its key stands for."""

    def __init__(self, names: Mapping[str, Any], read: Callable[[Any], Scene]) -> None:
        super().__init__(names)
        self.read = read

    def __getitem__(self, key: str) -> Scene:
        return self.read(super().__getitem__(key))


def load_scene(name: str, config: Path = CONFIG, changes: Mapping[str, Any] = NOTHING) -> Scene:
    """Return one scene by its name, checked with the scenes that it names, with some keys changed if `changes` has any.

    `changes` are values by dotted key, as of `Scene.vary`. Where the scene or its changes leave the model open, a model
    is chosen for the changed scene; a message of level INFO names it.
    Raises ConfigurationError as `load_scenes` where this scene is wrong, though others may be; where a change has an
    unknown key or a value that is not allowed; and where no model answers the question of the scene.
    """
    _known_defaults(config)
    try:
        member = _member(name, config)
        scenes, knits = lazy_scenes(config)
        if is_open({**member.keys, **changes}):
            choice = choose(*asked(member, changes, layered_defaults(config)))
            log.info("%s", choice)
            scene = choice.scene
            if not changes:
                check_together([scene], scenes, knits, config)
            return scene
        if is_open(member.keys):  # the changes name a model: none is chosen
            problem, _, _ = asked(member, {}, layered_defaults(config))
            return problem.scene.vary(changes)
        scene = scenes[name]
        check_together([scene], scenes, knits, config)
        return scene.vary(changes)
    except ConfigurationError:
        default_keys(config)  # an error in the defaults names the defaults
        raise


def load_families(config: Path = CONFIG) -> dict[str, Member]:
    """Return the families' members by the names of their scenes: file, studies and keys of each."""
    config = Path(config)
    paths = family_files(base_of(config) / FAMILIES) + _own_files(config)
    return read_families({path.resolve(): path for path in paths}.values())  # each once


def _own_files(config: Path) -> list[Path]:
    """Return the files of the families that a folder, or a file, adds to its base, or all of a base."""
    if config.is_file():
        return [config]
    inside = config / FAMILIES
    return family_files(inside if inside.is_dir() or base_of(config) == config else config)


def scene_of_file(path: Path) -> str:
    """Return the name of the only scene that a file of a family defines; a ConfigurationError where it has several."""
    if not path.is_file():
        raise ConfigurationError(f"{path}: there is no such file")
    names = own_scenes(path)
    if len(names) != 1:
        some = f"{', '.join(names[:3])}{' ...' if len(names) > 3 else ''}"
        raise ConfigurationError(f"{path}: has the scenes {some}; name one of them, with --config {path}")
    return names[0]


def load_study(name: str, config: Path = CONFIG) -> tuple[str, ...]:
    """Return the names of the scenes that belong to a study, in the order of the families.

    Raises ConfigurationError when there is no such study.
    """
    if name not in STUDIES:
        raise ConfigurationError(unknown_choice("unknown study", name, name, list(STUDIES)))
    return tuple(member.name for member in load_families(config).values() if name in member.studies)


def own_scenes(config: Path) -> tuple[str, ...]:
    """Return the names of the scenes that a folder, or a file, adds to the default configuration; else all."""
    own = tuple(f"{path}, " for path in _own_files(Path(config)))
    return tuple(member.name for member in load_families(config).values() if member.where.startswith(own))


def knits_of(scenes: Mapping[str, Scene]) -> dict[str, Scene]:
    """Return the first scene of every knit or pair by its label: scenes that share a label share the geometry."""
    knits: dict[str, Scene] = {}
    for scene in scenes.values():
        knits.setdefault(scene.knit, scene)
    return knits


def asked_of(
    name: str,
    changes: Mapping[str, Any],
    config: Path = CONFIG,
    ask: Mapping[str, Any] = DEFAULT_ASK,
) -> tuple[PhysicalProblem, Requirements, str]:
    """Return the physical problem of a scene with changed keys, its question, and the prefix of error messages.

    `ask` has the requirements that neither the scene nor the changes have.
    """
    return asked(_member(name, config), changes, layered_defaults(config), ask)


def _member(name: str, config: Path) -> Member:
    """Return the member of a family by the name of its scene; a ConfigurationError offers similar names."""
    return find("scene", load_families(config), name, str(Path(config) / FAMILIES))


def _scene(member: Member, defaults: dict[str, Any]) -> Scene:
    """Return the scene of a member of a family: its keys over the defaults."""
    for name, value in member.keys.items():
        if name.startswith("ask."):
            wanted = f"left out where fidelity is not {AUTO}"
            raise ConfigurationError(f"{member.where}: {name} is {value!r} but must be {wanted}")
    scene = Scene.from_dict({"name": member.name} | member.keys, member.where, defaults)
    scene.require_read(member.keys, member.where)
    return scene


def default_keys(config: Path = CONFIG) -> dict[str, Any]:
    """Return all defaults by dotted key: of fields, of the loop file and of ``defaults.yaml``, checked for every kind.

    Raises ConfigurationError, naming the file and the key whose default is not known or not allowed.
    """
    path, document = _known_defaults(config)
    loop = read_yaml(path).get("pattern", {}).get("loop")
    where = f"{path} over {loop}" if loop else str(path)
    sections = {name: value for name, value in document.items() if name not in Labels.model_fields}
    for name, needed in {"rom": {"contacts_from": "defaults"}, "load": {"path": [[0.0, 0.0, 0.0]]}}.items():
        sections[name] = needed | sections.get(name, {})
    for kind in all_kinds():
        Scene.from_dict(_least(kind), where, sections)
    return defaults_of_fields() | flat(document)


def _known_defaults(config: Path) -> tuple[Path, dict[str, Any]]:
    """Return the file and the content of the defaults, whose keys are keys of scenes; their values are not checked."""
    path = base_of(config) / "defaults.yaml"
    document = layered_defaults(config)
    keys = flat(document)
    nested(keys, str(path))  # which refuses what is no key, and values in place of groups
    for name in keys:
        if name not in all_keys():
            raise ConfigurationError(f"{path}: {unknown_key(name)}")
    return path, document


def _least(kind: Kind) -> dict[str, Any]:
    """Return the labels of a scene of a kind."""
    least: dict[str, Any] = {"name": "defaults", "knit": "defaults", "outputs": []}
    return least | {label: getattr(kind, label).name for label in ("fidelity", "interaction", "specimen")}


def check_together(
    checked: Iterable[Scene], scenes: Mapping[str, Scene], knits: Mapping[str, Scene], config: Path
) -> None:
    """Check scenes against others: shared knits, and simulations that reduced models take their joints from.

    Raises ConfigurationError, naming both scenes and the key.
    """
    members = load_families(config)
    for scene in checked:
        first = knits[scene.knit]
        where = members[scene.name].where
        there = first.geometry_inputs
        for name, value in scene.geometry_inputs.items():
            if there.get(name) != value:
                differs = f"{name} is {value!r}, there {there.get(name)!r}"
                message = f"knit is {scene.knit!r}, as in scene {first.name!r}, but {differs}"
                raise ConfigurationError(f"{where}: {message}; scenes of one knit share its geometry")
        for key in filter(scene.value, scene.kind.fidelity.sources):
            Source.of(scene, key, scenes, where).check()
