"""Pictures of the deformed knit in a result file: the options of ``knitstudy show`` that write them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from knitstudy.errors import DataFileError
from knitstudy.run.commands import console

if TYPE_CHECKING:
    import xarray as xr


def write_pictures(
    file: Path,
    history: xr.Dataset,
    colour: str,
    picture: Path | None,
    animation: Path | None,
    interactive: Path | None,
) -> None:
    """Write the pictures that are asked for of the history in a result file.

    Raises DataFileError when a name has another ending than the format of the picture, or the file holds no history;
    ConfigurationError when the history does not hold the values of the colour.
    """
    from knitstudy.use import deformed
    from knitstudy.use.style import save

    formats = ((picture, (".png", ".pdf")), (animation, (".webp",)), (interactive, (".html",)))
    for path, endings in formats:
        if path is not None and path.suffix not in endings:
            raise DataFileError(f"{path}: must end with {' or '.join(endings)}")
    scene, geometry, mesh = console.undeformed(file, history, solids=colour in deformed.FIELDS)
    knit = deformed.deformed(scene, geometry, history, mesh, colour)
    title = f"{scene.name}, {scene.kind.fidelity.label}"
    if animation is not None and len(knit.strain) < 2:
        raise DataFileError(
            f"{animation}: colour {colour!r} is of full load only; an animation takes u_z, slip or force"
        )
    if picture is not None:
        save(deformed.draw(knit), [picture], {"history": history}, title)
    if animation is not None:
        deformed.animate(knit, animation)
    if interactive is not None:
        deformed.write_page(knit, interactive, title)
    for path, _ in formats:
        if path is not None:
            click.echo(f"drawn: {path}", err=True)
