"""Fig. 2: schematic of the two interactions at an interface, the tie constraint and contact with friction."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import draw_arrow, write
from knitstudy.figures.style import ACCENT, DOUBLE, INK, PAPER, YARNS, figure, panel_letter, tint

SLAVE, MASTER = YARNS[1], YARNS[2]
HALF = 3.0  # half the width of a panel; all lengths of the schematic are in one arbitrary unit
GAP = 0.55  # distance between the tied surfaces, so that the ties can be seen
CONTACT = 1.15  # half the width of the contact zone

Profile = Callable[[np.ndarray], np.ndarray]


@FIGURES.add("fig02_interfaces", "Fig. 2: tie constraint and contact with friction")
def draw() -> Figure:
    """Draw both panels; nothing is measured here."""
    drawing = figure(DOUBLE, 66)
    for k, (letter, title, content) in enumerate(
        [("a", "tie constraint", _draw_tie), ("b", "contact with friction", _draw_contact)]
    ):
        axes = drawing.add_axes((0.015 + 0.5 * k, 0.02, 0.47, 0.88))
        axes.set(xlim=(-HALF, HALF), ylim=(-1.95, 2.1), aspect="equal")
        axes.set_axis_off()
        panel_letter(axes, letter, title)
        content(axes)
    return drawing


def _draw_tie(axes: Axes) -> None:
    """Every slave node hangs on the master facet below it; the facet's nodes carry it."""

    def lower(x):
        return -0.06 * x**2

    def upper(x):
        return GAP + 0.06 * x**2

    _bodies(axes, lower, upper)
    master, slave = np.linspace(-2.7, 2.7, 7), np.linspace(-2.25, 2.25, 10)
    for x in slave[3:7]:
        foot = np.interp(x, master, lower(master))  # on the straight facet
        axes.plot([x, x], [foot, upper(x)], color=ACCENT, linewidth=2.2, zorder=4)
        axes.plot(x, foot, "D", color=ACCENT, markersize=3.5, zorder=5)
    _nodes(axes, master, lower, "s", MASTER)
    _nodes(axes, slave, upper, "o", SLAVE)
    _say(axes, (-2.9, 1.45), "slave surface", SLAVE)
    _say(axes, (-2.9, -1.1), "master surface", MASTER)
    x = slave[6]
    _point(axes, "slave node $s$", (x, upper(x)), (2.1, 1.35))
    _point(axes, "facet with nodes $i$", (1.35, -0.12), (1.75, -1.1))
    formula = r"$\mathbf{u}^{s}=\sum_i N_i\,\mathbf{u}_i^{*}$"
    axes.text(-0.1, -1.75, f"{formula}   no relative motion", ha="center", va="center")


def _draw_contact(axes: Axes) -> None:
    """Surfaces press on each other with p and exchange a traction t_T in their common tangent plane."""

    def lower(x):
        return -0.13 * np.maximum(np.abs(x) - CONTACT, 0) ** 2 - 0.02 * (np.abs(x) > CONTACT)

    def upper(x):
        return -lower(x)

    _bodies(axes, lower, upper)
    _nodes(axes, np.linspace(-2.7, 2.7, 7), lower, "s", MASTER)
    _nodes(axes, np.linspace(-2.25, 2.25, 10), upper, "o", SLAVE)
    for x in np.linspace(-0.93, 0.93, 9):
        height = 0.95 * np.sqrt(1 - (x / CONTACT) ** 2)
        _arrow(axes, (x, 0.06), (0, height), ACCENT, 0.9)
    _say(axes, (0.95, 0.8), "$p$", ACCENT)
    _arrow(axes, (0.45, -0.28), (-1.3, 0), ACCENT, 2.0)
    _say(axes, (-1.12, -0.3), r"$\mathbf{t}_T$", ACCENT)
    _arrow(axes, (1.25, 1.45), (1.1, 0), SLAVE, 2.0)
    _say(axes, (-0.25, 1.45), "sliding of the slave", SLAVE)
    _draw_frame(axes, (1.8, float(lower(np.array(1.8)))))
    _say(axes, (-2.9, 1.45), "slave surface", SLAVE)
    _say(axes, (-2.9, -1.1), "master surface", MASTER)
    formula = r"$p\geq 0$,   $\Vert\mathbf{t}_T\Vert\leq\mu\,p$"
    axes.text(-0.1, -1.75, f"{formula},   equal where it slides", ha="center", va="center")


def _draw_frame(axes: Axes, origin: tuple[float, float]) -> None:
    """The normal n of the master and its tangents; t2 points to the reader."""
    slope = -0.26 * (origin[0] - CONTACT)
    along = np.array([1, slope]) / np.hypot(1, slope)
    normal = np.array([-along[1], along[0]])
    _arrow(axes, origin, 0.95 * normal, INK, 1.2)
    _arrow(axes, origin, 0.85 * along, INK, 1.2)
    axes.plot(*origin, "o", color=PAPER, markeredgecolor=INK, markersize=7, zorder=7)
    axes.plot(*origin, "o", color=INK, markersize=2.2, zorder=8)
    write(axes, origin + 1.1 * normal, r"$\mathbf{n}$")
    write(axes, origin + 1.02 * along + [0, 0.02], r"$\mathbf{t}_1$")
    write(axes, np.add(origin, [-0.1, -0.36]), r"$\mathbf{t}_2$")


def _bodies(axes: Axes, lower: Profile, upper: Profile) -> None:
    x = np.linspace(-HALF, HALF, 241)
    axes.fill_between(x, -1.35, lower(x), color=tint(MASTER, 0.22), linewidth=0)
    axes.fill_between(x, upper(x), 1.7, color=tint(SLAVE, 0.22), linewidth=0)
    axes.plot(x, lower(x), color=MASTER, linewidth=1.4)
    axes.plot(x, upper(x), color=SLAVE, linewidth=1.4)


def _nodes(axes: Axes, x: np.ndarray, profile: Profile, marker: str, colour: str) -> None:
    look = {"color": PAPER, "markeredgecolor": colour, "markeredgewidth": 1.3, "markersize": 5}
    axes.plot(x, profile(x), marker, **look, zorder=6)


def _arrow(axes: Axes, start: Sequence[float], vector: Sequence[float], colour: str, width: float) -> None:
    draw_arrow(axes, start, vector, colour, width, mutation_scale=6 + 3 * width)


def _say(axes: Axes, place: tuple[float, float], text: str, colour: str) -> None:
    write(axes, place, text, color=colour, ha="left")


def _point(axes: Axes, text: str, place: tuple[float, float], where: tuple[float, float]) -> None:
    line = {"arrowstyle": "-", "linewidth": 0.7, "shrinkB": 4}
    axes.annotate(text, place, where, ha="center", va="center", arrowprops=line, zorder=9)
