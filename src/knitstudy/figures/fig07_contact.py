"""Fig. 7: contact zones (a), force (b) and where yarns touch (c) in the centre cell with isotropic friction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import strain_label
from knitstudy.figures.picture import HALO, Window, scale_bar, show, write
from knitstudy.figures.renderer import FRONT, MILLIMETRE, Surface
from knitstudy.figures.shapes import tube
from knitstudy.figures.style import (
    ACCENT,
    DOUBLE,
    FAINT,
    INTERACTIONS,
    MEGAPASCAL,
    PERCENT,
    YARNS,
    figure,
    panel_letter,
    tint,
)
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import Snapshot, area_of_cell, centre_cell, snapshots, zones_of_cell

COLOURS = "cividis"
SQUARE_MILLIMETRES = 1e6
CURVES, PICTURES, BAR = 88.0, 8.0, 14.0
"""Heights of (a) and (b), of the titles of (c), and of the colour bar below [mm]."""

MARGIN = (1.8, 3.2)  # room around the crossings of the cell in x and y, in yarn radii
BEYOND = 0.2  # how far the yarns are drawn beyond the cell, in loops
ARROW = 13.0  # length of the arrows to the contacts, points


@FIGURES.add(
    "fig07_contact",
    "Fig. 7: contact zones, force and where the centre cell touches, isotropic friction",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
    },
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw number and area of the contact zones and the force over strain, and the deformed cell at four strains."""
    knit, cell, points = Fabric.from_dataset(geometry), centre_cell(contacts), snapshots(dns)
    window = _window(knit, cell)
    width = 0.98 / len(points)
    panel = DOUBLE * (width - 0.01) * (window[3] - window[2]) / (window[1] - window[0])
    height = CURVES + PICTURES + panel + BAR
    drawing = figure(DOUBLE, height)
    foot = (BAR + panel + PICTURES) / height
    upper, lower, force = (
        drawing.add_axes((left, foot + bottom / height, wide, high / height))
        for left, bottom, wide, high in (
            (0.075, 49.0, 0.4, 30.0),
            (0.075, 17.0, 0.4, 28.0),
            (0.57, 17.0, 0.4, 62.0),
        )
    )
    _draw_curves(upper, lower, force, dns, contacts)
    text = ";  ".join(point.label for point in points)
    drawing.text(0.5, foot + 2.0 / height, text, ha="center", va="bottom", fontsize=7.0)
    touching = [_touching(dns, cell, point.increment) for point in points]
    largest = max((each["contact_pressure"].max(initial=0) for each in touching), default=0) or 1.0
    norm = Normalize(0, MEGAPASCAL * largest)
    for k, (point, here) in enumerate(zip(points, touching, strict=True)):
        axes = drawing.add_axes((0.01 + k * width, BAR / height, width - 0.01, panel / height))
        show(axes, _yarns(knit, dns, contacts, cell, point.increment), FRONT, window)
        _draw_contacts(axes, here, norm)
        _point_at_contacts(axes, contacts, cell, point, window)
        panel_letter(axes, f"c{point.number}", f"{PERCENT * point.strain:.3g} % strain")
        if k == 0:
            scale_bar(axes, 2)
    place = (0.3, 0.62 * BAR / height, 0.4, 0.13 * BAR / height)
    bar = drawing.colorbar(
        ScalarMappable(norm, COLOURS), cax=drawing.add_axes(place), orientation="horizontal"
    )
    bar.set_label("contact pressure (MPa)", labelpad=1)
    return drawing


def _draw_curves(upper: Axes, lower: Axes, force: Axes, dns: xr.Dataset, contacts: xr.Dataset) -> None:
    """Draw number and area of contact zones one above the other, and the force beside them."""
    look = INTERACTIONS["isotropic"].line | {"linestyle": "-", "clip_on": False}
    strain = PERCENT * contacts["strain"].to_numpy()
    # A number of zones holds until the next increment shows another one.
    upper.plot(strain, zones_of_cell(contacts), drawstyle="steps-post", **look)
    upper.set(ylabel="contact zones (1)", xticklabels=[])
    upper.yaxis.set_major_locator(MaxNLocator(integer=True))
    lower.plot(strain, SQUARE_MILLIMETRES * area_of_cell(contacts), **look)
    lower.set(xlabel=strain_label("course"), ylabel="contact area (mm²)")
    force.plot(PERCENT * dns["strain"], dns["force"], **look)
    force.set(xlabel=strain_label("course"), ylabel="reaction force (N)")
    points = snapshots(contacts)
    for axes in (upper, lower, force):
        axes.set_xlim(0, strain[-1])
        axes.set_ylim(0, None)
        for point in points:
            axes.axvline(PERCENT * point.strain, color=FAINT, linewidth=0.7, linestyle=":", zorder=0)
    for axes, letter in ((upper, "a"), (force, "b")):
        _number(axes, points)
        axes.text(-0.17, 1.06, f"({letter})", transform=axes.transAxes, fontsize=8.5)


