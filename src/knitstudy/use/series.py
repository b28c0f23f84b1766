"""Time series for ParaView (``.pvd``): all increments of a history of any model.

A series consists of yarns as lines, crossings with their forces, points in contact, and solids at full load. Points are
undeformed and carry ``displacement [m]``, for the filter Warp By Vector.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr

from knitstudy.files import write_text
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.use.vtu import write_deformed, write_grid

SHIFTED = "displacement [m]"

NO_FIELDS = ("increment", "position", "reference", "cell", "displacement", "tied")
"""Variables of points in contact, ``contact_...``, and crossings, ``crossing_...``, that are no fields."""

Part = tuple[str, np.ndarray, np.ndarray, dict]  # Name, points (P, 3), cells (C, 1 or 2), fields (P, ...)


def write_series(
    scene: Scene, path: Path | str, geometry: xr.Dataset, history: xr.Dataset, mesh: xr.Dataset | None = None
) -> None:
    """Write a history as ``NAME.pvd``, with its grids in the folder ``NAME``, and solids as ``NAME.vtu``.

    Its times are strains, or load factors where strain does not increase all the way. Solids are there where the
    history holds the displacement of their nodes: with output ``fields``, at the last increment.
    Raises DataFileError if a file cannot be written.
    """
    path, fabric = Path(path), fabric_of(geometry)
    folder, last = path.with_suffix(""), history.sizes["increment"] - 1
    times, name = times_of(history)
    entries = []
    for number, time in enumerate(times.tolist()):
        for part, points, cells, fields in (
            _yarns(scene, history, number),
            *_points(fabric, history, number),
        ):
            target = folder / f"{part}-{number:04}.vtu"
            write_grid(target, points, cells, fields)
            entries.append((time, part, f"{path.stem}/{target.name}"))
        solid = mesh is not None or scene.fidelity == "spline_yarns"
        if number == last and solid and "node_displacement" in history:
            write_deformed(scene, path.with_suffix(".vtu"), geometry, mesh, history)
            entries.append((time, "solids", f"{path.stem}.vtu"))
    order = {part: number for number, part in enumerate(dict.fromkeys(part for _, part, _ in entries))}
    lines = [
        f'    <DataSet timestep="{time!r}" part="{order[part]}" name="{part}" file={quoteattr(file)}/>'
        for time, part, file in entries
    ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    comment = f"  <!-- {scene.name.replace('--', '- ')}; timestep: {name} -->"
    write_text(
        "\n".join([head, comment, "  <Collection>", *lines, "  </Collection>", "</VTKFile>", ""]), path
    )
    for old in set(folder.glob("*-[0-9]*.vtu")) - {path.parent / file for _, _, file in entries}:
        old.unlink()  # increments that this history does not have


def times_of(history: xr.Dataset) -> tuple[np.ndarray, str]:
    """Return the times (increment,) of a history, which increase, and their meaning."""
    strain = history["strain"].to_numpy()
    rises = (np.diff(strain) > 0).all()
    return (strain, "strain [1]") if rises else (history["load"].to_numpy(), "load factor [1]")


def _yarns(scene: Scene, history: xr.Dataset, number: int) -> Part:
    """Return the yarns at an increment, as lines from station to station."""
    yarn, arc_length = (history[name].to_numpy() for name in ("yarn", "arc_length"))
    order = np.lexsort((arc_length, yarn))
    first = np.flatnonzero(yarn[order][1:] == yarn[order][:-1])
    fields = {
        SHIFTED: history["centreline_displacement"].to_numpy()[number],
        "yarn": yarn,
        "arc_length [m]": arc_length,
        "radius [m]": np.full(len(yarn), scene.yarn.radius),
    }
    cells = np.column_stack([order[first], order[first + 1]])
    return "yarns", history["centreline"].to_numpy(), cells, fields


def _points(fabric: Fabric, history: xr.Dataset, number: int) -> Iterator[Part]:
    """Yield crossings and points in contact at an increment, where the history has them."""
    place = fabric.crossings.point.mean(axis=1)
    if "crossing_force" in history and history.sizes["crossing"] == len(place):
        now = history.isel(increment=number)
        moved = now["crossing_displacement"].to_numpy().mean(axis=1)
        yield "crossings", place, np.arange(len(place))[:, None], {SHIFTED: moved} | _fields(now, "crossing")
    if "contact_position" in history:
        now = history.isel(point=history["contact_increment"].to_numpy() == number)
        rest = now["contact_reference"].to_numpy()
        moved = now["contact_position"].to_numpy() - rest
        yield "contact", rest, np.arange(len(rest))[:, None], {SHIFTED: moved} | _fields(now, "contact")


def _fields(now: xr.Dataset, kind: str) -> dict[str, np.ndarray]:
    """Return the fields of crossings or points at an increment, with units in their names."""
    names = {name: str(name).removeprefix(f"{kind}_") for name in now.data_vars}
    return {
        f"{short} [{now[name].attrs.get('units', '1')}]".removesuffix(" [1]"): now[name].to_numpy()
        for name, short in names.items()
        if short != name and short not in NO_FIELDS
    }
