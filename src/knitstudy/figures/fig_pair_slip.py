"""Two crossing yarns: normal and tangential force of their contact against the distance slid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import (
    DOUBLE,
    FAINT,
    INK,
    MICROMETRE,
    SINGLE,
    figure,
    panel_letter,
    shared_legend,
)
from knitstudy.measures.catalogue import several
from knitstudy.study.scene import Scene

PATHS = {
    "tied": {"color": INK, "linestyle": "-", "marker": "o"},
    "slid": {"color": "#56B4E9", "linestyle": "-", "marker": "s", "linewidth": 3.0, "markersize": 5},
    "slid and reversed": {"color": "#D55E00", "linestyle": "--", "marker": "^"},
}
"""Looks of the lines by the load of a pair."""


@dataclass(frozen=True)
class Slide:
    """Forces of one pair on the lower yarn, along and across the direction in which its grips slide."""

    scene: Scene
    distance: np.ndarray  # (I,) of the upper yarn's face from the lower one's, along the slide [m]
    tangential: np.ndarray  # (I,) friction along the slide [N]
    normal: np.ndarray  # (I,) pressure [N]

    @classmethod
    def of(cls, contacts: xr.Dataset, scene: Scene) -> Slide:
        """Return the forces of a pair whose path has a second leg: the slide."""
        path = np.array(scene.load.path)
        along = path[1] - path[0]
        along /= np.linalg.norm(along)
        crossing = contacts.isel(crossing=0)
        return cls(
            scene,
            crossing["relative_displacement"].to_numpy() @ along,
            crossing["tangential_resultant"].to_numpy() @ along,
            np.linalg.norm(crossing["normal_resultant"].to_numpy(), axis=1),
        )

    @property
    def kind(self) -> str:
        """Which of `PATHS` it is."""
        slid = "slid" if len(self.scene.load.path) == 2 else "slid and reversed"
        return "tied" if self.scene.interaction == "tie" else slid


@FIGURES.add(
    "fig_pair_slip",
    "Two crossing yarns: forces against sliding",
    results={"pairs_contacts": several("contacts", "pair-slid-*", "pair-reversed-*", "pair-tied-*")},
)
def draw(pairs_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> Figure:
    """Draw tangential forces above, normal forces below, one column an angle."""
    slides = [Slide.of(contacts, scenes[name]) for name, contacts in pairs_contacts.items()]
    angles = sorted({slide.scene.pair.angle for slide in slides}, reverse=True)
    drawing = figure(DOUBLE if len(angles) > 1 else 1.3 * SINGLE, 110.0, layout="constrained")
    rows = drawing.subplots(2, len(angles), sharex="col", squeeze=False)
    for column, angle in enumerate(angles):
        here = [slide for slide in slides if slide.scene.pair.angle == angle]
        _draw_angle(rows[:, column], here)
        panel_letter(rows[0, column], "ab"[column % 2], f"crossed at {angle:g}°")
    rows[0, 0].set_ylabel("tangential force (N)")
    rows[1, 0].set_ylabel("normal force (N)")
    shared_legend(drawing, loc="outside lower center", ncols=2)
    return drawing


def _draw_angle(axes: tuple[Axes, Axes], slides: list[Slide]) -> None:
    for slide in sorted(slides, key=lambda slide: list(PATHS).index(slide.kind)):
        distance, look = MICROMETRE * slide.distance, PATHS[slide.kind]
        axes[0].plot(distance, slide.tangential, label=slide.kind, clip_on=False, **look)
        axes[1].plot(distance, slide.normal, clip_on=False, **look)
    sliding = [slide for slide in slides if slide.kind != "tied"]
    if sliding:
        longest = max(sliding, key=lambda slide: len(slide.distance))
        bound = longest.scene.contact.friction * longest.normal
        look = {"color": FAINT, "linewidth": 0.8, "linestyle": ":"}
        labels = ["± friction coefficient times normal force", "_"]
        axes[0].plot(MICROMETRE * longest.distance, np.column_stack([bound, -bound]), label=labels, **look)
    axes[0].axhline(0, color=FAINT, linewidth=0.6, zorder=0)
    axes[1].set(xlabel="relative displacement along the slide (µm)", ylim=(0, None))
