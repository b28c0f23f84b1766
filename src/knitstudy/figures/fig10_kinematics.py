"""Fig. 10: forces on a yarn, and how it turns, contracts, slides and spins at the crossings of the centre cell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy.spatial.transform import Rotation

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.fig07_contact import deformed_yarns
from knitstudy.figures.fig08_out_of_plane import OBLIQUE, draw_forces
from knitstudy.figures.picture import (
    HALO,
    bounds,
    draw_arrow,
    draw_rows,
    scale_bar,
    window_around,
    write,
)
from knitstudy.figures.renderer import MILLIMETRE, Picture, View
from knitstudy.figures.style import (
    ACCENT,
    FAINT,
    INCH,
    INK,
    MICROMETRE,
    PERCENT,
    panel_letter,
    tint,
)
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import centre_cell, closest_neighbour, rotation_angle

CURVES = 128.0  # height of the curves [mm]
REACH = 2.4  # half the width of the pictures of the crossing, in radii
MAGNIFIED = 5.0  # rotation and sliding in these pictures; yarns are true to scale
LOWER, UPPER = "#0072B2", "#D55E00"

# How crossings are drawn, by zone: right ones lie thin on their wide mirror images.
DOTS = {"linewidth": 1.2, "marker": "o", "markersize": 2.5}
TRIANGLES = {"linewidth": 1.2, "linestyle": "--", "marker": "^", "markersize": 3}
ZONES = (
    ("left lower crossing", {"color": tint(LOWER), "linewidth": 4.0}),
    ("right lower crossing", {"color": LOWER, **DOTS}),
    ("left upper crossing", {"color": tint(UPPER), "linewidth": 4.0}),
    ("right upper crossing", {"color": UPPER, **TRIANGLES}),
)

SIDES = ("yarn of the lower row", "yarn of the upper row")

QUANTITIES: dict[str, Callable[[xr.Dataset], np.ndarray]] = {
    "rotation of\nthe section (°)": lambda contacts: np.degrees(rotation_angle(contacts)),
    "shortening between\ncrossings (%)": lambda contacts: PERCENT * closest_neighbour(contacts),
    "sliding along\nthe yarn (µm)": lambda contacts: MICROMETRE * np.abs(contacts["sliding"].to_numpy()),
    "spin of the contact\nabout the yarn (°)": lambda contacts: np.degrees(contacts["contact_spin"]),
}
"""Values (I, K, 2) of each row of panels, from above to below, by the label of the axis."""


@FIGURES.add(
    "fig10_kinematics",
    "Fig. 10: forces on a yarn, and its rotation, sliding and spin at the crossings of the centre cell",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
    },
)
def draw(geometry: xr.Dataset, dns: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the yarn that slides furthest on its own, its crossing in three states, and all motions over strain.

    Raises DataFileError if the contacts hold no kinematics, since their history holds no motion of sections.
    """
    if "section_rotation" not in contacts:
        raise DataFileError(
            "contacts: section_rotation is missing; needed are contacts of a history with section_gradient: run the "
            "direct simulation anew"
        )
    knit, path = Fabric.from_dataset(geometry), Path.of(contacts)
    yarn = int(contacts["yarn"][path.crossing, path.side])
    free = deformed_yarns(knit, dns, [yarn], -1)
    whole = Picture(free, OBLIQUE, bounds(free, OBLIQUE))
    near = [_near(knit, dns, contacts, path, increment) for increment in path.increments]
    pictures = [picture for picture, _, _ in near]
    drawing, (body, spin, *states) = draw_rows([[whole, None], pictures], head=12.0, foot=CURVES)
    panel_letter(body, "a", "forces on one yarn, a free body, at full load")
    side = (contacts["yarn"].to_numpy() == yarn) @ [1.0, -1.0]  # forces are on the yarn of side 0
    draw_forces(body, contacts, side)
    scale_bar(body, 5, OBLIQUE)
    for number, (axes, (_, section, slide)) in enumerate(zip(states, near, strict=True), start=1):
        axes.plot(*near[0][1].T, color=FAINT, linestyle=":", linewidth=1.6, zorder=6)
        axes.plot(*section.T, color=INK, linewidth=2.0, zorder=7, path_effects=HALO)
        draw_arrow(axes, *slide, ACCENT, 2.0)
        axes.plot(*slide[0], "o", color=ACCENT, markersize=4, zorder=8)
        panel_letter(axes, f"b{number}", path.said(contacts, number - 1))
    scale_bar(states[0], 1)
    _draw_spin(spin, contacts, path)
    _draw_histories(drawing, contacts)
    return drawing


