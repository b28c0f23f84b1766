"""Fig. 13: the flow of the maximum principal stress along the yarns, course and wale tension."""

from __future__ import annotations

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, PowerNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.interpolate import RegularGridInterpolator

from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.contact.solid import principal_axes
from knitstudy.mechanics.materials import FULL
from knitstudy.paper.scene_names import solid
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import (
    BAR,
    FRONT,
    Picture,
    Surface,
    bounds,
    colour_bar,
    draw_rows,
    tube,
    window_around,
)
from knitstudy.use.style import MEGAPASCAL, MILLIMETRE, PERCENT

YARN = "#EDEAE4"  # of yarns below the streaks
SHADES = 14  # colours of streaks
LARGEST = 98.0  # percentile that the darkest colour begins at: stress peaks at few places where yarns touch
EVEN = 0.6  # power of the stress that colours are even in: most of a knit bears little
SPACING, AROUND, LENGTH = 0.5, 14, 1.9  # of streaks: distance along over R, number around, length over R
WIDTH = (0.045, 0.14)  # of a streak without stress and with the largest one, over the yarn's radius
CLOSE = (1.15, 0.875)  # width and height of the close views, over the width of a cell
STEPS = 10  # of a streak to either side of its middle
ABOVE = 1.02  # of streaks, over the yarn's radius: clear of the facets of a tube


@FIGURES.add(
    "fig13_principal_stress",
    "Fig. 13: flow of the maximum principal stress, isotropic friction",
    results={
        f"isotropic_{direction}_dns_{name}": solid(name, f"isotropic-{direction}")
        for direction in DIRECTIONS
        for name in ("mesh", "stress")
    },
)
def draw(**results: xr.Dataset) -> Figure:
    """Draw the deformed knits with streaks along the axes on their surfaces, darker where the stress is larger."""
    knits = []
    for direction in DIRECTIONS:
        mesh, stresses = (results[f"isotropic_{direction}_dns_{name}"] for name in ("mesh", "stress"))
        knits.append((*flow(SweptMesh.from_dataset(mesh), stresses), stresses))
    window = bounds([surface for surfaces, _, _ in knits for surface in surfaces])
    whole = [Picture(surfaces, FRONT, window, 5) for surfaces, _, _ in knits]
    close = [
        Picture(surfaces, FRONT, _cell(surfaces, stresses), 2, directions=False)
        for surfaces, _, stresses in knits
    ]
    titles = [
        f"{direction} tension, {PERCENT * stresses.attrs['strain']:.3g} % strain"
        for direction, (_, _, stresses) in zip(DIRECTIONS, knits, strict=True)
    ]
    drawing, _ = draw_rows([whole, close], foot=BAR, titles=[*titles, *2 * ["the centre cell"]])
    for place, (direction, (_, scale, _)) in enumerate(zip(DIRECTIONS, knits, strict=True)):
        label = f"maximum principal stress in {direction} tension (MPa)"
        bar = colour_bar(drawing, scale, label, 0.11 + 0.5 * place, 0.285, extend="max")
        _, largest = scale.get_clim()
        ticks = MaxNLocator(4).tick_values(0, largest)
        bar.set_ticks([*(tick for tick in ticks if tick <= 0.8 * largest), largest])
        bar.ax.xaxis.set_major_formatter("{x:.3g}")
    return drawing


def _cell(surfaces: list[Surface], stresses: xr.Dataset) -> tuple[float, float, float, float]:
    """Return the window about the middle of a knit [mm]."""
    points = np.concatenate([surface.points for surface in surfaces])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    cell = MILLIMETRE * np.ptp(points[:, 0]) / (int(stresses["segment_column"].max()) + 1)
    return window_around(middle[None], 0.5 * cell * np.array(CLOSE))


def flow(mesh: SweptMesh, stresses: xr.Dataset) -> tuple[list[Surface], ScalarMappable]:
    """Return yarns with streaks, and the scale of their colours in MPa."""
    yarns = yarn_fields(mesh, stresses)
    radius = mesh.radius
    lines = [streaks(centre, surface, radius) for centre, surface in yarns]
    place, normal, value = (np.concatenate(parts) for parts in zip(*lines, strict=True))
    value = MEGAPASCAL * value
    # From no stress, nearly as light as the yarn, to the largest.
    colours = matplotlib.colormaps["magma_r"](np.linspace(0.12, 0.95, 64))
    norm = PowerNorm(EVEN, 0, float(np.percentile(value, LARGEST)), clip=True)
    scale = ScalarMappable(norm, LinearSegmentedColormap.from_list("flow", colours))
    share = np.asarray(norm(value))
    shade = np.minimum((share * SHADES).astype(int), SHADES - 1)
    width = radius * (WIDTH[0] + share * (WIDTH[1] - WIDTH[0]))
    surfaces = [tube(centre, radius, YARN) for centre, _ in yarns]
    for number in np.unique(shade):
        here = shade == number
        colour = to_hex(scale.cmap((number + 0.5) / SHADES))
        surfaces.append(ribbons(place[here], normal[here], width[here], colour))
    return surfaces, scale


# ---- streaks along the axes of the maximum principal stress on the surfaces of yarns ----


