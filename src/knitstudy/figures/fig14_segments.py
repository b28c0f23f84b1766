"""Fig. 14: contact areas of a cell, its six segments, the axes of their principal stress, and the honeycombs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from knitstudy.contacts.segments import KINDS
from knitstudy.errors import GeometryError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import HALO, scale_bar, show, write
from knitstudy.figures.renderer import FRONT, MILLIMETRE
from knitstudy.figures.shapes import yarn_tubes
from knitstudy.figures.style import DOUBLE, INK, MODELS, PAPER, figure, panel_letter
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.segments import SEGMENT, central
from knitstudy.models.network_2d import heights_by_stress, zone_places

TENSION = {"course": "#0072B2", "wale": "#8E1B5A"}  # colours of the axes in course and in wale tension
YARNS = ("#D8D4CC", "#EFECE6")  # of neighbouring yarns, pale below the segments
STROKE = 1.5  # half the length of the stroke along an axis, over the yarn's radius
MARGIN = (5.0, 4.0)  # room around the zones of the cell, in yarn radii
COLUMNS, ROWS = 2, 1  # cells of every honeycomb that are drawn
FOOT, HEAD = 14.0, 8.0  # room for the legend below and for titles above [mm]


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
    """Draw the undeformed centre cell with its segments and axes, and beside it the three honeycombs on one scale."""
    knit = Fabric.from_dataset(geometry)
    found = {way: stresses[f"isotropic_{way}_dns_stress"] for way in TENSION}
    window = _window(knit, contacts)
    height = 0.46 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    drawing = figure(DOUBLE, height + HEAD + FOOT)
    share = height / (height + HEAD + FOOT)
    foot = FOOT / (height + HEAD + FOOT)
    axes = drawing.add_axes((0.01, foot, 0.46, share))
    show(axes, yarn_tubes(knit, YARNS), FRONT, window)
    panel_letter(axes, "a", "segments and axes, undeformed cell")
    _draw_zones(axes, contacts, window)
    _draw_segments(axes, contacts, found, knit.radius)
    scale_bar(axes, 2)
    axes = drawing.add_axes((0.50, foot, 0.49, share))
    _draw_honeycombs(axes, knit, contacts, found)
    panel_letter(axes, "b", "honeycombs")
    _legend(drawing)
    return drawing


def _window(knit: Fabric, contacts: xr.Dataset) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top about the zones of the centre cell [mm]."""
    place = FRONT.project(contacts["centroid"].to_numpy()[centre_cell(contacts)])
    room = np.multiply(MARGIN, knit.radius)
    (left, bottom), (right, top) = place.min(axis=0) - room, place.max(axis=0) + room
    top += 0.5 * knit.cell[1]
    return tuple(MILLIMETRE * float(edge) for edge in (left, right, bottom, top))


def _draw_zones(axes: Axes, contacts: xr.Dataset, window: tuple[float, ...]) -> None:
    """Draw every contact as a circle of its area about its centroid."""
    centre = MILLIMETRE * FRONT.project(contacts["centroid"].to_numpy())
    radius = MILLIMETRE * np.sqrt(np.nan_to_num(contacts["area"].to_numpy()) / np.pi)
    for (x, y), size in zip(centre, radius, strict=True):
        if window[0] < x < window[1] and window[2] < y < window[3]:
            axes.add_patch(Circle((x, y), size, facecolor=PAPER, edgecolor=INK, linewidth=1.2, zorder=6))


