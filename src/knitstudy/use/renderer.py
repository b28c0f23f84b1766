"""Pictures of solids: surfaces, the view on them, and PyVista, which renders them in a process of its own.

VTK ends its process with a segmentation fault where it finds neither EGL nor OSMesa to render off screen: in a
process of its own it takes one picture along, not the study. Views are parallel projections: lengths in the plane of
a picture are true, and the same projection places labels over a picture.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from knitstudy.errors import KnitstudyError

if TYPE_CHECKING:
    import pyvista

MILLIMETRE = 1e3  # millimetres in a metre
FEATURE_ANGLE = 50.0  # beyond which an edge stays sharp [deg]: of caps and arrow heads, not round a tube

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
    def basis(self) -> np.ndarray:
        """Unit vectors to the right, up and to the eye as rows (3, 3)."""
        back = -np.asarray(self.towards, dtype=float)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return places (..., 2) of points (..., 3) in the plane of the picture, in the unit of the points."""
        return np.asarray(points) @ self.basis[:2].T


FRONT = View((0.0, 0.0, -1.0))  # onto the plane of the fabric


@dataclass(frozen=True)
class Surface:
    """Facets of one colour."""

    points: np.ndarray  # (N, 3) corners [m]
    # (F, 4) corners of the facets, counter-clockwise from outside; two of them may coincide
    faces: np.ndarray
    colour: str
    opacity: float = 1.0
    edges: bool = False  # whether the edges of the facets are drawn
    colours: np.ndarray | None = None  # (N, 3) of the corners, 0 to 255, in place of one colour


@dataclass(frozen=True)
class Picture:
    """Surfaces, the view on them, and the part of the picture plane that is shown."""

    surfaces: Sequence[Surface]
    view: View
    window: Window
    pixels: tuple[int, int] = (0, 0)  # width and height


def rendered(picture: Picture) -> np.ndarray:
    """Return a picture as RGBA array (height, width, 4) with a transparent background.

    Raises RenderingError when VTK cannot render on this machine.
    """
    process = _process()
    try:
        pickle.dump(picture, process.stdin)
        process.stdin.flush()
        return pickle.load(process.stdout)
    except (OSError, EOFError, pickle.UnpicklingError) as error:
        raise RenderingError(
            f"VTK cannot render here: its process ended with status {process.wait()}; it needs EGL or OSMesa"
            " (on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        ) from error


@cache
def _process() -> subprocess.Popen:
    """Start the process that renders; it ends with this one, when its input is closed."""
    return subprocess.Popen(
        [sys.executable, "-c", "from knitstudy.use.renderer import serve; serve()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
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


def render(picture: Picture) -> np.ndarray:
    """Return a picture as RGBA array, rendered in this process."""
    import pyvista  # takes seconds: only the process that renders needs it

    plotter = pyvista.Plotter(off_screen=True, window_size=picture.pixels, lighting="none")
    light = {"ambient": 0.28, "diffuse": 0.78, "specular": 0.15, "specular_power": 25}
    edges = {"edge_color": "#5A5A5A", "edge_opacity": 0.6, "line_width": 1.0}
    smooth = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": FEATURE_ANGLE}
    for surface in picture.surfaces:
        mesh = pyvista.PolyData.from_regular_faces(MILLIMETRE * surface.points, surface.faces)
        look = {"color": surface.colour, "opacity": surface.opacity, "show_edges": surface.edges}
        if surface.colours is not None:
            mesh["colours"] = surface.colours
            look |= {"color": None, "scalars": "colours", "rgb": True}
        mesh = mesh.clean()
        plotter.add_mesh(mesh, **look, **light, **edges, **smooth)
    # A key light from the upper left, a weaker one from the right, both turning with the view.
    for place, intensity in (((-0.55, 0.75, 1.0), 0.85), ((0.9, -0.1, 0.7), 0.30)):
        plotter.add_light(pyvista.Light(position=place, light_type="camera light", intensity=intensity))
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


def _aim(plotter: pyvista.Plotter, picture: Picture) -> None:
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