@dataclass(frozen=True)
class Path:
    """The crossing of the centre cell that slides furthest along one of its yarns, and three states of it.

    1: the yarns touch for the first time; 2: half of the sliding is done; 3: full load.
    """

    crossing: int
    side: int
    increments: tuple[int, int, int]

    @classmethod
    def of(cls, contacts: xr.Dataset) -> Path:
        """Return the path in contacts with kinematics."""
        cell = centre_cell(contacts)
        slid = np.abs(contacts["sliding"].to_numpy()[:, cell])
        k, side = np.unravel_index(np.argmax(np.nan_to_num(slid[-1])), slid[-1].shape)
        own = slid[:, k, side]
        half = int(np.argmax(np.nan_to_num(own) >= 0.5 * np.nan_to_num(own[-1])))
        return cls(int(cell[k]), int(side), (int(np.argmax(np.isfinite(own))), half, len(own) - 1))

    def at(self, values: xr.DataArray) -> np.ndarray:
        """Return values (3, ...) of the crossing's side in the three states, of an array (I, K, 2, ...)."""
        return np.nan_to_num(values.to_numpy()[list(self.increments), self.crossing, self.side])

    def said(self, contacts: xr.Dataset, state: int) -> str:
        """Return strain, rotation and sliding in a state."""
        strain = PERCENT * float(contacts["strain"][self.increments[state]])
        turned = np.degrees(np.linalg.norm(self.at(contacts["section_rotation"])[state]))
        slid = MICROMETRE * abs(self.at(contacts["sliding"])[state])
        return f"{strain:.2f} % strain\nturned {turned:.1f}°, slid {slid:.0f} µm"


def _near(
    knit: Fabric, dns: xr.Dataset, contacts: xr.Dataset, path: Path, increment: int
) -> tuple[Picture, np.ndarray, np.ndarray]:
    """Return the crossing seen along its normal, the section's diameter (2, 2) and the slide (2, 2) [mm].

    The slide is a place and the vector to it of the point of the other yarn that was there at first contact.
    """
    k, side = path.crossing, path.side
    yarn, s = (contacts[name].to_numpy()[k, side] for name in ("yarn", "arc_length"))
    out = contacts["normal"].to_numpy()[k] * (1 if side == 0 else -1)
    along = knit.centrelines[yarn].tangent(np.array([s]))[0]
    view = View(tuple(-out), tuple(along))
    position = dns["centreline"].to_numpy() + dns["centreline_displacement"].to_numpy()[increment]
    own = dns["yarn"].to_numpy() == yarn
    middle = np.array([np.interp(s, dns["arc_length"].to_numpy()[own], each) for each in position[own].T])
    other = contacts["yarn"].to_numpy()[k, 1 - side]
    surfaces = deformed_yarns(knit, dns, [yarn], increment) + deformed_yarns(
        knit, dns, [other], increment, 0.3
    )
    room = 2 * (REACH * MILLIMETRE * knit.radius,)
    turn = Rotation.from_rotvec(MAGNIFIED * contacts["section_rotation"].to_numpy()[increment, k, side])
    across = knit.radius * turn.apply(np.cross(along, out))
    moved = contacts["relative_displacement"].to_numpy()[:, k] * (1 if side == 0 else -1)
    slide = MAGNIFIED * (moved[increment] - moved[path.increments[0]])
    start = view.project(middle)
    ends = start + np.outer([-1, 1], view.project(across))
    picture = Picture(surfaces, view, window_around(middle[None], room, view))
    return picture, MILLIMETRE * ends, MILLIMETRE * np.stack([start, view.project(slide)])


def _draw_spin(axes: Axes, contacts: xr.Dataset, path: Path) -> None:
    """Draw the section of the yarn with the place of the contact on its rim in the three states."""
    axes.add_patch(Circle((0, 0), 1, facecolor=tint(FAINT, 0.3), edgecolor=INK))
    angles = path.at(contacts["contact_spin"])
    for number, angle in enumerate(angles, start=1):
        rim = np.array([np.sin(angle), np.cos(angle)])
        axes.plot(*np.outer(rim, [0, 1]), color=ACCENT, linewidth=0.6 * number)
        write(axes, 1.15 * rim, str(number), color=ACCENT)
    axes.set(xlim=(-1.4, 1.4), ylim=(-1.4, 1.4), aspect="equal")
    axes.set_axis_off()
    turned = ", ".join(f"{np.degrees(angle):.1f}°" for angle in angles)
    panel_letter(axes, "c", f"contact, spun about the yarn by {turned}")


def _draw_histories(drawing: Figure, contacts: xr.Dataset) -> None:
    """Draw the two yarns of the centre cell side by side, the quantities one below the other."""
    whole = INCH * drawing.get_figheight()
    grid = {"left": 0.1, "right": 0.985, "bottom": 19 / whole, "top": (CURVES - 11) / whole, "wspace": 0.06}
    grid = drawing.add_gridspec(len(QUANTITIES), len(SIDES), **grid)
    panels = grid.subplots(sharex=True, sharey="row")
    strain, crossings = PERCENT * contacts["strain"].to_numpy(), centre_cell(contacts)
    for (label, quantity), row in zip(QUANTITIES.items(), panels, strict=True):
        values = np.asarray(quantity(contacts))[:, crossings]
        for side, axes in enumerate(row):
            axes.axhline(0, color=FAINT, linewidth=0.6, zorder=0)
            for (name, look), value in zip(ZONES, values[:, :, side].T, strict=True):
                axes.plot(strain, value, label=name, clip_on=False, **look)
        row[0].set_ylabel(label)
    for axes, letter, title in zip(panels[0], "de", SIDES, strict=True):
        panel_letter(axes, letter, title)
    for axes in panels[-1]:
        axes.set(xlabel="applied strain (%)", xlim=(0, strain[-1]))
    drawing.align_ylabels(panels[:, 0])
    drawing.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower center", ncols=len(ZONES))