def _draw_segments(axes: Axes, contacts: xr.Dataset, stresses: dict[str, xr.Dataset], radius: float) -> None:
    """Draw the segments of the centre cell with their numbers, and strokes along the axes at their middles."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    place = {
        key: MILLIMETRE * FRONT.project(centroid)
        for key, centroid in zip(
            zip(row.tolist(), column.tolist(), zone.tolist(), strict=True),
            contacts["centroid"].to_numpy(),
            strict=True,
        )
    }
    any_stress = next(iter(stresses.values()))
    length = STROKE * MILLIMETRE * radius
    for kind in KINDS:
        for segment in central(any_stress, kind):
            r, c = (int(any_stress[f"segment_{name}"][segment]) for name in ("row", "column"))
            ends = _ends(kind, r, c)
            line = np.array([place[end] for end in ends])
            axes.plot(*line.T, color=MODELS["rom2d"].colour, linewidth=2.2, path_effects=HALO, zorder=5)
            middle = line.mean(axis=0)
            for way, each in stresses.items():
                axis = FRONT.project(each["segment_axis"].sel(extent="whole").to_numpy()[segment, 0])
                stroke = middle + length * np.outer([-1, 1], axis)
                axes.plot(*stroke.T, color=TENSION[way], linewidth=1.8, path_effects=HALO, zorder=7)
            write(axes, middle + _beside(line), str(SEGMENT[kind]))


def _ends(kind: str, row: int, column: int) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """Return row, column and zone of the two ends of a segment."""
    up, right = (row + 1, column), (row, column + 1)
    here = (row, column)
    return {
        "head": ((*here, 2), (*here, 3)),
        "interlock, left": ((*here, 0), (*here, 2)),
        "interlock, right": ((*here, 1), (*here, 3)),
        "leg, left": ((*here, 2), (*up, 0)),
        "leg, right": ((*here, 3), (*up, 1)),
        "sinker": ((*here, 1), (*right, 0)),
    }[kind]


def _beside(line: np.ndarray) -> np.ndarray:
    """Return the way from a segment's middle to its number [mm]."""
    along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    across = np.array([-along[1], along[0]])
    return 0.55 * across + 0.75 * along


def _draw_honeycombs(axes: Axes, knit: Fabric, contacts: xr.Dataset, stresses: dict[str, xr.Dataset]) -> None:
    """Draw some cells of the three honeycombs, side by side on one scale."""
    place = MILLIMETRE * zone_places(knit, contacts)
    width, course = MILLIMETRE * knit.cell[0], MILLIMETRE * knit.cell[1]
    rise = float(place[2:, 1].mean() - place[:2, 1].mean())
    found = {"geometry": (rise, course - rise, MODELS["rom2d"].colour)}
    for way, each in stresses.items():
        try:
            rows = heights_by_stress(knit, contacts, each)
        except GeometryError as error:
            axes.text(0.5, 0.02, f"{way} tension: {error}", transform=axes.transAxes, ha="center", wrap=True)
            continue
        found[way] = (MILLIMETRE * rows.interlock, MILLIMETRE * rows.leg, TENSION[way])
    step = (COLUMNS + 0.6) * width
    for number, (name, (interlock, leg, colour)) in enumerate(found.items()):
        lines = _cells(place[:, 0], width, interlock, leg) + np.array([number * step, 0.0])
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=2.0, capstyle="round"))
        said = "by geometry" if name == "geometry" else f"{name} tension"
        above = lines[..., 1].max() + 1.0
        text = f"{said}\n{interlock + leg:.3g} mm a row"
        axes.text(lines[..., 0].mean(), above, text, ha="center", va="bottom", color=colour)
    axes.margins(0.04, 0.12)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()


def _cells(x: np.ndarray, width: float, interlock: float, leg: float) -> np.ndarray:
    """Return the lines (k, 2, 2) of some cells from the places (4,) of zones along x [mm]."""
    lines = []
    for row in range(ROWS + 1):
        base = row * (interlock + leg)
        y = base + np.array([0.0, 0.0, interlock, interlock])
        for column in range(COLUMNS):
            zone = np.column_stack([x + column * width, y])
            lines += [(zone[2], zone[3]), (zone[0], zone[2]), (zone[1], zone[3])]
            if column + 1 < COLUMNS:
                lines.append((zone[1], zone[0] + np.array([width, 0.0])))
            if row < ROWS:
                lines += [(zone[2 + side], zone[side] + np.array([0.0, interlock + leg])) for side in (0, 1)]
    return np.array(lines)


def _legend(drawing: Figure) -> None:
    contact = {
        "linestyle": "",
        "marker": "o",
        "markersize": 5,
        "markerfacecolor": PAPER,
        "markeredgecolor": INK,
    }
    handles = [Line2D([], [], color=MODELS["rom2d"].colour, linewidth=2.2, label="segment by geometry")]
    for way, colour in TENSION.items():
        label = f"axis of principal stress, {way} tension"
        handles.append(Line2D([], [], color=colour, linewidth=1.8, label=label))
    handles.append(Line2D([], [], **contact, label="contact, true area"))
    drawing.legend(handles=handles, loc="lower center", ncols=2, labelcolor=INK)
