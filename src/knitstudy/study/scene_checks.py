"""What one key of a scene allows of another; the JSON schema checks each key alone."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from knitstudy.errors import ConfigurationError

if TYPE_CHECKING:
    from knitstudy.study.scene import Scene

FULL = ("dns", "beam")
"""Fidelities that need no other simulation."""


def check_keys_together(scene: Scene, where: str) -> None:
    """Check the keys of a scene against each other.

    Raises
    ------
    ConfigurationError
        Naming both keys.
    """
    if scene.specimen == "pair":
        _check_pair(scene, where)
    else:
        _check_knit(scene, where)
    _check_load(scene, where)
    fidelity, source = scene.fidelity, scene.rom.contacts_from
    if fidelity in FULL and source is not None:
        raise ConfigurationError(
            f"{where}: rom.contacts_from is {source!r} but must be empty where fidelity is {fidelity}"
        )
    if fidelity not in FULL and source is None:
        raise ConfigurationError(
            f"{where}: rom.contacts_from is empty but must name a dns scene where fidelity is {fidelity}"
        )
    if fidelity == "beam" and scene.interaction == "tie":
        raise ConfigurationError(
            f"{where}: interaction is 'tie' but must be rough or isotropic where fidelity is beam: tied beams are the"
            " model of fidelity rom3d"
        )
    _check_springs(scene, where)


def _check_springs(scene: Scene, where: str) -> None:
    """Check that springs of another scene, or given ones, are asked for where there are springs, and fit."""
    rom = scene.rom
    for key, value, empty in (
        ("springs_from", rom.springs_from, "empty"),
        ("stiffness", list(rom.stiffness) or None, "[]"),
    ):
        asked = f"{where}: rom.{key} is {value!r} but must be {empty} where"
        if value is not None and (scene.fidelity != "rom3d" or scene.interaction == "tie"):
            raise ConfigurationError(
                f"{asked} fidelity is {scene.fidelity} and interaction is {scene.interaction}: only a rom3d without"
                " ties has springs"
            )
        if value is not None and rom.springs != "averaged":
            raise ConfigurationError(
                f"{asked} rom.springs is {rom.springs}: every crossing's own springs are measured at that crossing"
            )
    if rom.stiffness and (len(rom.stiffness) != 3 or rom.axes != "global" or rom.springs_from):
        raise ConfigurationError(
            f"{where}: rom.stiffness is {list(rom.stiffness)} but must be [] or three values, along x, y and z, which"
            " takes rom.axes global and an empty rom.springs_from"
        )


def _check_knit(scene: Scene, where: str) -> None:
    """Check that a knit has room for its yarns, an entry for every control point, and rows that can touch."""
    diameter = scene.yarn.diameter
    for key in ("course_spacing", "wale_spacing"):
        spacing = getattr(scene.pattern, key)
        if spacing <= diameter:
            raise ConfigurationError(
                f"{where}: pattern.{key} is {spacing:g} m but must exceed yarn.diameter, {diameter:g} m"
            )
    points, entries = len(scene.pattern.control_points), len(scene.geometry.free)
    if entries != points:
        raise ConfigurationError(
            f"{where}: geometry.free has {entries} entries but must have {points}, one for each of"
            " pattern.control_points"
        )
    key = "rows" if scene.load.direction == "course" else "loops"
    count = getattr(scene.pattern, key)
    if scene.interaction != "tie" and scene.contact.tied_edges == "outer" and count < 3:
        raise ConfigurationError(
            f"{where}: contact.tied_edges is 'outer' but must be none where pattern.{key} is {count}:"
            " nothing is left that is not tied"
        )


def _check_pair(scene: Scene, where: str) -> None:
    """Check that two crossing yarns are simulated directly, and are longer than the place where they cross."""
    if scene.fidelity != "dns":
        raise ConfigurationError(
            f"{where}: fidelity is {scene.fidelity!r} but must be dns where specimen is pair"
        )
    if scene.pair.length <= 2 * scene.yarn.diameter:
        raise ConfigurationError(
            f"{where}: pair.length is {scene.pair.length:g} m but must exceed twice yarn.diameter,"
            f" {scene.yarn.diameter:g} m"
        )


def _check_load(scene: Scene, where: str) -> None:
    """Check that a load is one of its specimen, and that stops lie on its way."""
    load, specimen = scene.load, scene.specimen
    directions = ("path",) if specimen == "pair" else ("course", "wale")
    if load.direction not in directions:
        raise ConfigurationError(
            f"{where}: load.direction is {load.direction!r} but must be {' or '.join(directions)} where specimen is"
            f" {specimen}"
        )
    if specimen == "knit" and load.path:
        raise ConfigurationError(f"{where}: load.path has {len(load.path)} legs but must be [] for a knit")
    if specimen == "pair" and not load.path:
        raise ConfigurationError(f"{where}: load.path is empty but must have a leg or more for a pair")
    if specimen == "pair" and load.stops:
        raise ConfigurationError(
            f"{where}: load.stops is {list(load.stops)} but must be [] for a pair, whose legs end increments"
        )
    bounds = (0.0, *load.stops, load.strain)
    if any(later <= earlier for earlier, later in pairwise(bounds)):
        raise ConfigurationError(
            f"{where}: load.stops is {list(load.stops)} but must rise between 0 and load.strain, {load.strain:g}"
        )
