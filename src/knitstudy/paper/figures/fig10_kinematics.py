"""Fig. 10: forces on a yarn, and how it turns and contracts, and contacts move and spin, in the centre cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy.spatial.transform import Rotation

from knitstudy.errors import DataFileError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.centre_cell import centre_cell, closest_neighbour, rotation_angle
from knitstudy.measures.response import deformed_centrelines
from knitstudy.paper.figures.fig07_contact import deformed_yarns
from knitstudy.paper.figures.fig08_fig16_out_of_plane import OBLIQUE, draw_forces
from knitstudy.paper.scene_names import of_solid
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import HALO, Picture, View, bounds, draw_arrow, draw_rows, window_around, write
from knitstudy.use.style import (
    ACCENT,
    FAINT,
    INCH,
    INK,
    MICROMETRE,
    MILLIMETRE,
    PERCENT,
    Style,
    panel_letter,
    tint,
)

CURVES = 134.0  # height of the curves [mm]
REACH = 2.4  # half the width of the pictures of the crossing, in radii
MAGNIFIED = 5.0  # rotation and slip in these pictures; yarns are true to scale
ROUNDING = 1e-9  # values of a panel below which all of them are rounding errors
LOWER, UPPER = "#0072B2", "#D55E00"

# How crossings are drawn, by zone: right ones lie thin on their wide mirror images.
DOTS: Style = {"linewidth": 1.2, "marker": "o", "markersize": 2.5}
TRIANGLES: Style = {"linewidth": 1.2, "linestyle": "--", "marker": "^", "markersize": 3}
ZONES = (
    ("left lower crossing", {"color": tint(LOWER), "linewidth": 4.0}),
    ("right lower crossing", {"color": LOWER, **DOTS}),
    ("left upper crossing", {"color": tint(UPPER), "linewidth": 4.0}),
    ("right upper crossing", {"color": UPPER, **TRIANGLES}),
)

SIDES = ("yarn of the lower row", "yarn of the upper row")

QUANTITIES: dict[str, Callable[[xr.Dataset], np.ndarray]] = {
    "rotation\n(°)": lambda contacts: np.degrees(rotation_angle(contacts)),
    "shortening\n(%)": lambda contacts: PERCENT * closest_neighbour(contacts),
    "way of the\ncontact (µm)": lambda contacts: MICROMETRE * np.abs(contacts["contact_travel"].to_numpy()),
    "slip along\nthis yarn (µm)": lambda contacts: MICROMETRE * np.abs(contacts["sliding"].to_numpy()),
    "spin of the\ncontact (°)": lambda contacts: np.degrees(contacts["contact_spin"]),
}
"""Values (I, K, 2) of each row of panels, from above to below, by the label of the axis."""


@FIGURES.add(
    "fig10_kinematics",
    "Fig. 10: forces on a yarn, its rotation, and the way and spin of its contacts in the centre cell",
    results=of_solid("isotropic-course", "geometry", "dns", "contacts"),
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the yarn that slips furthest on its own, its crossing in three states, and all motions over strain.

    Raises DataFileError if the contacts hold no kinematics, since their history holds no motion of sections.
    """
    if "section_rotation" not in contacts:
        raise DataFileError(
            "contacts: section_rotation is missing; needed are contacts of a history with section_gradient: run the "
            "direct simulation again"
        )
    knit, states = fabric_of(geometry), three_states(contacts)
    yarn = int(states["yarn"])
    free = deformed_yarns(knit, dns, [yarn], -1)
    views = [_crossing(knit, dns, states, k) for k in range(3)]
    left, right, bottom, top = bounds(free, OBLIQUE)
    room = 0.25 * (right - left)  # the free body takes two thirds of the width
    alone = Picture(free, OBLIQUE, (left - room, right + room, bottom, top), 5)
    drawing, (body, *panels, section) = draw_rows(
        [[alone], [*(picture for picture, _, _ in views), None]], head=12.0, foot=CURVES
    )
    panel_letter(body, "a", "forces on one yarn, a free body, at full load")
    draw_forces(body, contacts, (contacts["yarn"].to_numpy() == yarn) @ [1.0, -1.0])
    turned = np.degrees(np.linalg.norm(states["section_rotation"], axis=1))
    slip = MICROMETRE * np.nan_to_num(np.linalg.norm(states["slide"], axis=1))
    numbers = (PERCENT * states["strain"], turned, slip)
    for k, (_, diameter, (start, way)) in enumerate(views):
        axes, strain, angle, distance = panels[k], *(float(number[k]) for number in numbers)
        axes.plot(*diameter.T, color=INK, linewidth=2.0, zorder=7, path_effects=HALO)
        draw_arrow(axes, start, way, ACCENT, 2.0)
        panel_letter(axes, f"b{k + 1}", f"{strain:.2f} % strain\nturned {angle:.1f}°, slip {distance:.0f} µm")
    text = f"turn and slip are drawn {MAGNIFIED:g} times as large"
    panels[1].text(0.5, -0.02, text, transform=panels[1].transAxes, ha="center", va="top")
    _draw_spin(section, np.nan_to_num(states["contact_spin"]))
    _draw_histories(drawing, contacts)
    return drawing


