"""What a key of one section allows of another; sections check themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knitstudy.errors import ConfigurationError

if TYPE_CHECKING:
    from knitstudy.study.scene import Scene


def check_keys_together(scene: Scene, where: str) -> None:
    """Check the sections of a scene against each other.

    Raises
    ------
    ConfigurationError
        Naming both keys.
    """
    for name, value in scene.kind.specimen.requires.items():
        if scene.value(name) not in (None, value):
            raise ConfigurationError(
                f"{where}: {name} is {scene.value(name)!r} but must be {value} where specimen is {scene.specimen},"
                f" {scene.kind.specimen.meaning}"
            )
    if "pattern" in scene.sections:
        _check_room(scene, where)
    if "pair" in scene.sections and scene.pair.length <= 2 * scene.yarn.diameter:
        raise ConfigurationError(
            f"{where}: pair.length is {scene.pair.length:g} m but must exceed twice yarn.diameter,"
            f" {scene.yarn.diameter:g} m"
        )
    if scene.specimen in ("knit", "cut_knit") and scene.value("contact.tied_edges") == "outer":
        _check_edges(scene, where)
    if scene.specimen == "cell":
        _check_cell(scene, where)


def _check_room(scene: Scene, where: str) -> None:
    """Check that a knit has room for its yarns, and an entry for every control point."""
    diameter = scene.yarn.diameter
    for name in ("course_spacing", "wale_spacing"):
        spacing = getattr(scene.pattern, name)
        if spacing <= diameter:
            raise ConfigurationError(
                f"{where}: pattern.{name} is {spacing:g} m but must exceed yarn.diameter, {diameter:g} m"
            )
    ratio, spacing = scene.pattern.course_ratio, scene.pattern.course_spacing
    if ratio * spacing <= diameter:
        raise ConfigurationError(
            f"{where}: pattern.course_ratio is {ratio:g} but must exceed yarn.diameter / pattern.course_spacing,"
            f" {diameter / spacing:.4g}"
        )
    points, entries = len(scene.pattern.control_points), len(scene.geometry.free)
    if entries != points:
        raise ConfigurationError(
            f"{where}: geometry.free has {entries} entries but must have {points}, one for each of"
            " pattern.control_points"
        )


def _check_cell(scene: Scene, where: str) -> None:
    """Check that a cell is solved as cells are, and is written only where it has a stiffness at rest."""
    if scene.solver.linear not in ("auto", "lu"):
        raise ConfigurationError(
            f"{where}: solver.linear is {scene.solver.linear!r} but must be auto or lu where specimen is cell, which"
            " is solved directly"
        )
    if "deck" in scene.outputs and scene.kind.interaction.touches:
        raise ConfigurationError(
            f"{where}: outputs is {list(scene.outputs)} but must be [] where specimen is cell and interaction"
            f" {scene.interaction}: before its yarns touch a knit is no shell; use interaction tie"
        )


def _check_edges(scene: Scene, where: str) -> None:
    """Check that something is left between edges that are tied."""
    name = "rows" if scene.load.direction == "course" else "loops"
    count = getattr(scene.pattern, name)
    if count < 3:
        raise ConfigurationError(
            f"{where}: contact.tied_edges is 'outer' but must be none where pattern.{name} is {count}:"
            " nothing is left that is not tied"
        )
