"""Fig. 13: the flow of the maximum principal stress along the yarns, course and wale tension."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, PowerNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import bounds, scale_bar, show, triad
from knitstudy.figures.renderer import FRONT, Surface
from knitstudy.figures.shapes import tube
from knitstudy.figures.style import DOUBLE, MEGAPASCAL, figure, panel_letter
from knitstudy.measures.catalogue import solid
from knitstudy.mechanics.materials import FULL
from knitstudy.mechanics.solid import principal_axes
from knitstudy.mesh.sweep import SweptMesh

YARN = "#EDEAE4"  # of yarns below the streaks
SHADES = 14  # colours of streaks
LARGEST = 98.0
"""Percentile of the values that the darkest colour begins at: stress peaks at few places where yarns touch."""

EVEN = 0.6  # power of the stress that colours are even in: most of a knit bears little
SPACING, AROUND, LENGTH = 0.5, 14, 1.9
"""Of streaks: distance along the yarn and length, over its radius, and number around it."""

WIDTH = (0.045, 0.14)  # of a streak without stress and with the largest one, over the yarn's radius
FOOT, HEAD = 15.0, 8.0  # room for colour bars below and for titles above [mm]
CLOSE = (1.25, 0.95)  # width and height of the close views, over the width of a cell
SILL = 3.0  # room below the knit for the scale bar [mm of the knit]
STEPS = 10  # of a streak to either side of its middle
ABOVE = 1.02  # of streaks, over the yarn's radius: clear of the facets of a tube


@FIGURES.add(
    "fig13_principal_stress",
    "Fig. 13: flow of the maximum principal stress, isotropic friction",
    results={
        "isotropic_course_dns_mesh": solid("mesh", "isotropic-course"),
        "isotropic_course_dns_stress": solid("stress", "isotropic-course"),
        "isotropic_wale_dns_mesh": solid("mesh", "isotropic-wale"),
        "isotropic_wale_dns_stress": solid("stress", "isotropic-wale"),
    },
)
def draw(**results: xr.Dataset) -> Figure:
    """Draw the deformed knits with streaks along the axes on their surfaces, darker where the stress is larger."""
    knits = {}
    for direction in ("course", "wale"):
        mesh, stresses = (results[f"isotropic_{direction}_dns_{name}"] for name in ("mesh", "stress"))
        knits[direction] = (*flow(SweptMesh.from_dataset(mesh), stresses), stresses)
    windows = np.array([bounds(surfaces, FRONT) for surfaces, _, _ in knits.values()])
    window = (windows[:, 0].min(), windows[:, 1].max(), windows[:, 2].min() - SILL, windows[:, 3].max())
    panel = 0.485 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    close = 0.485 * DOUBLE * CLOSE[1] / CLOSE[0]
    height = panel + close + 2 * HEAD + FOOT
    drawing = figure(DOUBLE, height)
    for place, (direction, (surfaces, norm, stresses)) in enumerate(knits.items()):
        left = 0.01 + 0.5 * place
        axes = drawing.add_axes((left, (FOOT + close + HEAD) / height, 0.485, panel / height))
        show(axes, surfaces, FRONT, window)
        panel_letter(axes, "ab"[place], f"{direction} tension, {stresses.attrs['strain']:.2%} strain")
        scale_bar(axes, 5, (0.02, 0.0))
        triad(axes, FRONT, 2.5, (0.9, 0.0))
        axes = drawing.add_axes((left, FOOT / height, 0.485, close / height))
        show(axes, surfaces, FRONT, _cell(windows[place], stresses))
        panel_letter(axes, "cd"[place], "the centre cell")
        scale_bar(axes, 2, (0.02, 0.02))
        cax = drawing.add_axes((left + 0.1, 0.58 * FOOT / height, 0.285, 0.14 * FOOT / height))
        bar = drawing.colorbar(
            ScalarMappable(norm, colours()), cax=cax, orientation="horizontal", extend="max"
        )
        bar.set_ticks([tick for tick in MaxNLocator(4).tick_values(0, norm.vmax) if tick <= 0.95 * norm.vmax])
        bar.set_label("maximum principal stress (MPa)", labelpad=1)
    return drawing


def _cell(window: np.ndarray, stresses: xr.Dataset) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top about the middle of a knit in a window [mm]."""
    middle = np.array([window[0] + window[1], window[2] + window[3]]) / 2
    width = (window[1] - window[0]) / (int(stresses["segment_column"].max()) + 1)
    half = 0.5 * width * np.array(CLOSE)
    (left, bottom), (right, top) = middle - half, middle + half
    return float(left), float(right), float(bottom), float(top)


