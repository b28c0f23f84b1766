"""A cell of an endless knit: forces per width and stiffness without grips and edges (docs/theory.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from knitstudy.contacts.facets import CrossingFacets, tied_crossings
from knitstudy.geometry.fabric import Fabric, fabric_of
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Meter, Stations
from knitstudy.loading.load_path import Motion
from knitstudy.loading.restart import IN_MEMORY, Run
from knitstudy.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.periodic import PeriodicModel, condensed
from knitstudy.mechanics.solid import SolidModel
from knitstudy.models.periodic_yarns import HELD, PeriodicYarns, periodic_yarns
from knitstudy.models.ties import Ties, tie_patches
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.models.yarn_contact import Touching


FIXED = (3 * HELD[:, None] + np.arange(3)).ravel()
"""Unknowns of the nodes that are held: the first that repeats itself is the first of all."""

PRESCRIBED = {"course": (1, 0, 0), "wale": (0, 1, 0), "biaxial": (1, 1, 0), "shear": (0, 0, 1)}
"""Which strains a deformation prescribes, by ``load.deformation``."""


@dataclass(frozen=True, eq=False)
class Cell:
    """A cell put together.

    Attributes
    ----------
    yarns : PeriodicYarns
    model : PeriodicModel
    tie : Ties
    touching : Touching or None
        What contact adds.
    """

    yarns: PeriodicYarns
    model: PeriodicModel
    tie: Ties
    touching: Touching | None = None

    def resultants(self, force: np.ndarray) -> np.ndarray:
        """Return the forces per width (3,) that forces of the unknowns (size,) stand for [N/m]."""
        lattice = self.yarns.lattice
        return force[self.model.lattice] * lattice.lengths / lattice.area

    def strains(self, state: Any) -> np.ndarray:
        """Return the strains (3,) in the plane of a state."""
        return self.model.stretched(state.displacement.ravel()) / self.yarns.lattice.lengths

    def stiffness(self) -> np.ndarray:
        """Return the stiffness (6, 6) of a tied knit at rest as a shell, by the strains of `mechanics.periodic`.

        In N/m where two strains meet, in N where a strain meets a curvature, in N m where two curvatures do.
        """
        solids = self.model.model
        tangent = solids.respond(solids.start(), stiffness=True).stiffness
        return condensed(tangent, self.yarns.jumps, self.yarns.spread, FIXED) / self.yarns.lattice.area

    def tangent(self, state: Any) -> np.ndarray:
        """Return the derivative (3, 3) of the forces per width by the strains in the plane [N/m]."""
        solids = self.model.model
        tangent = solids.respond(replace(state, step=None), stiffness=True).stiffness
        in_plane = self.yarns.jumps[:, :3]
        return condensed(tangent, in_plane, self.yarns.spread, FIXED) / self.yarns.lattice.area


class CellObserver:
    """Sees the strains of a cell, its forces per width and, where it is tied, its tangent."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history."""
        cell, state = self.cell, increment.state
        parts = cell.yarns.parts
        moved = cell.model.model.node_displacement(state)
        force = cell.tie.resultants(moved)
        more, points = {"tangent_per_width": cell.tangent(state)} if cell.touching is None else {}, {}
        if cell.touching is not None:
            more, points, pushed = cell.touching.record(increment, len(force))
            force = force + pushed
        columns = {
            "cell_strain": cell.strains(state),
            "force_per_width": cell.resultants(increment.response.force),
            "centreline_displacement": parts.mesh.ring_means(parts.sampled(moved)),
            "crossing_force": force,
        }
        return columns | more, points