def yarn_fields(mesh: SweptMesh, stresses: xr.Dataset) -> list[tuple[np.ndarray, RegularGridInterpolator]]:
    """Return centres (m, 3) [m] and surface of every deformed yarn, at m layers along it and a angles around it.

    The fields of a surface over real numbers of layer and angle are place [m], unit normal, Cauchy stress [Pa] as 9
    numbers, and the derivatives of the place by layer and by angle, as the outermost cells have them.
    """
    section = mesh.section
    layered = (-1, len(mesh.section.quads))
    outer = np.flatnonzero(np.isin(section.quads, section.ring).sum(axis=1) >= 2)
    middle = section.points[section.quads[outer]].mean(axis=1)
    outer = outer[np.argsort(np.arctan2(middle[:, 1], middle[:, 0]))]
    place = stresses["cell_place"].to_numpy().reshape(*layered, 3)[:, outer]
    stress = stresses["cell_stress"].to_numpy()[:, FULL].reshape(*layered, 9)[:, outer]
    of_layer = stresses["cell_yarn"].to_numpy().reshape(layered)[:, 0]
    centre = place.mean(axis=1)
    normal = place - centre[:, None]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    place = centre[:, None] + ABOVE * mesh.radius * normal
    by_yarn = []
    for yarn in range(mesh.yarns):
        here = of_layer == yarn
        by_layer = np.gradient(place[here], axis=0)
        by_angle = (np.roll(place[here], -1, axis=1) - np.roll(place[here], 1, axis=1)) / 2
        fields = np.concatenate([place[here], normal[here], stress[here], by_layer, by_angle], axis=2)
        fields = np.pad(fields, ((0, 0), (0, 1), (0, 0)), mode="wrap")  # the first angle once more
        grid = tuple(map(np.arange, fields.shape[:2]))
        by_yarn.append((centre[here], RegularGridInterpolator(grid, fields)))
    return by_yarn


def streaks(
    centre: np.ndarray, surface: RegularGridInterpolator, radius: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return streaks on a yarn: places (k, 2 n + 1, 3) [m], normals to the surface there, and mean values (k,) [Pa]."""
    length = float(np.linalg.norm(np.diff(centre, axis=0), axis=1).sum())
    rows = max(2, round(length / (SPACING * radius)))
    layer, turn = np.indices((rows, AROUND)).astype(float)
    # Every other row stands half a streak further around: no rows of streaks are seen.
    turn = (turn + 0.5 * (layer % 2)) / AROUND
    layers, angles = (grid[-1] for grid in surface.grid)
    seed = np.column_stack([layer.ravel() * layers / (rows - 1), turn.ravel() * angles])
    step = 0.5 * LENGTH * radius / STEPS
    ways = zip(_follow(surface, seed, -step), _follow(surface, seed, step), strict=True)
    place, normal, value = (np.concatenate([back[:, ::-1], ahead[:, 1:]], axis=1) for back, ahead in ways)
    return place, normal, value.mean(axis=1)


def _follow(surface: RegularGridInterpolator, spot: np.ndarray, step: float) -> list[np.ndarray]:
    """Return places, normals (k, n + 1, 3) and values (k, n + 1) from spots (k, 2) along the axes, to one side."""
    layers, angles = (grid[-1] for grid in surface.grid)
    points = []
    ahead = None
    for _ in range(STEPS + 1):
        spot = np.column_stack([np.clip(spot[:, 0], 0, layers), spot[:, 1] % angles])
        place, normal, stress, *by = np.split(surface(spot), [3, 6, 15, 18], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        value, axes = principal_axes(stress.reshape(-1, 3, 3))
        points.append((place, normal, value[:, 0]))
        # The axis without its part along the normal is shorter where it is steep; it has no sign.
        way = axes[:, 0] - np.einsum("ki,ki->k", axes[:, 0], normal)[:, None] * normal
        if ahead is not None:
            way *= np.where(np.einsum("ki,ki->k", way, ahead) < 0, -1.0, 1.0)[:, None]
        ahead = way
        slopes = np.stack(by, axis=1)  # (k, 2, 3)
        spot = spot + step * np.linalg.solve(slopes @ slopes.swapaxes(1, 2), slopes @ way[..., None])[..., 0]
    return [np.stack(parts, axis=1) for parts in zip(*points, strict=True)]


def ribbons(place: np.ndarray, normal: np.ndarray, width: np.ndarray, colour: str) -> Surface:
    """Return streaks (k, n, 3) as ribbons that lie on the surface, pointed at their ends, of widths (k,) [m]."""
    along = np.gradient(place, axis=1)
    across = np.cross(normal, along)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-300)
    count, points = place.shape[:2]
    taper = np.sqrt(np.maximum(1 - np.linspace(-1, 1, points) ** 2, 0.02))
    half = 0.5 * width[:, None, None] * taper[:, None] * across
    number = np.arange(count * points).reshape(count, points)
    other = number + count * points
    faces = np.stack([number[:, :-1], other[:, :-1], other[:, 1:], number[:, 1:]], axis=-1)
    corners = np.concatenate([place + half, place - half]).reshape(-1, 3)
    return Surface(corners, faces.reshape(-1, 4), colour)
