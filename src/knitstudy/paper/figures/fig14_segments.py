"""Fig. 14: contact areas of a cell, its six segments, the axes of their principal stress, and the honeycombs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from knitstudy.errors import GeometryError
from knitstudy.knit.contacts.segments import BETWEEN, KINDS
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.models.rom2d.build import heights_by_stress, zone_places
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.measures.centre_cell import SEGMENT, central, centre_cell
from knitstudy.paper.figures import MODELS
from knitstudy.paper.scene_names import solid
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import (
    FRONT,
    HALO,
    Picture,
    draw_rows,
    window_around,
    write,
    yarn_colours,
    yarn_tubes,
)
from knitstudy.use.style import INK, MILLIMETRE, PAPER, Style, shared_legend

TENSION = {"course": "#0072B2", "wale": "#8E1B5A"}  # colours of the axes in course and in wale tension
YARNS = ("#D8D4CC", "#EFECE6")  # of neighbouring yarns, pale below the segments
STROKE = 1.5  # half the length of the stroke along an axis, over the yarn's radius
MARGIN = (6.0, 8.5)  # room around the zones of the cell, in yarn radii
COLUMNS, ROWS = 2, 2  # of the drawn part of every honeycomb
SEGMENTS = {KINDS[kind]: ends for ends, (kind, _) in BETWEEN.items()}
"""Zones at the two ends of a segment, and how many rows and columns the second one lies further."""


@FIGURES.add(
    "fig14_segments",
    "Fig. 14: contact areas, segments and principal stress, isotropic friction",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
        "isotropic_course_dns_stress": solid("stress", "isotropic-course"),
        "isotropic_wale_dns_stress": solid("stress", "isotropic-wale"),
    },
)
def draw(geometry: xr.Dataset, contacts: xr.Dataset, **stresses: xr.Dataset) -> Figure:
    """Draw the undeformed centre cell with its segments and axes, and the three honeycombs on one scale."""
    knit = fabric_of(geometry)
    by_direction = {way: stresses[f"isotropic_{way}_dns_stress"] for way in TENSION}
    centroid = contacts["centroid"].to_numpy()
    window = window_around(centroid[centre_cell(contacts)], MILLIMETRE * knit.radius * np.array(MARGIN))
    picture = Picture(yarn_tubes(knit, yarn_colours(knit, YARNS)), FRONT, window, 2, directions=False)
    titles = "segments and axes, undeformed cell", "honeycombs through the crossings"
    drawing, (left, right) = draw_rows([(picture, None)], foot=14.0, titles=titles)
    _draw_segments(left, contacts, by_direction, knit.radius)
    size = 2 * MILLIMETRE * np.sqrt(np.nan_to_num(contacts["area"].to_numpy()) / np.pi)
    place: Style = {"offsets": MILLIMETRE * FRONT.project(centroid), "offset_transform": left.transData}
    look: Style = {"facecolor": PAPER, "edgecolor": INK, "linewidth": 1.2, "zorder": 6}
    left.add_collection(EllipseCollection(size, size, 0 * size, units="xy", **place, **look), autolim=False)
    left.scatter([], [], s=25, **look, label="contact, true area")
    _draw_honeycombs(right, knit, contacts_of_crossings(knit), by_direction)  # as claim M2 does
    shared_legend(drawing, ncols=2, labelcolor=INK)
    return drawing


def _draw_segments(axes: Axes, contacts: xr.Dataset, stresses: dict[str, xr.Dataset], radius: float) -> None:
    """Draw the segments of the centre cell with their numbers, and strokes along the axes at their middles."""
    labels = zip(*(contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone")), strict=True)
    place = dict(zip(labels, MILLIMETRE * FRONT.project(contacts["centroid"].to_numpy()), strict=True))
    rows, columns = (stresses["course"][f"segment_{name}"].to_numpy() for name in ("row", "column"))
    length = STROKE * MILLIMETRE * radius
    beam: Style = {"color": MODELS["rom2d"].colour, "label": "segment by geometry"}
    for kind, (lower, upper, up, right) in SEGMENTS.items():
        for segment in central(stresses["course"], kind):
            row, column = int(rows[segment]), int(columns[segment])
            line = np.array([place[row, column, lower], place[row + up, column + right, upper]])
            axes.plot(*line.T, **beam, linewidth=2.2, zorder=5, path_effects=HALO)
            middle = line.mean(axis=0)
            for way, stress in stresses.items():
                axis = FRONT.project(stress["segment_axis"].sel(extent="whole").to_numpy()[segment, 0])
                stroke = middle + length * np.outer([-1, 1], axis)
                look: Style = {"color": TENSION[way], "linewidth": 1.8, "zorder": 7, "path_effects": HALO}
                axes.plot(*stroke.T, **look, label=f"axis of principal stress, {way} tension")
            along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
            beside = 0.55 * np.array([-along[1], along[0]]) + 0.75 * along
            write(axes, middle + beside, str(SEGMENT[kind]))


def _draw_honeycombs(axes: Axes, knit: Fabric, contacts: xr.Dataset, stresses: dict[str, xr.Dataset]) -> None:
    """Draw some cells of the three honeycombs, side by side on one scale."""
    place = MILLIMETRE * zone_places(knit, contacts)
    width, course = MILLIMETRE * knit.cell[0], MILLIMETRE * knit.cell[1]
    rise = float(place[2:, 1].mean() - place[:2, 1].mean())
    honeycombs = {"by geometry": (rise, course, MODELS["rom2d"].colour)}
    for way, stress in stresses.items():
        try:
            rows = heights_by_stress(knit, contacts, stress)
        except GeometryError as error:
            axes.text(0.5, 0.02, f"{way} tension: {error}", transform=axes.transAxes, ha="center", wrap=True)
            continue
        honeycombs[f"{way} tension"] = (MILLIMETRE * rows.interlock, MILLIMETRE * rows.course, TENSION[way])
    for number, (name, (interlock, step, colour)) in enumerate(honeycombs.items()):
        zone = np.column_stack([place[:, 0], [0, 0, interlock, interlock]])
        lines = _honeycomb(zone, np.array([width, step]))
        lines[..., 0] += number * (COLUMNS + 0.6) * width
        axes.add_collection(LineCollection([*lines], colors=colour, linewidths=2.0, capstyle="round"))
        above = lines[..., 1].max() + 1.0
        text = f"{name}\n{step:.3g} mm a row"
        axes.text(lines[..., 0].mean(), above, text, ha="center", va="bottom", color=colour)
    axes.margins(0.04, 0.12)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()


def _honeycomb(zone: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Return the lines (k, 2, 2) of some cells (2,) from the places (4, 2) of the zones in a cell [mm]."""
    return np.array(
        [
            (zone[lower] + cell * (column, row), zone[upper] + cell * (column + right, row + up))
            for row in range(ROWS)
            for column in range(COLUMNS)
            for lower, upper, up, right in SEGMENTS.values()
            if row + up < ROWS and column + right < COLUMNS
        ]
    )
