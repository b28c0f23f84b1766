"""A window under load: the loop and the history of the solids."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from knitstudy.gates.increment import require_sound
from knitstudy.gates.seam import require_no_jump
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.cost import Meter
from knitstudy.loading.follow import follow
from knitstudy.loading.load_path import load_path
from knitstudy.loading.problem import Problem
from knitstudy.loading.run import IN_MEMORY, Run
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear.lu import LU
from knitstudy.networks.rom.grips import grips, tension
from knitstudy.study.scene import Scene
from knitstudy.window.mixed_knit import MixedKnit, mixed_knit
from knitstudy.window.observation import WindowObserver


def simulate(
    scene: Scene, geometry: xr.Dataset, springs: xr.Dataset | None = None, run: Run = IN_MEMORY
) -> xr.Dataset:
    """Return the history of a scene of fidelity "window".

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the scene, in the format of docs/architecture.md.
    springs : Dataset, optional
        Contacts of the simulation that ``window.springs_from`` names.
    run : Run

    Raises
    ------
    ConfigurationError, GeometryError, MeshError
        As `mixed_knit`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.follow.follow`.
    """
    return follow(problem(scene, Knit.from_dataset(geometry), springs), run)


def problem(scene: Scene, knit: Knit, springs: xr.Dataset | None = None) -> Problem:
    """Return a scene of fidelity "window" as a problem; arguments and errors as of `simulate`."""
    meter = Meter()
    return problem_of(mixed_knit(scene, knit, springs), scene, knit, meter)


def problem_of(mixed: MixedKnit, scene: Scene, knit: Knit, meter: Meter | None = None) -> Problem:
    """Return a knit with a window under the load of a scene, and with what is seen and refused on the way."""
    model, yarns, window = mixed.model, mixed.yarns, mixed.window
    motion = load_path(scene, knit)
    ends = grips(mixed.network, knit, scene.load.direction)
    prescribed = tension(ends, motion, scene.load.lateral)
    settings = Settings.of(scene.solver)
    if yarns.touching is not None:
        # Where contact begins, a parabola through what came before overshoots far into the other yarn.
        settings = replace(settings, predictor=1)
    count = len(knit.crossings.row)
    observer = WindowObserver(mixed, count)
    shown = np.zeros(count, dtype=np.int8)
    shown[window.shown] = 1
    tied = np.zeros(count, dtype=np.int8)
    tied[window.crossing] = np.isfinite(yarns.tie.area)
    return Problem(
        scene=scene,
        model=model,
        prescribed=replace(prescribed, fixed=model.first_beam + prescribed.fixed),
        solver=LU(),
        settings=settings,
        motion=motion,
        driven=model.first_beam + 6 * ends.driven[:, None] + np.arange(3),
        stations=mixed.stations,
        observers=(observer,),
        checks=(partial(require_sound, scene, None), partial(require_no_jump, scene)),
        constants={
            "window_crossing": shown,
            "crossing_tied": tied,
            "tied_area": observer.of_all(yarns.tie.area),
            "tied_centroid": observer.of_all(yarns.tie.centroid),
            "seam_yarn": np.repeat(window.yarn, 2),
            "seam_arc_length": window.arc.ravel(),
        },
        attributes={
            "dof": model.size,
            "solid_unknowns": yarns.model.size,
            "elements": sum(len(group.connectivity) for group in yarns.model.groups)
            + len(mixed.network.ends),
            **yarns.tie.attributes(),
            **(yarns.touching.attributes() if yarns.touching else {}),
        },
        meter=meter or Meter(),
    )