def three_states(contacts: xr.Dataset) -> xr.Dataset:
    """Return the crossing and side of the centre cell whose yarn is slipped along furthest, in three states.

    1: the yarns touch for the first time; 2: half of that slip is done; 3: full load. `outwards` (3,) points from the
    yarn to the `other` one, `slide` (3, 3) is how the surface of the other one has moved to it since state 1 [m].
    """
    cell = centre_cell(contacts)
    slid = np.abs(np.nan_to_num(contacts["sliding"].to_numpy()[:, cell]))
    k, side = np.unravel_index(np.argmax(slid[-1]), slid[-1].shape)
    touching = np.isfinite(contacts["sliding"].to_numpy()[:, cell[k], side])
    times = [int(touching.argmax()), int((slid[:, k, side] >= slid[-1, k, side] / 2).argmax()), len(slid) - 1]
    states = contacts.isel(crossing=int(cell[k]), increment=times)
    moved = states["relative_displacement"] - states["relative_displacement"][0]
    sign = 1 - 2 * int(side)
    return states.isel(side=int(side)).assign(
        outwards=sign * states["normal"],
        slide=sign * moved,
        other=states["yarn"][1 - side],
        at=("increment", times),
    )


def _crossing(
    knit: Fabric, dns: xr.Dataset, states: xr.Dataset, k: int
) -> tuple[Picture, np.ndarray, np.ndarray]:
    """Return the crossing seen along its normal, a diameter (2, 2) of the section, and place and slide (2, 2) [mm]."""
    state = states.isel(increment=k)
    yarn = int(states["yarn"])
    s, at = float(state["arc_length"]), int(state["at"])
    out = state["outwards"].to_numpy()
    along = knit.centrelines[yarn].tangent(np.array([s]))[0]
    view = View(tuple(-out), tuple(along))
    own = dns.isel(station=dns["yarn"].to_numpy() == yarn)
    position = deformed_centrelines(own, at)
    middle = np.array([np.interp(s, own["arc_length"], coordinate) for coordinate in position.T])
    surfaces = deformed_yarns(knit, dns, [yarn], at) + deformed_yarns(
        knit, dns, [int(state["other"])], at, 0.3
    )
    turn = Rotation.from_rotvec(MAGNIFIED * state["section_rotation"].to_numpy())
    across = knit.radius * view.project(turn.apply(np.cross(along, out)))
    start = view.project(middle)
    slide = MAGNIFIED * view.project(np.nan_to_num(state["slide"].to_numpy()))
    window = window_around(middle[None], 2 * (REACH * MILLIMETRE * knit.radius,), view)
    return (
        Picture(surfaces, view, window, bar=0.0 if k else 1.0, directions=False),
        MILLIMETRE * np.stack([start - across, start + across]),
        MILLIMETRE * np.stack([start, slide]),
    )


def _draw_spin(axes: Axes, angles: np.ndarray) -> None:
    """Draw the section of the yarn with the place of the contact on its rim at the angles (3,) of the states."""
    axes.add_patch(Circle((0, 0), 1, facecolor=tint(FAINT, 0.3), edgecolor=INK))
    for number, rim in enumerate(np.column_stack([np.sin(angles), np.cos(angles)]), start=1):
        axes.plot(*np.outer(rim, [0, 1]), color=ACCENT, linewidth=0.6 * number)
        write(axes, 1.15 * rim, str(number), color=ACCENT)
    axes.set(xlim=(-1.4, 1.4), ylim=(-1.4, 1.4), aspect="equal")
    axes.set_axis_off()
    turned = ", ".join(f"{angle:.1f}°" for angle in np.degrees(angles))
    panel_letter(axes, "c", f"spin of the contact:\n{turned}")


def _draw_histories(drawing: Figure, contacts: xr.Dataset) -> None:
    """Draw the two yarns of the centre cell side by side, the quantities one below the other."""
    whole = INCH * drawing.get_figheight()
    room: Style = {"left": 0.125, "right": 0.985, "bottom": 19 / whole, "top": (CURVES - 11) / whole}
    grid = drawing.add_gridspec(len(QUANTITIES), len(SIDES), wspace=0.1, **room)
    panels: Any = grid.subplots(sharex=True, sharey="row")
    strain = PERCENT * contacts["strain"].to_numpy()
    crossings = centre_cell(contacts)
    for (label, quantity), row in zip(QUANTITIES.items(), panels, strict=True):
        values = np.asarray(quantity(contacts))[:, crossings]
        for side, axes in enumerate(row):
            axes.axhline(0, color=FAINT, linewidth=0.6, zorder=0)
            for (name, look), value in zip(ZONES, values[:, :, side].T, strict=True):
                axes.plot(strain, value, label=name, clip_on=False, **look)
        row[0].set_ylabel(label)
        if np.nanmax(np.abs(values), initial=0.0) < ROUNDING:
            row[0].set_ylim(-1, 1)
    for axes, letter, title in zip(panels[0], "de", SIDES, strict=True):
        panel_letter(axes, letter, title)
    for axes in panels[-1]:
        axes.set(xlabel="applied strain (%)", xlim=(0, strain[-1]))
    drawing.align_ylabels(panels[:, 0])
    drawing.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower center", ncols=len(ZONES))
