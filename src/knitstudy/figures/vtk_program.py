"""Renders surfaces with VTK: ``python -m knitstudy.figures.vtk_program`` reads what to render from its input.

It is a process of its own because VTK ends its process with a segmentation fault where it finds no way to
render; whoever started it then sees no more than an exit status. Every line names a file with a pickled job and one
for the picture, with a tab between them, and is answered by a line when the picture is there.
"""

from __future__ import annotations

import os
import pickle
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from knitstudy.figures.surface import Surface
from knitstudy.figures.view import View

MILLIMETRE = 1e3

FEATURE_ANGLE = 50.0
"""Angle of facets beyond which an edge stays sharp [deg]: caps and arrow heads, not the turn of a tube."""


@dataclass(frozen=True)
class Job:
    """A picture to render.

    Attributes
    ----------
    surfaces : tuple of Surface
    view : View
    window : tuple of 4 floats
        Left, right, bottom and top of the picture in its plane [mm].
    pixels : tuple of 2 ints
        Width and height.
    """

    surfaces: tuple[Surface, ...]
    view: View
    window: tuple[float, float, float, float]
    pixels: tuple[int, int]


def render(job: Job, path: Path) -> None:
    """Write a picture as PNG with a transparent background."""
    import pyvista  # takes seconds: only this process needs it, not the one that reads `Job`

    plotter = pyvista.Plotter(off_screen=True, window_size=job.pixels, lighting="none")
    for surface in job.surfaces:
        _add(plotter, surface)
    _light(plotter, job.view)
    _aim(plotter, job)
    if any(surface.opacity < 1 for surface in job.surfaces):
        plotter.enable_depth_peeling(number_of_peels=12)
    else:
        # Shadows of what is nearer than 1.5 mm, a yarn's width; the bias hides the facets of a tube.
        plotter.enable_ssao(radius=1.5, bias=0.1, kernel_size=32, blur=True)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(path, transparent_background=True)
    plotter.close()


def _add(plotter, surface: Surface) -> None:
    import pyvista

    faces = np.column_stack([np.full(len(surface.faces), surface.faces.shape[1]), surface.faces])
    mesh = pyvista.PolyData(MILLIMETRE * surface.points, faces.ravel())
    mesh = mesh.clean().compute_normals(
        split_vertices=True, feature_angle=FEATURE_ANGLE, consistent_normals=False, auto_orient_normals=False
    )
    plotter.add_mesh(
        mesh,
        color=surface.colour,
        opacity=surface.opacity,
        smooth_shading=True,
        ambient=0.28,
        diffuse=0.78,
        specular=0.15,
        specular_power=25,
        show_edges=surface.edges,
        edge_color="#5A5A5A",
        edge_opacity=0.6,
        line_width=1.0,
    )


def _light(plotter, view: View) -> None:
    """A key light from the upper left, a weaker one from the right, both turning with the view."""
    import pyvista

    for place, intensity in (((-0.55, 0.75, 1.0), 0.85), ((0.9, -0.1, 0.7), 0.30)):
        light = pyvista.Light(light_type="scene light", intensity=intensity)
        light.positional = False
        light.position = tuple(view.basis.T @ place)
        light.focal_point = (0.0, 0.0, 0.0)
        plotter.add_light(light)


def _aim(plotter, job: Job) -> None:
    left, right, bottom, top = job.window
    corners = MILLIMETRE * np.concatenate([surface.points for surface in job.surfaces])
    depth = corners @ job.view.basis[2]
    focus = job.view.basis.T @ [(left + right) / 2, (bottom + top) / 2, depth.mean()]
    camera = plotter.camera
    camera.focal_point = tuple(focus)
    # As near as can be: ambient occlusion keeps positions relative to the eye in half precision.
    camera.position = tuple(focus + (depth.max() - depth.mean() + 1) * job.view.basis[2])
    camera.up = tuple(job.view.basis[1])
    camera.enable_parallel_projection()
    camera.parallel_scale = (top - bottom) / 2
    plotter.reset_camera_clipping_range()


def serve(jobs: TextIO, answers: TextIO) -> None:
    """Render what lines ask for until there are no more."""
    for line in jobs:
        job, picture = line.rstrip("\n").split("\t")
        render(pickle.loads(Path(job).read_bytes()), Path(picture))
        print("done", file=answers, flush=True)


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what VTK prints is no answer
    serve(sys.stdin, answers)
