"""Pictures of solids: surfaces, the view on them, rows of pictures that fill a figure, and labels over them.

PyVista renders in a process of its own: VTK ends its process with a segmentation fault where it finds neither EGL nor
OSMesa to render off screen, and then takes one picture along, not the study. Views are parallel projections: lengths
in the plane of a picture are true, and the same projection places labels over a picture.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.typing import ColorType
from numpy.typing import NDArray

import knitstudy
from knitstudy.errors import KnitstudyError, MissingPackageError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.mesh.sweep import SweptMesh, rotation_minimising
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.registry import remedy_of_missing
from knitstudy.use.style import (
    DOUBLE,
    INCH,
    INK,
    MILLIMETRE,
    PAPER,
    YARNS,
    Style,
    figure,
    panel_letter,
    place,
    resolution,
)

FEATURE_ANGLE = 50.0  # beyond which an edge stays sharp [deg]: of caps and arrow heads, not round a tube

Image = NDArray[np.uint8]  # (height, width, 4), RGBA
Place = Sequence[float] | Floats  # (2,) in the coordinates of axes
Window = tuple[float, float, float, float]  # left, right, bottom and top of a picture in its plane [mm]


class RenderingError(KnitstudyError):
    """A picture that cannot be rendered on this machine."""


@dataclass(frozen=True)
class View:
    """A direction of sight and the upright direction."""

    towards: tuple[float, float, float]  # from the eye into the scene
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)  # appears upright; needs not be normal to ``towards``

    @classmethod
    def orbit(cls, turn: float, tilt: float) -> View:
        """Return the view onto the xy plane after going round y by `turn` and then up by `tilt` [deg]."""
        a, b = np.radians([turn, tilt])
        eye = np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
        return cls(tuple(-eye))

    @cached_property
    def basis(self) -> Floats:
        """Unit vectors to the right, up and to the eye as rows (3, 3)."""
        back = -np.asarray(self.towards, dtype=float)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    def project(self, points: Floats) -> Floats:
        """Return places (..., 2) of points (..., 3) in the plane of the picture, in the unit of the points."""
        return np.asarray(points) @ self.basis[:2].T


FRONT = View((0.0, 0.0, -1.0))  # onto the plane of the fabric


@dataclass(frozen=True)
class Surface:
    """Facets of one colour."""

    points: Floats  # (N, 3) corners [m]
    # (F, 4) corners of the facets, counter-clockwise from outside; two of them may coincide
    faces: Ints
    colour: ColorType
    opacity: float = 1.0
    edges: bool = False  # whether the edges of the facets are drawn
    colours: NDArray[np.uint8] | None = None  # (N, 3) of the corners, 0 to 255, in place of one colour


@dataclass(frozen=True)
class Picture:
    """Surfaces, the view on them, and the part of the picture plane that is shown."""

    surfaces: Sequence[Surface]
    view: View
    window: Window
    bar: float = 0.0  # length of the scale bar at its foot [mm]; without one there is none
    directions: bool = True  # whether the directions of x, y and z stand beside the scale bar
    pixels: tuple[int, int] = (0, 0)  # width and height


# ---- Surfaces

AROUND = 40  # facets around a tube
STEP = 0.15  # distance of the points that yarns are drawn through, in radii


def tube(
    centreline: Sequence[Floats] | Floats, radius: float | Floats, colour: ColorType, opacity: float = 1.0
) -> Surface:
    """Return a closed tube about a curve through points (k, 3) [m], of one radius or one at every point (k,) [m]."""
    centreline = np.asarray(centreline, dtype=float)
    tangent = np.gradient(centreline, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = rotation_minimising(centreline, tangent)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    radial = np.einsum("ad,kdi->kai", np.stack([np.cos(angle), np.sin(angle)], axis=1), frame[:, :2])
    rings = centreline[:, None] + np.reshape(radius, (-1, 1, 1)) * radial
    # The caps are rings of radius zero.
    first, last = (np.repeat(centreline[[k], None], AROUND, axis=1) for k in (0, -1))
    rings = np.concatenate([first, rings, last])
    number = np.arange(rings.shape[0] * AROUND).reshape(-1, AROUND)
    ahead = np.roll(number, -1, axis=1)
    faces = np.stack([number[:-1], ahead[:-1], ahead[1:], number[1:]], axis=-1)
    return Surface(rings.reshape(-1, 3), faces.reshape(-1, 4), colour, opacity)


def yarn_colours(fabric: Fabric, colours: Sequence[str] = YARNS) -> list[str]:
    """Return a colour for every yarn, again and again from the first; all pieces of a cut yarn have the same."""
    whole = fabric.arcs.yarn if fabric.arcs else np.arange(len(fabric.centrelines))
    return [colours[number % len(colours)] for number in whole.tolist()]


def yarn_tubes(fabric: Fabric, colours: Sequence[ColorType]) -> list[Surface]:
    """Return the undeformed yarns of a fabric in colours by yarn."""
    surfaces = []
    for curve, colour in zip(fabric.centrelines, colours, strict=True):
        s = np.linspace(0, curve.length, round(curve.length / (STEP * fabric.radius)))
        surfaces.append(tube(curve.position(s), fabric.radius, colour))
    return surfaces


def graded_tube(
    centreline: Sequence[Floats] | Floats, radius: float, colours: NDArray[np.str_]
) -> list[Surface]:
    """Return a closed tube about a curve through points (k, 3) [m] whose colours (k,) change from point to point."""
    whole = tube(centreline, radius, str(colours[0]))
    # Rings of facets: the first cap, k - 1 between the points, the last cap.
    ahead = np.concatenate([[colours[0]], colours[1:], [colours[-1]]])
    of_face = np.repeat(ahead, AROUND)
    return [
        Surface(whole.points, whole.faces[of_face == colour], str(colour)) for colour in np.unique(of_face)
    ]


def sphere(centre: Floats, radius: float, colour: ColorType, opacity: float = 1.0) -> Surface:
    """Return a sphere [m]."""
    angle = np.linspace(0, np.pi, 25)
    axis = np.array([0.0, 0.0, radius])
    return tube(centre - np.outer(np.cos(angle), axis), radius * np.sin(angle), colour, opacity)


def arrow(start: Floats, vector: Floats, radius: float, colour: ColorType) -> Surface:
    """Return an arrow whose shaft has a radius [m] and whose head is three times as thick."""
    neck = 1 - 8 * radius / np.linalg.norm(vector)
    place = start + np.outer([0, neck, neck, 1], vector)
    return tube(place, radius * np.array([1, 1, 3, 0]), colour)


def yarn_of_mesh(mesh: SweptMesh, yarn: int, colour: ColorType) -> Surface:
    """Return the lateral surface of one yarn of a mesh, with the edges of its facets."""
    corners, faces = np.unique(mesh.surface_quads(yarn), return_inverse=True)
    return Surface(mesh.nodes[corners], faces.reshape(-1, 4), colour, edges=True)


# ---- Rows of pictures

HALO = (withStroke(linewidth=2.0, foreground=PAPER),)  # keeps letters and lines legible on any background
SILL = 4.0  # room below a knit for the scale bar [mm of the knit]
BAR = 15.0  # room for a bar of colours and its label [mm]
GAP = 0.015  # between pictures side by side, over the width of the figure


def window_around(points: Floats, room: Place, view: View = FRONT) -> Window:
    """Return the window about points (k, 3) [m], with room (2,) on the right and left and above and below [mm]."""
    flat = MILLIMETRE * view.project(points)
    (left, bottom), (right, top) = flat.min(axis=0) - room, flat.max(axis=0) + room
    return float(left), float(right), float(bottom), float(top)


def bounds(surfaces: Sequence[Surface], view: View = FRONT, below: float = SILL) -> Window:
    """Return the window of surfaces with a margin, and with room `below` them [mm]."""
    points = np.concatenate([surface.points for surface in surfaces])
    margin = 0.03 * MILLIMETRE * np.ptp(view.project(points), axis=0).max()
    left, right, bottom, top = window_around(points, (margin, margin), view)
    return left, right, bottom - below, top


def draw_rows(
    rows: Sequence[Sequence[Picture | None]],  # from above to below
    width: float = DOUBLE,  # of the figure [mm]
    head: float = 7.0,  # room above each row for titles, below all rows, and above all of them [mm]
    foot: float = 0.0,
    above: float = 0.0,
    titles: Sequence[str] = (),  # of the first panels, and the letters before them
    letters: Sequence[str] = "abcdefgh",
) -> tuple[Figure, list[Axes]]:
    """Return a figure that rows of pictures fill, and their axes, row by row.

    Pictures of a row are equally wide, the row is as high as the highest; where one is None the axes stay empty.
    """

    def high(row: Sequence[Picture | None]) -> float:
        wide = width * (1 / len(row) - GAP)
        windows = [picture.window for picture in row if picture]
        return head + wide * max((top - bottom) / (right - left) for left, right, bottom, top in windows)

    bottom = foot + sum(map(high, rows))
    drawing = figure(width, bottom + above)
    panels = []
    for row in rows:
        bottom -= high(row)
        for k, picture in enumerate(row):
            left = k / len(row) + GAP / 2
            panels.append(place(drawing, left, bottom, 1 / len(row) - GAP, high(row) - head))
            if picture:
                show(panels[-1], picture)
    for axes, letter, title in zip(panels, letters, titles, strict=False):
        panel_letter(axes, letter, title)
    return drawing, panels


def show(axes: Axes, picture: Picture) -> None:
    """Fill axes with a picture and its scale bar; their coordinates are mm in its plane.

    The window of the picture is widened to the shape of the axes.

    Raises ConfigurationError when the environment variable KNITSTUDY_DPI names no resolution, and RenderingError when
    VTK cannot render on this machine.
    """
    share = axes.get_position(original=True)
    drawing = axes.get_figure(root=True)
    assert drawing is not None
    size = INCH * drawing.get_size_inches() * [share.width, share.height]  # mm
    corners = np.reshape(picture.window, (2, 2))  # left and right, bottom and top
    half = size * (np.ptp(corners, axis=1) / size).max() / 2
    middle = corners.mean(axis=1)
    (left, bottom), (right, top) = (middle - half).tolist(), (middle + half).tolist()
    window = left, right, bottom, top
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.set_axis_off()
    wide, high = (resolution() / INCH * size).astype(int).tolist()
    image = rendered(replace(picture, window=window, pixels=(wide, high)))
    axes.imshow(image, extent=window, interpolation="none", zorder=0)
    if picture.bar:
        scale_bar(axes, picture.bar, picture.view if picture.directions else None)


def colour_bar(
    drawing: Figure, scale: ScalarMappable, label: str, left: float, width: float, **look: Any
) -> Colorbar:
    """Draw a bar of colours in the lowest `BAR` mm of a figure, from a share of its width on and so wide."""
    axes = place(drawing, left, 0.58 * BAR, width, 0.14 * BAR)
    bar = drawing.colorbar(scale, cax=axes, orientation="horizontal", **look)
    bar.set_label(label, labelpad=1)
    return bar


# ---- Over the picture


def write(axes: Axes, place: Place, text: str, **options: Any) -> None:
    """Write a text about a place in the coordinates of the axes, legible on any background."""
    look: Style = {"ha": "center", "va": "center", "path_effects": HALO, "zorder": 10}
    x, y = place
    axes.text(x, y, text, **look | options)


def label(axes: Axes, place: Place, text: str, offset: tuple[float, float], colour: ColorType = INK) -> None:
    """Name a place (2,) with a thin line from the text, which stands `offset` points away."""
    both: Style = {"color": colour, "path_effects": HALO}
    line: Style = {"arrowstyle": "-", "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0, **both}
    look: Style = {"ha": "center", "va": "center", "zorder": 10, **both}
    axes.annotate(text, tuple(place), xytext=offset, textcoords="offset points", arrowprops=line, **look)


def draw_arrow(
    axes: Axes, tail: Place, vector: Place, colour: ColorType, width: float, **options: Any
) -> None:
    """Draw an arrow from a place (2,) along a vector (2,) in the coordinates of the axes."""
    look: Style = {"arrowstyle": "-|>", "linewidth": width, "color": colour, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        "",
        tuple(np.add(tail, vector)),
        tuple(tail),
        arrowprops=look | options,
        annotation_clip=False,
        zorder=7,
    )


def scale_bar(axes: Axes, length: float, view: View | None = None, left: float = 0.03) -> None:
    """Draw a bar of a length [mm] at the foot from a share of the axes on, and the directions of a view."""
    x, y = axes.transLimits.inverted().transform((left, 0.02))
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt", marker="", zorder=10)
    look: Style = {"ha": "left", "va": "bottom", "path_effects": HALO, "zorder": 10}
    axes.annotate(f"{length:g} mm", (x, y), xytext=(0, 4), textcoords="offset points", **look)
    if view is None:
        return
    # An axis that points to the eye is left out: it would be a dot.
    arms = {name: view.project(direction) for name, direction in zip("xyz", np.eye(3), strict=True)}
    arms = {name: length / 2 * arm for name, arm in arms.items() if np.linalg.norm(arm) > 0.1}
    lowest = min(0.0, *(arm[1] for arm in arms.values()))
    origin = axes.transLimits.inverted().transform((1.0, 0.03)) - [0.8 * length, lowest]
    for name, arm in arms.items():
        draw_arrow(axes, origin, arm, INK, 0.9)
        write(axes, origin + (1 + 0.11 * length / np.linalg.norm(arm)) * arm, f"${name}$")


# ---- Rendering


def rendered(picture: Picture) -> Image:
    """Return a picture as RGBA array (height, width, 4) with a transparent background.

    Raises RenderingError when VTK cannot render on this machine, MissingPackageError without PyVista.
    """
    if find_spec("pyvista") is None:
        raise MissingPackageError(remedy_of_missing("pyvista"))
    process = _process()
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        pickle.dump(picture, process.stdin)
        process.stdin.flush()
        image: Image = pickle.load(process.stdout)
        return image
    except (OSError, EOFError, pickle.UnpicklingError) as error:
        raise RenderingError(
            f"VTK cannot render here: its process ended with status {process.wait()}; it needs EGL or OSMesa"
            " (on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        ) from error


@cache
def _process() -> subprocess.Popen[bytes]:
    """Start the process that renders; it ends with this one, when its input is closed.

    It finds modules where this process does, but for the working folder: a json.py there is no module of ours.
    """
    folders = [folder for folder in sys.path if folder and Path(folder).resolve() != Path.cwd()]
    package = str(Path(knitstudy.__file__).resolve().parents[1])
    return subprocess.Popen(
        [sys.executable, "-P", "-c", "from knitstudy.use.solids import serve; serve()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(dict.fromkeys((*folders, package)))},
    )


def serve() -> None:
    """Render the pictures that come in through the standard input until there are no more."""
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # without a display it warns before it uses EGL
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of VTK must not mix with answers
    with suppress(EOFError):
        while True:
            pickle.dump(render(pickle.load(sys.stdin.buffer)), answers)
            answers.flush()


def render(picture: Picture) -> Image:
    """Return a picture as RGBA array, rendered in this process."""
    import pyvista  # takes seconds: only the process that renders needs it

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[*picture.pixels], lighting="none")
    light: Style = {"ambient": 0.28, "diffuse": 0.78, "specular": 0.15, "specular_power": 25}
    edges: Style = {"edge_color": "#5A5A5A", "edge_opacity": 0.6, "line_width": 1.0}
    smooth: Style = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": FEATURE_ANGLE}
    for surface in picture.surfaces:
        corners: Any = surface.faces
        mesh = pyvista.PolyData.from_regular_faces(MILLIMETRE * surface.points, corners)
        look: Style = {"color": surface.colour, "opacity": surface.opacity, "show_edges": surface.edges}
        if surface.colours is not None:
            mesh["colours"] = surface.colours
            look |= {"color": None, "scalars": "colours", "rgb": True}
        mesh = mesh.clean()
        plotter.add_mesh(mesh, **look, **light, **edges, **smooth)
    # A key light from the upper left, a weaker one from the right, both turning with the view.
    for position, intensity in (((-0.55, 0.75, 1.0), 0.85), ((0.9, -0.1, 0.7), 0.30)):
        plotter.add_light(pyvista.Light(position=position, light_type="camera light", intensity=intensity))
    _aim(plotter, picture)
    if any(surface.opacity < 1 for surface in picture.surfaces):
        plotter.enable_depth_peeling(number_of_peels=12)
    else:
        # Shadows within 1.5 mm, a yarn's width; the bias hides the facets of a tube.
        plotter.enable_ssao(radius=1.5, bias=0.1, kernel_size=32, blur=True)
    plotter.enable_anti_aliasing("ssaa")
    image = np.array(plotter.screenshot(None, transparent_background=True, return_img=True))
    plotter.close()
    return image


def _aim(plotter: Any, picture: Picture) -> None:
    """Point the camera at the window of a picture."""
    left, right, bottom, top = picture.window
    basis = picture.view.basis
    depth = MILLIMETRE * np.concatenate([surface.points for surface in picture.surfaces]) @ basis[2]
    focus = basis.T @ [(left + right) / 2, (bottom + top) / 2, depth.mean()]
    # As near as can be: ambient occlusion keeps positions relative to the eye in half precision.
    eye = focus + (depth.max() - depth.mean() + 1) * basis[2]
    plotter.camera_position = [tuple(eye), tuple(focus), tuple(basis[1])]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = (top - bottom) / 2
    plotter.reset_camera_clipping_range()
