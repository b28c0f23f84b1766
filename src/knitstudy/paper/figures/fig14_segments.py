"""Fig. 14: contact areas of a cell, its six segments, the axes of their principal stress, and the honeycombs."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from knitstudy.errors import GeometryError
from knitstudy.knit.contacts.segments import BETWEEN, KINDS
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.models.rom2d.build import Heights, heights, heights_by_stress, zone_places
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.measures.centre_cell import SEGMENT, central, centre_cell
from knitstudy.paper.cases import angles_by_geometry, angles_of_stress
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
BETWEEN_ROWS = 16.0  # room for the names above a row of honeycombs [mm of the knit]
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
def draw(geometry: xr.Dataset, contacts: xr.Dataset, paper: pd.DataFrame, **stresses: xr.Dataset) -> Figure:
    """Draw the undeformed centre cell with its segments and axes, and honeycombs of this study and of Table 4."""
    knit = fabric_of(geometry)
    by_direction = {way: stresses[f"isotropic_{way}_dns_stress"] for way in TENSION}
    centroid = contacts["centroid"].to_numpy()
    window = window_around(centroid[centre_cell(contacts)], MILLIMETRE * knit.radius * np.array(MARGIN))
    picture = Picture(yarn_tubes(knit, yarn_colours(knit, YARNS)), FRONT, window, 2, directions=False)
    titles = "segments and axes, undeformed cell", "honeycombs, their angles to x"
    drawing, (left, right) = draw_rows([(picture, None)], foot=14.0, titles=titles)
    _draw_segments(left, contacts, by_direction, knit.radius)
    size = 2 * MILLIMETRE * np.sqrt(np.nan_to_num(contacts["area"].to_numpy()) / np.pi)
    place: Style = {"offsets": MILLIMETRE * FRONT.project(centroid), "offset_transform": left.transData}
    look: Style = {"facecolor": PAPER, "edgecolor": INK, "linewidth": 1.2, "zorder": 6}
    left.add_collection(EllipseCollection(size, size, 0 * size, units="xy", **place, **look), autolim=False)
    left.scatter([], [], s=25, **look, label="contact, true area")
    _draw_honeycombs(right, honeycombs(knit, contacts_of_crossings(knit), by_direction, paper), knit)
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


@dataclass(frozen=True)
class Honeycomb:
    """A honeycomb whose zones have the distances of a knit along x."""

    name: str
    colour: str
    place: np.ndarray  # (4, 2) of the zones in a cell of the knit [mm]
    rows: Heights

    @property
    def zone(self) -> np.ndarray:
        """Places (4, 2) of the zones in a cell [mm]."""
        interlock = MILLIMETRE * self.rows.interlock
        return np.column_stack([self.place[:, 0], [0, 0, interlock, interlock]])

    @property
    def step(self) -> float:
        """Height of a row [mm]."""
        return MILLIMETRE * self.rows.course

    @property
    def angles(self) -> tuple[float, float]:
        """Angles to x of interlocks (segments 2 and 3) and legs (4 and 5) [deg]."""
        x = self.place[:, 0]
        step = 0.5 * (abs(x[2] - x[0]) + abs(x[3] - x[1])) / MILLIMETRE
        interlock, leg = np.degrees(np.arctan2([self.rows.interlock, self.rows.leg], step))
        return float(interlock), float(leg)


def honeycombs(
    knit: Fabric, contacts: xr.Dataset, stresses: dict[str, xr.Dataset], paper: pd.DataFrame
) -> list[list[Honeycomb]]:
    """Return the honeycombs by geometry, course and wale tension: of this study, as claim M2 has them, and of Table 4.

    The paper prints no lengths: its honeycombs have the distances along x of this study.
    """
    place = MILLIMETRE * zone_places(knit, contacts)
    rise = float(place[2:, 1].mean() - place[:2, 1].mean()) / MILLIMETRE
    beams = MODELS["rom2d"].colour
    ours = [Honeycomb("by geometry", beams, place, Heights(rise, knit.cell[1] - rise))]
    for way, stress in stresses.items():
        with suppress(GeometryError):  # axes that give no honeycomb
            rows = heights_by_stress(knit, contacts, stress)
            ours.append(Honeycomb(f"{way} tension", TENSION[way], place, rows))
    printed = {"geometry": angles_by_geometry(paper)} | {way: angles_of_stress(paper, way) for way in TENSION}
    theirs = []
    for way, angles in printed.items():
        rows = heights(knit, contacts, float(angles[1:3, 0].mean()), float(angles[3:5, 0].mean()))
        theirs.append(Honeycomb(f"paper, {way}", TENSION.get(way, beams), place, rows))
    return [ours, theirs]


def _draw_honeycombs(axes: Axes, rows: list[list[Honeycomb]], knit: Fabric) -> None:
    """Draw some cells of the honeycombs on one scale, a row each of this study and of the paper."""
    width = MILLIMETRE * knit.cell[0]
    floor = 0.0
    for row in reversed(rows):
        tops = []
        for number, each in enumerate(row):
            lines = _honeycomb(each.zone, np.array([width, each.step]))
            lines[..., 0] += number * (COLUMNS + 0.6) * width
            lines[..., 1] += floor
            axes.add_collection(
                LineCollection([*lines], colors=each.colour, linewidths=2.0, capstyle="round")
            )
            tops.append(lines[..., 1].max() + 1.0)
            interlock, leg = each.angles
            text = f"{each.name}\n{interlock:.0f}°, {leg:.0f}°; {each.step:.3g} mm"
            look: Style = {"ha": "center", "va": "bottom", "color": each.colour}
            axes.text(lines[..., 0].mean(), tops[-1], text, **look)
        floor = max(tops) + BETWEEN_ROWS
    axes.margins(0.06, 0.12)
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