def flow(mesh: SweptMesh, stresses: xr.Dataset) -> tuple[list[Surface], PowerNorm]:
    """Return yarns with streaks, and the scale of their colours."""
    yarns = yarn_surfaces(mesh, stresses)
    radius = mesh.radius
    found = [streaks(yarn) for yarn in yarns]
    place, normal, value = (np.concatenate(each) for each in zip(*found, strict=True))
    value = MEGAPASCAL * value
    norm = PowerNorm(EVEN, 0, float(np.percentile(value, LARGEST)), clip=True)
    share = np.asarray(norm(value))
    shade = np.minimum((share * SHADES).astype(int), SHADES - 1)
    width = radius * (WIDTH[0] + share * (WIDTH[1] - WIDTH[0]))
    surfaces = [tube(yarn.centre, radius, YARN) for yarn in yarns]
    for number in np.unique(shade):
        here = shade == number
        colour = to_hex(colours()((number + 0.5) / SHADES))
        surfaces.append(ribbons(place[here], normal[here], width[here], colour))
    return surfaces, norm


def colours() -> LinearSegmentedColormap:
    """Return the colours from no stress, hardly darker than the yarn, to the largest."""
    every = matplotlib.colormaps["magma_r"](np.linspace(0.12, 0.95, 64))
    return LinearSegmentedColormap.from_list("flow", every)


# ---- streaks along the axes of the maximum principal stress on the surfaces of yarns ----


