"""Fig. 7: contact zones (a), force (b) and where yarns touch (c) in the centre cell with isotropic friction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.centre_cell import Snapshot, area_of_cell, centre_cell, snapshots, zones_of_cell
from knitstudy.measures.response import deformed_centrelines
from knitstudy.paper.figures import INTERACTIONS
from knitstudy.paper.scene_names import of_solid
from knitstudy.run.catalogue import FIGURES, one
from knitstudy.use.solids import (
    BAR,
    FRONT,
    HALO,
    Picture,
    Surface,
    colour_bar,
    draw_rows,
    scale_bar,
    tube,
    window_around,
    yarn_colours,
)
from knitstudy.use.style import (
    ACCENT,
    FAINT,
    INCH,
    INK,
    MEGAPASCAL,
    MILLIMETRE,
    PAPER,
    PERCENT,
    Style,
    height,
    place,
    tint,
)

CURVES = 88.0  # height of (a) and (b) [mm]
MARGIN = (2.3, 3.2)  # room around the crossings of the cell in x and y, in yarn radii
NUMBERS = 3.0  # from the axes to the numbers of the strains above [mm]
APART = 0.045  # least distance of these numbers, over the width of the axes
START, TICKS = 0.02, (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # begin and ticks of the strains of (a) [%]
ONSET = 0.6  # the inset of (b) ends at this strain [%], up to which increments are small
HEXAHEDRA = (
    "reading-as-printed-yarns-isotropic-course",
    "dns-isotropic-course",
    "dns-isotropic-course-coarse",
)
HEXAHEDRAL: Style = {"color": INK, "linestyle": "--", "marker": "s", "markersize": 3, "clip_on": False}
AREA_FROM = {True: "yarns: of the force, by Hertz", False: "hexahedra: under pressure"}
DOT, RIM = 20.0, 42.0  # areas of a point that touches, and of the white disc behind it [points^2]
ARROW = 17.0  # from a contact to the tail of the arrow to it [points]


@FIGURES.add(
    "fig07_contact",
    "Fig. 7: contact zones, force and where the centre cell touches, isotropic friction",
    results=of_solid("isotropic-course", "geometry", "dns", "contacts")
    | {"hexahedra": one("contacts", *HEXAHEDRA, optional=True)},
)
def draw(
    geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset, hexahedra: xr.Dataset | None = None
) -> Figure:
    """Draw number and area of the contact zones and the force over strain, and the deformed cell at four strains."""
    knit, cell, points = fabric_of(geometry), centre_cell(contacts), snapshots(dns)
    room = MILLIMETRE * knit.radius * np.array(MARGIN)
    window = window_around(knit.crossings.point[cell].reshape(-1, 3), room)
    passing = np.unique(contacts["yarn"].to_numpy()[cell])
    yarns = [deformed_yarns(knit, dns, passing, point.increment) for point in points]
    pictures = [Picture(surfaces, FRONT, window) for surfaces in yarns]
    touching = [_touching(dns, cell, point.increment) for point in points]
    area = MILLIMETRE**2 * area_of_cell(contacts)
    titles = [
        f"{PERCENT * point.strain:.3g} % strain\n{area[point.increment]:#.2g} mm², "
        f"up to {MEGAPASCAL * pressure.max(initial=0):.2g} MPa"
        if pressure.size
        else f"{PERCENT * point.strain:.3g} % strain\nno contact"
        for point, (_, pressure) in zip(points, touching, strict=True)
    ]
    letters = [f"c{point.number}" for point in points]
    drawing, panels = draw_rows([pictures], head=11.0, foot=BAR, above=CURVES, titles=titles, letters=letters)
    foot = INCH * drawing.get_figheight() - CURVES
    upper, lower = (place(drawing, 0.09, foot + bottom, 0.385, high) for bottom, high in ((53, 26), (17, 33)))
    _draw_curves(upper, lower, place(drawing, 0.57, foot + 17, 0.4, 62), dns, contacts)
    if hexahedra is not None and hexahedra.attrs["scene"] != contacts.attrs["scene"]:
        _draw_area(lower, hexahedra, HEXAHEDRAL, AREA_FROM[False])
    lower.set_ylim(0, None)
    lower.legend(loc="upper left", handlelength=1.5)
    text = ";  ".join(point.label for point in points)
    drawing.text(0.5, 1 - (CURVES - 2) / (foot + CURVES), text, ha="center", va="bottom")
    largest = max((pressure.max(initial=0) for _, pressure in touching), default=0) or 1.0
    # Even in the root of the pressure: in the first pictures it is small.
    scale = ScalarMappable(PowerNorm(0.5, 0, MEGAPASCAL * largest), "plasma")
    for axes, point, (spot, pressure) in zip(panels, points, touching, strict=True):
        order = np.argsort(pressure)
        at = MILLIMETRE * FRONT.project(spot[order])
        colours = scale.to_rgba(MEGAPASCAL * pressure[order])
        for size, colour in ((RIM, PAPER), (DOT, colours)):
            axes.scatter(at[:, 0], at[:, 1], c=colour, s=size, linewidth=0, zorder=5, rasterized=True)
        _point_at_contacts(axes, contacts, cell, point)
    scale_bar(panels[0], 2, left=0.43)
    colour_bar(drawing, scale, "contact pressure (MPa)", 0.3, 0.4)
    return drawing


def _draw_curves(upper: Axes, lower: Axes, force: Axes, dns: xr.Dataset, contacts: xr.Dataset) -> None:
    """Draw number and area of contact zones one above the other, and the force to the right."""
    points = snapshots(contacts)
    strain = PERCENT * contacts["strain"].to_numpy()
    early = strain <= ONSET
    onset = force.inset_axes((0.62, 0.2, 0.37, 0.3))
    look = INTERACTIONS["isotropic"].line | {"linestyle": "-", "clip_on": False}
    # A number of zones holds until the next increment shows another one.
    late = strain >= START
    zones = zones_of_cell(contacts)[late]
    upper.plot(strain[late], zones, drawstyle="steps-post", markersize=3, **look)
    _draw_area(lower, contacts, look | {"markersize": 3}, AREA_FROM["contact_area_from" in contacts.attrs])
    force.plot(strain, dns["force"], markevery=np.flatnonzero(~early).tolist(), **look)
    onset.plot(strain[early], dns["force"][early], markersize=3, **look)
    for axes, label in ((upper, "contact zones (1)"), (lower, "contact area (mm²)")):
        axes.set(xscale="log", xlim=(START, strain[-1]), ylabel=label)
        axes.set_xticks([tick for tick in TICKS if tick <= strain[-1]], minor=False)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    force.set(xlim=(0, strain[-1]), ylim=(0, None), ylabel="reaction force (N)")
    onset.set(xlim=(0, strain[early][-1]), ylim=(0, None), xlabel="strain (%)", ylabel="(N)")
    for axes in (upper, lower, force, onset):
        for point in points:
            axes.axvline(PERCENT * point.strain, color=FAINT, linewidth=0.7, linestyle=":", zorder=0)
    for axes in (lower, force):
        axes.set_xlabel("strain in course direction (%)")
    upper.set(ylim=(0, None), xticklabels=[])
    upper.yaxis.set_major_locator(MaxNLocator(integer=True))
    lower.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))  # few digits: the label needs the room
    for axes, letter in ((upper, "a"), (force, "b")):
        above = 1 + NUMBERS / height(axes)
        _number(axes, points, above)
        axes.text(-0.17, above, f"({letter})", transform=axes.transAxes, fontsize=8.5)


def _draw_area(axes: Axes, contacts: xr.Dataset, look: Style, made_from: str) -> None:
    """Draw the contact area of the centre cell over strain; the label says what it is made from."""
    strain = PERCENT * contacts["strain"].to_numpy()
    late = strain >= START
    axes.plot(strain[late], MILLIMETRE**2 * area_of_cell(contacts)[late], label=made_from, **look)


def _number(axes: Axes, points: Sequence[Snapshot], above: float) -> None:
    """Write the number of each strain, with a thin line to it, at a height in axes, apart from its neighbours."""
    at = -np.inf
    for point in points:
        x = PERCENT * point.strain
        share, _ = axes.transAxes.inverted().transform(axes.transData.transform((x, 0.0)))
        at = max(float(share), at + APART)
        line: Style = {"arrowstyle": "-", "linewidth": 0.7, "color": FAINT, "shrinkA": 1, "shrinkB": 0}
        look: Style = {"ha": "center", "va": "bottom", "fontweight": "bold", "annotation_clip": False}
        frames: Style = {"xycoords": ("data", "axes fraction"), "textcoords": "axes fraction"}
        axes.annotate(str(point.number), (x, 1.0), (at, above), arrowprops=line, **look, **frames)


def deformed_yarns(
    knit: Fabric, dns: xr.Dataset, numbers: Iterable[int], increment: int, opacity: float = 1.0
) -> list[Surface]:
    """Return some yarns of a knit at an increment, displacements true to scale, in pale colours."""
    position = deformed_centrelines(dns, increment)
    yarn = dns["yarn"].to_numpy()
    colours = yarn_colours(knit)
    return [tube(position[yarn == number], knit.radius, tint(colours[number]), opacity) for number in numbers]


def _touching(dns: xr.Dataset, cell: np.ndarray, increment: int) -> list[np.ndarray]:
    """Return position (k, 3) and pressure (k,) of the points that touch in the cell at an increment."""
    here = (dns["contact_increment"].to_numpy() == increment) & np.isin(dns["contact_crossing"], cell)
    return [dns[name].to_numpy()[here] for name in ("contact_position", "contact_pressure")]


def _point_at_contacts(axes: Axes, contacts: xr.Dataset, cell: np.ndarray, point: Snapshot) -> None:
    """Draw an arrow to every contact from outside of the cell's middle."""
    now = contacts.isel(increment=point.increment, crossing=cell)
    closed = now["zones"].to_numpy() > 0
    middle = axes.transLimits.inverted().transform((0.5, 0.5))
    look: Style = {"arrowstyle": "-|>", "linewidth": 1.4, "color": ACCENT, "path_effects": HALO}
    for tip in MILLIMETRE * FRONT.project(now["contact_centroid"].to_numpy()[closed]):
        outwards = (tip - middle) / np.linalg.norm(tip - middle)
        tail = tuple(ARROW * outwards)
        head = tuple(tip + 0.35 * outwards)
        axes.annotate("", head, tail, textcoords="offset points", arrowprops=look, zorder=8)
