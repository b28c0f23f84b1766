"""Bending of a cell of beams in contact: moments per width against curvature, there and back, in both directions.

The cell starts from its shape at rest, flat, with the friction that holds it there; where friction holds nothing, yarns
that touch stick. It is bent as a cylinder: nothing pulls in the plane, the axis stays straight, and nothing twists.
Curvatures and widths refer to the flat cell. The path is that of the KES-FB2 tester (Kawabata 1980).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.errors import ConvergenceError
from knitstudy.knit.geometry.columns import BENDING
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.loading.run import IN_MEMORY, Run
from knitstudy.knit.loading.solve import settings_of
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.models.beam.cell import HELD, BeamCell, build
from knitstudy.knit.models.beam.contact import STRIDE, contact_of
from knitstudy.mechanics.beams.line_contact import MARGIN, NEAR
from knitstudy.mechanics.cells.bent import BentBeams, BentPatch
from knitstudy.mechanics.core.increment import PrescribedDisplacement
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace

CURVATURE = 250.0  # at the turns of the path [1/m]
TURNS = np.array([1.0, -1.0, 0.0])  # corners of the path, over that
AHEAD = np.array([0.6])  # of a load that does not turn: the slope of KES-FB2 ends there
STEPS = 5  # increments from one corner to the next, of that curvature each

NAMES = ("curvature", "moment_per_width", "friction_per_area")


def bend(
    scene: CellOfBeams, geometry: xr.Dataset, rest: xr.Dataset | None = None, run: Run = IN_MEMORY
) -> xr.Dataset:
    """Return moments per width, dissipated energy and stiffness at first bending; a path that ends early has nan.

    Errors as of `cell.build`; ConvergenceError if the tangent of the flat cell is singular.
    """
    cell = build(scene, fabric_of(geometry), rest).observer
    assert isinstance(cell, BeamCell)
    settings = settings_of(scene.solver, touches=True, stride=STRIDE * scene.yarn.diameter)
    corners = TURNS if scene.load.turns else AHEAD
    way = np.cumsum(np.abs(np.diff(corners, prepend=0.0)))
    count = round(way[-1] * STEPS)
    curves = np.full((2, 3, count + 1), np.nan)
    first = []
    ended, unstable = list[str](), list[str]()
    for along, name in enumerate(("course", "wale")):
        model = bent(scene, cell, along)
        first.append(model.bending_stiffness(model.start(), HELD))
        size, width = model.per_curvature
        turns = np.zeros((len(corners), len(HELD) + 1))
        turns[:, -1] = CURVATURE * corners * size
        path = PrescribedDisplacement(np.append(HELD, model.size - 1), turns, tuple((way / way[-1]).tolist()))
        stops = np.linspace(0, 1, count + 1)
        lost = []  # load factors of unstable increments
        path = replace(path, stops=tuple(stops[1:].tolist()))
        try:
            for now in trace(model, path, replace(settings, increments=count), LU()):
                run.progress(0.5 * (along + now.load), name)
                lost += [now.load] if now.negative_eigenvalues else []
                at = np.flatnonzero(np.isclose(stops, now.load))
                energy = now.response.energy["friction"] / (size * width)
                curves[along, :, at] = now.state.lattice[3] / size, now.response.force[-1] / width, energy
        except ConvergenceError as error:
            ended.append(f"{name}: {error}")
        if lost:
            unstable.append(f"{name}, by {path.at(lost[0])[-1] / size:.3g} 1/m")
    values = dict(zip(NAMES, curves.swapaxes(0, 1), strict=True)) | {
        "first_bending_stiffness": np.array(first)
    }
    bending = xr.Dataset(BENDING.variables(values)).assign_attrs(ended="; ".join(ended))
    return bending.assign_attrs(unstable="; ".join(unstable)) if unstable else bending


def bent(scene: CellOfBeams, cell: BeamCell, along: int) -> BentBeams:
    """Return the flat cell, whose lattice vector `along` is to be bent."""
    rows, flat = cell.rows, cell.model
    state = flat.start()
    stations = rows.stations
    patch = BentPatch.around(
        stations.yarn,
        stations.arc_length,
        rows.period,
        state.beams.position,
        flat.vectors(state),
        (1 + MARGIN) * NEAR * scene.yarn.diameter,
    )
    return BentBeams(flat, state, *contact_of(scene).along(patch.yarn, patch.arc_length), patch, along)
