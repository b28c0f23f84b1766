"""Fig. 7c: where the yarns of the centre cell touch each other, at the points 1 to 4 of Figs. 7a and 7b."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from knitstudy.figures.annotation import HALO, MILLIMETRE, scale_bar
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import show
from knitstudy.figures.shapes import tube
from knitstudy.figures.style import ACCENT, DOUBLE, INK, YARNS, figure, panel_letter, styled, tint
from knitstudy.figures.surface import Surface
from knitstudy.figures.view import FRONT
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import Snapshot, centre_cell, snapshots

COLOURS = "cividis"

MEGAPASCAL = 1e-6

MARGIN = (1.8, 3.2)
"""Room around the crossings of the cell in x and y, in yarn radii."""

BEYOND = 0.2
"""How far the yarns are drawn beyond the cell, in loops."""

ARROW = 13.0
"""Length of the arrows to the contacts, points."""


@FIGURES.add(
    "fig07c_contact_area",
    "Fig. 7c: where the centre cell touches",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
    },
)
@styled
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the deformed cell, one panel a point, with what touches over the yarns that hide it.

    Parameters
    ----------
    geometry, dns, contacts : Dataset
        Of one direct simulation with isotropic friction (see docs/architecture.md).
    """
    knit, cell, points = Fabric.from_dataset(geometry), centre_cell(contacts), snapshots(dns)
    window = _window(knit, cell)
    width = 0.98 / len(points)
    height = DOUBLE * (width - 0.01) * (window[3] - window[2]) / (window[1] - window[0])
    drawing = figure(DOUBLE, height + 21)
    foot = 15 / (height + 21)
    touching = [_touching(dns, cell, point.increment) for point in points]
    largest = max((each["contact_pressure"].max(initial=0) for each in touching), default=0) or 1.0
    norm = Normalize(0, MEGAPASCAL * largest)
    for k, (point, points_touching) in enumerate(zip(points, touching, strict=True)):
        axes = drawing.add_axes((0.01 + k * width, foot, width - 0.01, height / (height + 21)))
        show(axes, _yarns(knit, dns, contacts, cell, point.increment), FRONT, window)
        _draw_contacts(axes, points_touching, norm)
        _point_at_contacts(axes, contacts, cell, point, window)
        panel_letter(axes, str(point.number), f"{100 * point.strain:.3g} % strain")
    scale_bar(drawing.axes[0], 2)
    bar = drawing.colorbar(
        ScalarMappable(norm, COLOURS),
        cax=drawing.add_axes((0.3, 0.62 * foot, 0.4, 0.13 * foot)),
        orientation="horizontal",
    )
    bar.set_label("contact pressure (MPa)", labelpad=1)
    return drawing


def _window(knit: Fabric, cell: np.ndarray) -> tuple[float, float, float, float]:
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
        loop = knit.centrelines[number].length / knit.cells[0]
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
    axes: Axes, contacts: xr.Dataset, cell: np.ndarray, point: Snapshot, window: tuple[float, ...]
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
        axes.text(
            0.5,
            0.5,
            "no contact",
            transform=axes.transAxes,
            ha="center",
            va="center",
            color=INK,
            path_effects=HALO,
        )