def simulate(scene: Scene, geometry: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene whose specimen is a cell.

    Parameters
    ----------
    scene : Scene
    geometry : Dataset
        Of the scene, in the format of docs/files.md.
    run : Run

    Raises
    ------
    MeshError
        As `knitstudy.models.solid_yarns.problem`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.solve.solve_load_path`.
    """
    return solve_load_path(problem(scene, fabric_of(scene, geometry)), run)


def assemble(scene: Scene, knit: Fabric) -> Cell:
    """Return the cell of a scene, of so many loops and rows.

    Raises
    ------
    MeshError
        If a crossing cannot be tied, or yarns overlap or bend too tightly.
    """
    yarns = periodic_yarns(scene, knit)
    parts, lattice = yarns.parts, yarns.lattice
    tied = tied_crossings(scene, knit.crossings)
    tie = tie_patches(parts, knit, tied, scene.tie.radius, scene.yarn.youngs_modulus)
    # Elements leave out images, which ties and contact reach: an explicit identity makes room for those.
    every = sp.identity(len(parts.nodes), format="csr")
    groups = parts.groups(parts.nodes)
    solids = (parts.nodes, groups, parts.size, every, None, tie.links)
    touching = None
    if scene.kind.interaction.touches:
        # A yarn has the number of its piece: it does not touch itself, which its image would do once more.
        pieces = np.repeat(
            np.arange(len(parts.rings.arc_length)), [len(each) for each in parts.rings.arc_length]
        )
        facets = CrossingFacets.of(knit.crossings, parts.mesh)
        contact = import_module(scene.kind.interaction.solids)
        touching = contact.touching(scene, parts, tie, pieces, facets, parts.volume(groups), solids)
    stretch = sp.csr_matrix(yarns.jumps[:, :3] / lattice.lengths)
    spread = sp.csr_matrix(sp.hstack([yarns.spread, stretch]))
    model = touching.model if touching else SolidModel(*solids)
    return Cell(yarns, PeriodicModel(model, spread), tie, touching)


def problem(scene: Scene, knit: Fabric) -> Problem:
    """Return a scene whose specimen is a cell as a problem.

    The driven side is the lattice: its displacement along x, y and in shear is the strain times the edge of the cell,
    its reaction the force on the edge.

    Raises
    ------
    MeshError
        As `assemble`.
    """
    meter = Meter()
    cell = assemble(scene, knit)
    mesh, model, lattice = cell.yarns.parts.mesh, cell.model, cell.yarns.lattice
    load, solids = scene.load, model.model
    chosen = np.array(PRESCRIBED[load.deformation], dtype=bool)
    way = load.strain * chosen * lattice.lengths
    prescribed = chosen | (load.lateral == "fixed")
    axis = int(np.argmax(chosen))
    stops = tuple(stop / load.strain for stop in load.stops)
    return Problem(
        scene=scene,
        model=model,
        prescribed=PrescribedDisplacement(
            np.concatenate([FIXED, model.lattice[prescribed]]),
            np.concatenate([np.zeros(len(FIXED)), way[prescribed]]),
            stops=stops,
        ),
        solver=LU(),
        # As in knits: where contact begins, a parabola through what came before overshoots.
        settings=replace(Settings.of(scene.solver), **({"predictor": 1} if cell.touching else {})),
        motion=Motion(way[None], (1.0,), stops, axis, float(lattice.lengths[axis])),
        driven=model.lattice[None],
        stations=Stations(mesh.yarn_of_slice, mesh.arc_length, mesh.centres),
        observers=(CellObserver(cell),),
        checks=(partial(require_sound, scene, solids.loaded),),
        constants={
            "crossing_tied": np.isfinite(cell.tie.area).astype(np.int8),
            "tied_area": cell.tie.area,
            "tied_centroid": cell.tie.centroid,
            **({} if cell.touching else _shell(cell.stiffness())),
        },
        attributes={
            "dof": cell.yarns.parts.nodes.size,
            "elements": sum(len(group.connectivity) for group in solids.groups),
            "deformation": load.deformation,
            **cell.tie.attributes(),
            **(cell.touching.attributes() if cell.touching else {}),
        },
        meter=meter,
    )


def _shell(stiffness: np.ndarray) -> dict[str, np.ndarray]:
    """Return the parts of a stiffness (6, 6) by their names in the history."""
    return {
        "membrane_stiffness": stiffness[:3, :3],
        "coupling_stiffness": stiffness[:3, 3:],
        "bending_stiffness": stiffness[3:, 3:],
    }
