"""Which figures and tables a study can make, and from which files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from knitstudy.measures.selection import roles_of
from knitstudy.stages.table import STAGES, stage_of

if TYPE_CHECKING:
    from knitstudy.measures.catalogue import Catalogue, Display
    from knitstudy.study.scene import Scene

Files = dict[str, str | list[str]]
"""Files by what figures and tables call what is in them; several of one name as a list."""

BESIDE = ("contacts", "geometry", "mesh")
"""Stages whose results of direct simulations figures and tables take besides their histories."""


def files_of(roles: Mapping[str, Scene | list[Scene]], folder: Path | str) -> Files:
    """Return the results of scenes by what figures and tables call them.

    Parameters
    ----------
    roles : mapping of str to Scene or list of Scene
        See `measures.selection`.
    folder : Path or str
        Of all results.

    Returns
    -------
    dict of str to str or list of str
        Histories by the names of the roles; contacts, geometry and mesh of direct simulations under the role's name
        and theirs, "tie_contacts", without the role where it is "dns".
    """
    folder, files = Path(folder), {}
    for role, found in roles.items():
        scenes = found if isinstance(found, list) else [found]
        paths = {role: [stage_of(scene).path(scene) for scene in scenes]}
        direct = [scene for scene in scenes if scene.fidelity == "dns"]
        if direct:
            prefix = "" if role == "dns" else f"{role}_"
            paths |= {
                f"{prefix}{name}": [STAGES.find(name).path(scene) for scene in direct] for name in BESIDE
            }
        for name, several in paths.items():
            listed = [(folder / path).as_posix() for path in several]
            files[name] = listed if isinstance(found, list) else listed[0]
    return files


def possible(
    catalogue: Catalogue, study: Iterable[Scene], reference: Mapping[str, str], folder: Path | str
) -> dict[str, Files]:
    """Return the files that figures or tables are made from, of those that a study has all needs of.

    Parameters
    ----------
    catalogue : Catalogue
        Of figures or of tables.
    study : iterable of Scene
        In the order of the configuration.
    reference : mapping of str to str
        Files of reference by their names.
    folder : Path or str
        Of all results.
    """
    study, found = list(study), {}
    for name, display in catalogue.all().items():
        files = files_of(roles_of(study, display.of), folder) | dict(reference)
        if set(display.needs) <= {*files, "scenes"}:
            found[name] = {need: files[need] for need in display.takes if need in files}
    return found


def scenes_of(display: Display, study: Iterable[Scene]) -> dict[str, Scene]:
    """Return the scenes of what a figure or table takes, where it asks for them; several of a role by their names."""
    if "scenes" not in display.takes:
        return {}
    scenes = {}
    for role, found in roles_of(study, display.of).items():
        if set(display.takes) & files_of({role: found}, "").keys():
            several = isinstance(found, list)
            scenes |= {scene.name: scene for scene in found} if several else {role: found}
    return scenes
