"""Plain pictures of any result, in the style of the figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import cycle, product
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from knitstudy.datasets import STRAINS
from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.measures.summary import kind_of, require_layout, touched
from knitstudy.mechanics.contact.solid import principal_axes
from knitstudy.mechanics.materials import FULL
from knitstudy.use import deformed
from knitstudy.use.measured_curve import STRAIN, curve_table, force_over_strain, loss_of_cycle
from knitstudy.use.style import (
    FAINT,
    INK,
    MEGAPASCAL,
    MILLIMETRE,
    PAPER,
    PERCENT,
    SINGLE,
    YARNS,
    figure,
    pixels,
    styled,
)
from knitstudy.use.vtu import solids

Look = tuple[str, str]
LOOKS = tuple(product(("o-", "s--", "^:"), (INK, *YARNS)))  # of lines in one picture


def plot(*results: Any, colour: str | None = None, axes: Axes | None = None) -> Figure:
    """Return a picture of results of `knitstudy.simulate`: forces over strain, or the deformed knit in colours.

    Parameters
    ----------
    *results : Results
        Of several simulations the curves are drawn together.
    colour : str, optional
        Draws the deformed knit of one result at full load instead: "u_z", "slip", "force", "stress" or "pressure"
        (`knitstudy.use.deformed`).
    axes : Axes, optional
        Axes of the caller's figure, in which the picture is one panel.

    Raises
    ------
    ConfigurationError
        When there is no result, or several with a colour, or the history does not hold the values of the colour.
    """
    if not results or (colour is not None and len(results) > 1):
        raise ConfigurationError("plot takes results of simulate, and one alone where it has a colour")
    if colour is None:
        drawing = draw(*(result.history for result in results))
    else:
        (one,) = results
        at_full_load = partial(solids, one.scene, one.geometry, one.mesh, one.history)
        radius = one.scene.radius
        drawing = deformed.draw(deformed.deformed(one.geometry, one.history, radius, colour, at_full_load))
    if axes is not None:
        axes.imshow(pixels(drawing))
        axes.set_axis_off()
    return drawing


@styled
def draw(dataset: xr.Dataset, *others: xr.Dataset) -> Figure:
    """Draw a result: force over strain, forces of crossings over strain, or the yarns from the front.

    Histories may have `others` beside them. Raises DataFileError when a dataset is no result of this study, or results
    of other kinds should be drawn together.
    """
    kind = kind_of(dataset)
    for drawn in (dataset, *others):
        require_layout(drawn, kind)
    if others and kind != "history":
        raise DataFileError(
            f"results of the kind {kind!r} cannot be drawn in one picture; draw one after the other"
        )
    histories = (dataset, *others)
    if len({("pressure" in drawn, drawn.attrs.get("axis", 0) == 2) for drawn in histories}) > 1:
        names = ", ".join(map(_name, histories))
        raise DataFileError(f"{names}: tension, shear and plates do not share axes; draw each by itself")
    drawing = figure(1.35 * SINGLE, SINGLE, layout="constrained")
    of_cells = all("force_per_width" in drawn for drawn in histories)
    rows = [2, 1] if of_cells else [1]
    panels = drawing.subplots(len(rows), sharex=True, squeeze=False, height_ratios=rows)[:, 0]
    one: Callable[..., None] = _cell if of_cells else _DRAWN[kind]
    for drawn, look in zip(histories, cycle(LOOKS), strict=False):
        one(drawn, *panels, **({"look": look, "label": _name(drawn)} if others else {}))
    axes = panels[0]
    if axes.get_legend_handles_labels()[1]:
        axes.legend()
    if not others:
        axes.set_title(_name(dataset), loc="left", wrap=True)
    return drawing


def _name(dataset: xr.Dataset) -> str:
    return f"{dataset.attrs.get('scene', '')}{' (incomplete)' if 'incomplete' in dataset.attrs else ''}"


def _cell(history: xr.Dataset, axes: Axes, lateral: Axes, look: Look = LOOKS[0], label: str = "") -> None:
    """Draw the force per width and the lateral strain of a cell over its strain, a cycle with its loss; or pressure."""
    axis = int(history.attrs["axis"])
    way = STRAINS[axis]
    across = STRAINS[1 - axis if axis < 2 else 0]
    table = curve_table(history)
    if "pressure" in history:
        thickness = 1e3 * history["thickness"]
        axes.plot(thickness, 1e-3 * history["pressure"], look[0], color=look[1], label=label)
        lateral.plot(thickness, PERCENT * table[STRAIN("course")], color=look[1])
        axes.set_ylabel("pressure (kPa)")
        lateral.set(xlabel="thickness (mm)", ylabel="course strain (%)")
        return
    curve = force_over_strain(table, way)
    if loss := loss_of_cycle(curve):
        label = f"{label} loss {loss.share:.0%}".strip()
    axes.plot(PERCENT * curve.index, curve, look[0], color=look[1], label=label)
    lateral.plot(PERCENT * curve.index, PERCENT * table[STRAIN(across)], color=look[1])
    axes.set_ylabel("force per width (N/m)")
    names = ("strain", "lateral strain") if axis < 2 else ("shear", "course strain")
    lateral.set(xlabel=f"{names[0]} (%)", ylabel=f"{names[1]} (%)")


def _history(dataset: xr.Dataset, axes: Axes, look: Look = LOOKS[0], label: str = "") -> None:
    if "smallest_gap" in dataset and not touched(dataset):
        axes.text(0.5, 0.95, "nothing touched", transform=axes.transAxes, ha="center", va="top", color=FAINT)
    unit = dataset["force"].attrs.get("units", "N")
    x = PERCENT * dataset["strain"]
    labels = {"xlabel": "strain (%)", "ylabel": f"reaction force ({unit})"}
    if int(dataset.attrs.get("axis", 0)) == 2:  # a pair: its way may go back and forth
        x = dataset["load"]
        labels = {"xlabel": "load factor (1)", "ylabel": "force along z (N)"}
    axes.plot(x, dataset["force"], look[0], color=look[1], label=label)
    axes.set(**labels)


def _contacts(dataset: xr.Dataset, axes: Axes) -> None:
    force = np.linalg.norm(dataset["force"].to_numpy(), axis=-1)
    for zone, colour in enumerate(YARNS):
        chosen = dataset["zone"].to_numpy() == zone
        if chosen.any():
            largest = force[:, chosen].max(axis=1)
            axes.plot(PERCENT * dataset["strain"], largest, color=colour, label=f"zone {zone}")
    axes.set(xlabel="strain (%)", ylabel="largest force at a crossing (N)")
    axes.legend()


def _stresses(dataset: xr.Dataset, axes: Axes) -> None:
    value = MEGAPASCAL * principal_axes(dataset["cell_stress"].to_numpy()[:, FULL])[0][:, 0]
    order = np.argsort(value)
    place = MILLIMETRE * dataset["cell_place"].to_numpy()[order]
    dots = axes.scatter(
        place[:, 0], place[:, 1], c=value[order], s=1.0, linewidth=0, cmap="cividis", rasterized=True
    )
    axes.figure.colorbar(dots, ax=axes, label="maximum principal stress (MPa)")
    _in_the_plane(axes)


def _mesh(dataset: xr.Dataset, axes: Axes) -> None:
    _yarns(axes, np.split(dataset["centres"].to_numpy(), dataset["first_slice"].to_numpy()[1:-1]), ".-")


def _rest(dataset: xr.Dataset, axes: Axes) -> None:
    _yarns(axes, [dataset["centreline"].to_numpy()], ".")


def _geometry(dataset: xr.Dataset, axes: Axes) -> None:
    fabric = fabric_of(dataset)
    _yarns(axes, [yarn.position(np.linspace(0, yarn.length, 400)) for yarn in fabric.centrelines], "-")
    crossings = MILLIMETRE * fabric.crossings.point.mean(axis=1)
    axes.plot(*crossings[:, :2].T, "o", color=FAINT, markerfacecolor="none")


def _yarns(axes: Axes, places: list[np.ndarray], line: str) -> None:
    """Draw yarns through places (k, 3) [m] from the front."""
    for number, place in enumerate(places):
        axes.plot(*MILLIMETRE * place[:, :2].T, line, color=YARNS[number % len(YARNS)], markersize=1.5)
    _in_the_plane(axes)


@styled
def draw_loop(dataset: xr.Dataset) -> Figure:
    """Draw a knit's loops, two yarns or a repeat, from the front and from the side, yarns as thick as they are."""
    fabric = fabric_of(dataset)
    assert fabric.loop is not None, "a knit has a loop"
    loop = fabric.loop
    diameter = 2 * MILLIMETRE * fabric.radius
    knit = plain_knit(loop, max(2, loop.columns), loop.rows)
    points = [MILLIMETRE * yarn.position(np.linspace(0, yarn.length, 600)) for yarn in knit.centrelines]
    low, high = (pick(np.concatenate(points), axis=0) for pick in (np.min, np.max))
    extent = high - low + 2 * diameter
    drawing = figure(1.35 * SINGLE, SINGLE)
    views = drawing.subplots(1, 2, sharey=True, width_ratios=[extent[0], extent[2]])
    for axes, across in zip(views, (0, 2), strict=True):
        axes.set(xlabel=f"{'xyz'[across]} (mm)", aspect="equal")
        axes.set(
            xlim=(low[across] - diameter, high[across] + diameter),
            ylim=(low[1] - diameter, high[1] + diameter),
        )
    views[0].set_ylabel("y, wale (mm)")
    drawing.canvas.draw()
    for axes, (across, depth) in zip(views, ((0, 2), (2, 0)), strict=True):
        left, right = axes.transData.transform([[0.0, 0.0], [diameter, 0.0]])[:, 0]
        width = (right - left) * 72 / drawing.dpi  # points
        flat = [line[:, [across, 1]] for line in points]
        pieces = np.concatenate([np.stack([line[:-4], line[4:]], axis=1) for line in flat])
        yarn = np.repeat(np.arange(len(points)), [len(line) - 4 for line in points])
        # From the back to the front, each piece on a wider one, which parts it from others.
        order = np.repeat(np.concatenate([line[2:-2, depth] for line in points]).argsort(kind="stable"), 2)
        colours = [YARNS[yarn[piece]] if k % 2 else PAPER for k, piece in enumerate(order)]
        widths = np.tile([1.15 * width, width], len(pieces))
        axes.add_collection(
            LineCollection([*pieces[order]], colors=colours, linewidths=widths, capstyle="butt")
        )
    views[1].set_xticks([0.0])
    return drawing


@styled
def draw_curves(curves: Mapping[str, pd.Series]) -> Figure:
    """Draw curves by their labels: the first one, which was measured, by its points."""
    drawing = figure(1.35 * SINGLE, SINGLE, layout="constrained")
    axes = drawing.subplots()
    for (label, curve), colour, line in zip(curves.items(), (INK, *YARNS), ("o", "-", "-"), strict=False):
        axes.plot(PERCENT * curve.index, curve, line, color=colour, label=label)
    axes.set(xlabel="strain (%)", ylabel="force per width (N/m)", xlim=(0, None), ylim=(0, None))
    axes.legend()
    return drawing


def _in_the_plane(axes: Axes) -> None:
    axes.set(xlabel="x, course (mm)", ylabel="y, wale (mm)", aspect="equal")


_DRAWN = {
    "history": _history,
    "contacts": _contacts,
    "stresses": _stresses,
    "mesh": _mesh,
    "shape at rest": _rest,
    "geometry": _geometry,
}