@dataclass(frozen=True, eq=False)
class YarnSurface:
    """The outermost cells of one yarn, deformed, in m layers along the yarn and at a angles around."""

    centre: np.ndarray  # (m, 3) of the layers [m]
    outwards: np.ndarray  # (m, a, 3) unit vectors from there to the cells
    stress: np.ndarray  # (m, a, 3, 3) mean Cauchy stress of the cells [Pa]
    radius: float  # [m]

    def at(self, layer: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places (k, 3), normals (k, 3) and stresses (k, 3, 3) at real numbers of layers and angles (k,)."""
        low = np.clip(np.floor(layer).astype(int), 0, len(self.centre) - 2)
        share = np.clip(layer - low, 0, 1)[:, None]
        left = np.floor(angle).astype(int)
        turn = (angle - left)[:, None]
        left, right = left % self.outwards.shape[1], (left + 1) % self.outwards.shape[1]

        def between(values: np.ndarray) -> np.ndarray:
            flat = values.reshape(*values.shape[:2], -1)
            near, far = (
                (1 - share) * flat[low, place] + share * flat[low + 1, place] for place in (left, right)
            )
            return ((1 - turn) * near + turn * far).reshape(len(layer), *values.shape[2:])

        normal = between(self.outwards)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        centre = (1 - share) * self.centre[low] + share * self.centre[low + 1]
        return centre + ABOVE * self.radius * normal, normal, between(self.stress)


def yarn_surfaces(mesh: SweptMesh, stresses: xr.Dataset) -> list[YarnSurface]:
    """Return the surfaces of all yarns of a mesh, with the stresses of the simulation on it."""
    section = mesh.section
    outer = np.flatnonzero(np.isin(section.quads, section.ring).sum(axis=1) >= 2)
    middle = section.points[section.quads[outer]].mean(axis=1)
    outer = outer[np.argsort(np.arctan2(middle[:, 1], middle[:, 0]))]
    layered = (-1, len(section.quads))
    stress = stresses["cell_stress"].to_numpy()[:, FULL].reshape(*layered, 3, 3)[:, outer]
    place = stresses["cell_place"].to_numpy().reshape(*layered, 3)[:, outer]
    yarn = stresses["cell_yarn"].to_numpy().reshape(layered)[:, 0]
    centre = place.mean(axis=1)
    outwards = place - centre[:, None]
    outwards /= np.linalg.norm(outwards, axis=-1, keepdims=True)
    return [
        YarnSurface(centre[yarn == each], outwards[yarn == each], stress[yarn == each], mesh.radius)
        for each in range(mesh.yarns)
    ]


def streaks(yarn: YarnSurface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return streaks on a yarn: places (k, 2 n + 1, 3) [m], normals to the surface there, and mean values (k,) [Pa]."""
    length = float(np.linalg.norm(np.diff(yarn.centre, axis=0), axis=1).sum())
    rows = max(2, round(length / (SPACING * yarn.radius)))
    layer, turn = np.meshgrid(
        np.linspace(0, len(yarn.centre) - 1, rows), np.arange(AROUND) / AROUND, indexing="ij"
    )
    # Every other row stands half a streak further around: no rows of streaks are seen.
    turn = turn + 0.5 / AROUND * (np.arange(rows) % 2)[:, None]
    seed = np.column_stack([layer.ravel(), turn.ravel() * yarn.outwards.shape[1]])
    _, normal, stress = yarn.at(*seed.T)
    start = _tangential(stress, normal)
    step = 0.5 * LENGTH * yarn.radius / STEPS
    ways = [_follow(yarn, seed, sign * start, step) for sign in (-1, 1)]
    place, normal, value = (
        np.concatenate([back[:, ::-1], ahead[:, 1:]], axis=1) for back, ahead in zip(*ways, strict=True)
    )
    return place, normal, value.mean(axis=1)


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


def _tangential(stress: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the axes (k, 3) of the maximum principal stress without their part along the normal: shorter if steep."""
    _, axes = principal_axes(stress)
    axis = axes[:, 0]
    return axis - np.einsum("ki,ki->k", axis, normal)[:, None] * normal


def _follow(
    yarn: YarnSurface, seed: np.ndarray, start: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places, normals (k, n + 1, 3) and values (k, n + 1) along the field from seeds (k, 2), steps [m] apart."""
    at, ahead = seed.copy(), start
    found = []
    for _ in range(STEPS + 1):
        place, normal, stress = yarn.at(*at.T)
        found.append((place, normal, principal_axes(stress)[0][:, 0]))
        way = _tangential(stress, normal)
        way *= np.where(np.einsum("ki,ki->k", way, ahead) < 0, -1.0, 1.0)[:, None]
        ahead = way
        at = at + step * _rates(yarn, at, place, way)
        at[:, 0] = np.clip(at[:, 0], 0, len(yarn.centre) - 1)
    return tuple(np.stack(each, axis=1) for each in zip(*found, strict=True))


def _rates(yarn: YarnSurface, at: np.ndarray, place: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return how many layers and angles (k, 2) a metre along vectors (k, 3) in the surface leads on."""
    small = 0.05
    inside = np.where(at[:, 0] > len(yarn.centre) - 1.5, -small, small)
    by_layer = (yarn.at(at[:, 0] + inside, at[:, 1])[0] - place) / inside[:, None]
    by_angle = (yarn.at(at[:, 0], at[:, 1] + small)[0] - place) / small
    basis = np.stack([by_layer, by_angle], axis=-1)  # (k, 3, 2)
    gram = np.swapaxes(basis, 1, 2) @ basis
    return np.linalg.solve(gram, np.einsum("kic,ki->kc", basis, way)[..., None])[..., 0]