def _number(axes: Axes, points: Sequence[Snapshot]) -> None:
    """Write the number of each strain above the axes, apart from its neighbours, with a thin line to the strain."""
    left, right = axes.get_xlim()
    apart, place = 0.045 * (right - left), -np.inf
    for point in points:
        x = PERCENT * point.strain
        place = max(x, place + apart)
        line = {"arrowstyle": "-", "linewidth": 0.7, "color": FAINT, "shrinkA": 1, "shrinkB": 0}
        look = {"ha": "center", "va": "bottom", "fontweight": "bold", "annotation_clip": False}
        frames = {"xycoords": ("data", "axes fraction"), "textcoords": ("data", "axes fraction")}
        axes.annotate(str(point.number), (x, 1.0), (place, 1.06), arrowprops=line, **look, **frames)


def _window(knit: Fabric, cell: np.ndarray) -> Window:
    """Return left, right, bottom and top about the crossings of the undeformed cell [mm]."""
    place, room = (
        FRONT.project(knit.crossings.point[cell].reshape(-1, 3)),
        np.multiply(MARGIN, knit.radius),
    )
    (left, bottom), (right, top) = place.min(axis=0) - room, place.max(axis=0) + room
    return tuple(MILLIMETRE * edge for edge in (left, right, bottom, top))


def _yarns(
    knit: Fabric, dns: xr.Dataset, contacts: xr.Dataset, cell: np.ndarray, increment: int
) -> list[Surface]:
    """Return the two yarns of the cell, deformed."""
    column, surfaces = int(contacts["column"][cell[0]]), []
    position = dns["centreline"].to_numpy() + dns["centreline_displacement"].to_numpy()[increment]
    yarn, s = dns["yarn"].to_numpy(), dns["arc_length"].to_numpy()
    for number in contacts["yarn"].to_numpy()[cell[0]]:
        loop = knit.centrelines[number].length / knit.repeats
        here = (yarn == number) & (s >= (column - BEYOND) * loop) & (s <= (column + 1 + BEYOND) * loop)
        surfaces.append(tube(position[here], knit.radius, tint(YARNS[number % len(YARNS)])))
    return surfaces


def _touching(dns: xr.Dataset, cell: np.ndarray, increment: int) -> dict[str, np.ndarray]:
    """Return position and pressure of the points that touch in the cell at an increment."""
    here = (dns["contact_increment"].to_numpy() == increment) & np.isin(dns["contact_crossing"], cell)
    return {name: dns[name].to_numpy()[here] for name in ("contact_position", "contact_pressure")}


def _draw_contacts(axes: Axes, touching: dict[str, np.ndarray], norm: Normalize) -> None:
    pressure = MEGAPASCAL * touching["contact_pressure"]
    order = np.argsort(pressure)
    place = MILLIMETRE * FRONT.project(touching["contact_position"][order])
    axes.scatter(
        *place.T, c=pressure[order], norm=norm, cmap=COLOURS, s=5, linewidth=0, zorder=5, rasterized=True
    )


def _point_at_contacts(
    axes: Axes, contacts: xr.Dataset, cell: np.ndarray, point: Snapshot, window: Window
) -> None:
    """Draw an arrow to every contact from outside of the cell's middle; say so where there is none."""
    now = contacts.isel(increment=point.increment, crossing=cell)
    closed = now["zones"].to_numpy() > 0
    middle = np.array([window[0] + window[1], window[2] + window[3]]) / 2
    for tip in MILLIMETRE * FRONT.project(now["contact_centroid"].to_numpy()[closed]):
        outwards = (tip - middle) / np.linalg.norm(tip - middle)
        axes.annotate(
            "",
            tip + 0.35 * outwards,
            xytext=tuple((ARROW + 6) * outwards),
            textcoords="offset points",
            arrowprops={"arrowstyle": "-|>", "linewidth": 1.4, "color": ACCENT, "path_effects": HALO},
            zorder=8,
        )
    if not closed.any():
        write(axes, (0.5, 0.5), "no contact", transform=axes.transAxes)
