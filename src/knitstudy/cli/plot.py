"""One plain picture of any result, in the style of the figures."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.style import FAINT, INK, SINGLE, YARNS, figure, styled
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.summary import kind_of, require_layout, touched
from knitstudy.mechanics.materials import FULL
from knitstudy.mechanics.solid import principal_axes

PERCENT, MILLI, MEGA = 100.0, 1e3, 1e-6


@styled
def draw(dataset: xr.Dataset) -> Figure:
    """Draw a result: force over strain, forces of crossings over strain, or the yarns from the front.

    Raises DataFileError when it is not a result of this study.
    """
    kind = kind_of(dataset)
    require_layout(dataset, kind)
    drawing = figure(1.35 * SINGLE, SINGLE)
    axes = drawing.add_axes((0.14, 0.13, 0.82, 0.82))
    _DRAWN[kind](dataset, axes)
    axes.set_title(str(dataset.attrs.get("scene", "")), loc="left")
    return drawing


def _history(dataset: xr.Dataset, axes: Axes) -> None:
    if "smallest_gap" in dataset and not touched(dataset):
        axes.text(0.5, 0.95, "nothing touched", transform=axes.transAxes, ha="center", va="top", color=FAINT)
    x, labels = PERCENT * dataset["strain"], {"xlabel": "strain (%)", "ylabel": "reaction force (N)"}
    if int(dataset.attrs.get("axis", 0)) == 2:  # a pair: its way may go back and forth
        x, labels = dataset["load"], {"xlabel": "load factor (1)", "ylabel": "force along z (N)"}
    axes.plot(x, dataset["force"], "o-", color=INK)
    axes.set(**labels)


def _contacts(dataset: xr.Dataset, axes: Axes) -> None:
    force = np.linalg.norm(dataset["force"].to_numpy(), axis=-1)
    for zone, colour in enumerate(YARNS):
        chosen = dataset["zone"].to_numpy() == zone
        lines = axes.plot(PERCENT * dataset["strain"], force[:, chosen], color=colour, linewidth=0.9)
        for line in lines[:1]:
            line.set_label(f"zone {zone}")
    axes.set(xlabel="strain (%)", ylabel="force at a crossing (N)")
    axes.legend()


def _stresses(dataset: xr.Dataset, axes: Axes) -> None:
    value = MEGA * principal_axes(dataset["cell_stress"].to_numpy()[:, FULL])[0][:, 0]
    order = np.argsort(value)
    place = MILLI * dataset["cell_place"].to_numpy()[order]
    dots = axes.scatter(*place[:, :2].T, c=value[order], s=1.0, linewidth=0, cmap="cividis", rasterized=True)
    axes.figure.colorbar(dots, ax=axes, label="maximum principal stress (MPa)")
    _in_the_plane(axes)


def _mesh(dataset: xr.Dataset, axes: Axes) -> None:
    bounds = dataset["first_slice"].to_numpy()
    centres = MILLI * dataset["centres"].to_numpy()
    for number, (first, end) in enumerate(pairwise(bounds)):
        axes.plot(*centres[first:end, :2].T, ".-", color=YARNS[number % len(YARNS)], markersize=1.5)
    _in_the_plane(axes)


def _geometry(dataset: xr.Dataset, axes: Axes) -> None:
    specimen = Fabric.from_dataset(dataset)
    for number, yarn in enumerate(specimen.centrelines):
        place = MILLI * yarn.position(np.linspace(0, yarn.length, 400))
        axes.plot(*place[:, :2].T, color=YARNS[number % len(YARNS)])
    crossings = MILLI * specimen.crossings.point.mean(axis=1)
    axes.plot(*crossings[:, :2].T, "o", color=FAINT, markerfacecolor="none")
    _in_the_plane(axes)


def _in_the_plane(axes: Axes) -> None:
    axes.set(xlabel="x, course (mm)", ylabel="y, wale (mm)", aspect="equal")


_DRAWN = {
    "history": _history,
    "contacts": _contacts,
    "stresses": _stresses,
    "mesh": _mesh,
    "geometry": _geometry,
}
