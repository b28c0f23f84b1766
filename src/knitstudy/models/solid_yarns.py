"""Solid yarns: the direct numerical simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from knitstudy.contacts.facets import CrossingFacets, tied_crossings, tied_pieces
from knitstudy.contacts.kinematics import section_motion
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Meter, Stations
from knitstudy.loading.load_path import Motion, load_path
from knitstudy.loading.restart import IN_MEMORY, Run
from knitstudy.loading.solve import Problem, solve_load_path
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LinearSolver
from knitstudy.mechanics.linear.direct import LU
from knitstudy.mechanics.linear.krylov import Krylov
from knitstudy.mechanics.linear.three_scale import AlgebraicMultigrid, KnitStructure, ThreeScale
from knitstudy.mechanics.model import Stabilisation, transformation
from knitstudy.mechanics.solid import SolidModel, SolidState
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.discretisation import Discretisation, discretised
from knitstudy.models.ties import Ties, tie_of
from knitstudy.study.scene import Scene

if TYPE_CHECKING:
    from knitstudy.models.yarn_contact import Touching


# ---- What a direct simulation leaves of every converged increment: forces at crossings and on yarns, points in contact


class SolidObserver:
    """Sees the motion of centrelines and sections, and the forces of ties and contact.

    Parameters
    ----------
    yarns : SolidYarns
    """

    def __init__(self, yarns: SolidYarns) -> None:
        self.yarns = yarns

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history, and of the points in contact."""
        yarns, state = self.yarns, increment.state
        mesh, tie, facets = yarns.parts.mesh, yarns.tie, yarns.facets
        moved = yarns.model.node_displacement(state)
        displacement = yarns.parts.sampled(moved)
        force = tie.resultants(moved)
        contact, points = {}, {}
        if yarns.touching is not None:
            contact, points, pushed = yarns.touching.record(increment, len(force))
            force += pushed
        stations = mesh.ring_means(displacement)
        resultant, moment = yarn_resultants(yarns, increment.response.node_force, moved, stations)
        sections = section_motion(
            facets.crossings, mesh, yarns.parts.sampled(yarns.parts.nodes), displacement
        )
        columns = {
            "centreline_displacement": stations,
            "crossing_force": force,
            "crossing_displacement": facets.displacement(displacement),
            "section_gradient": sections.gradient,
            "section_displacement": sections.displacement,
            "yarn_force": resultant,
            "yarn_moment": moment,
        }
        return columns | contact, points


def yarn_resultants(
    yarns: SolidYarns, node_force: np.ndarray, displacement: np.ndarray, stations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return net force (Y, 3) [N] and moment (Y, 3) [N m] of all interactions on every yarn (Fig. 10a).

    What the elements of a free node resist is what the interactions supply; grips are left out. Moments are about
    the mean of the yarn's stations.

    Parameters
    ----------
    yarns : SolidYarns
    node_force : ndarray, shape (N, 3)
        Internal forces of the elements [N].
    displacement : ndarray, shape (N, 3)
        Of the nodes [m].
    stations : ndarray, shape (S, 3)
        Displacement of the slices' centres [m].
    """
    mesh, ends, unity = yarns.parts.mesh, yarns.parts.ends, yarns.parts.unity
    force = node_force.copy()
    force[np.concatenate([ends.held, ends.driven])] = 0
    position = yarns.parts.nodes + displacement
    resultant, moment = np.zeros((2, mesh.yarns, 3))
    for yarn in range(mesh.yarns):
        here, slices = yarns.parts.nodes_of(yarn), mesh.yarn_of_slice == yarn
        centre = (mesh.centres + stations)[slices].mean(axis=0)
        resultant[yarn] = unity[here] @ force[here]
        moment[yarn] = np.cross(position[here] - unity[here, None] * centre, force[here]).sum(axis=0)
    return resultant, moment


# ---- Solid yarns of a scene, put together: what they are divided into, ties, contact, and what holds and drives them


@dataclass(frozen=True, eq=False)
class SolidYarns:
    """A specimen of solid yarns.

    Attributes
    ----------
    parts : Discretisation
        What they are divided into.
    model : SolidModel
    tie : Ties
    facets : CrossingFacets
    retained : ndarray of int, shape (n,)
        Nodes that depend on no others, ascending.
    touching : Touching or None
        What contact adds.
    """

    parts: Discretisation
    model: SolidModel
    tie: Ties
    facets: CrossingFacets
    retained: np.ndarray
    touching: Touching | None = None

    @cached_property
    def unknown(self) -> np.ndarray:
        """Position of every node (N,) among those retained, -1 where it depends on others."""
        position = np.full(len(self.parts.nodes), -1)
        position[self.retained] = np.arange(len(self.retained))
        return position


def assemble_yarns(scene: Scene, mesh: SweptMesh, specimen: Fabric) -> SolidYarns:
    """Return the solid yarns of a scene.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded, a
        crossing cannot be tied, or yarns overlap.
    """
    parts = discretised(scene, mesh, specimen)
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_of(scene, parts, specimen)
    facets = CrossingFacets.of(specimen.crossings, parts.mesh)
    groups = parts.groups(parts.nodes)
    volume = parts.volume(groups)
    spread, retained = _transformation(parts)
    stabilisation = None
    if scene.solver.stabilisation > 0:
        kept = volume if spread is None else spread.T @ volume
        modulus = scene.yarn.youngs_modulus
        stabilisation = Stabilisation.of(scene.solver.stabilisation, modulus, parts.size, kept)
    solids = (parts.nodes, groups, parts.size, spread, stabilisation, tie.links)
    interaction = scene.kind.interaction
    if not interaction.touches:
        return SolidYarns(parts, SolidModel(*solids), tie, facets, retained)
    pieces = tied_pieces(parts.rings.arc_length, specimen.crossings, tied)
    contact = import_module(interaction.solids)
    touching = contact.touching(scene, parts, tie, pieces, facets, volume, solids)
    return SolidYarns(parts, touching.model, tie, facets, retained, touching)


def _transformation(parts: Discretisation) -> tuple[sp.csr_matrix | None, np.ndarray]:
    """Return T (N, n), None for the identity, and the nodes (n,) that it starts from."""
    if parts.dependence is None:
        return None, np.arange(len(parts.nodes))
    return transformation(parts.dependence)


# ---- Direct numerical simulation: a specimen of solid yarns under load (sections 2.2 and 2.3 of the paper)


DIRECT_UNKNOWNS = 20_000
"""Largest size for sparse LU where iterations fail; its time and memory grow fast (docs/notes/performance.md)."""


def simulate(scene: Scene, geometry: xr.Dataset, mesh: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene of solid yarns.

    Parameters
    ----------
    scene : Scene
    geometry, mesh : Dataset
        Of the scene, in the formats of docs/files.md.
    run : Run

    Raises
    ------
    MeshError
        As `problem`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.solve.solve_load_path`.
    """
    return solve_load_path(problem(scene, SweptMesh.from_dataset(mesh), Fabric.from_dataset(geometry)), run)


def run(scene: Scene, mesh: SweptMesh, specimen: Fabric, how: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene: `problem`, followed; see `simulate`."""
    return solve_load_path(problem(scene, mesh, specimen), how)


def problem(scene: Scene, mesh: SweptMesh, specimen: Fabric) -> Problem:
    """Return a scene of solid yarns as a problem.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded, a
        crossing cannot be tied, or yarns overlap.
    """
    meter = Meter()
    return problem_of(assemble_yarns(scene, mesh, specimen), scene, specimen, meter)


def problem_of(yarns: SolidYarns, scene: Scene, specimen: Fabric, meter: Meter | None = None) -> Problem:
    """Return solid yarns with the load of a scene, and with what is seen and refused on the way."""
    mesh, model, tie, touching = yarns.parts.mesh, yarns.model, yarns.tie, yarns.touching
    motion = load_path(scene, specimen)
    prescribed, driven = _prescribed(yarns, scene, motion)
    settings = Settings.of(scene.solver)
    if touching is not None:
        # Where contact begins, a parabola through what came before overshoots far into the other yarn; and no
        # correction leads farther than contact looks around.
        settings = replace(settings, predictor=1, stride=touching.model.contact.margin)
    return Problem(
        scene=scene,
        model=model,
        prescribed=prescribed,
        solver=linear_solver(scene.solver.linear, yarns, prescribed),
        settings=settings,
        motion=motion,
        driven=driven,
        stations=Stations(mesh.yarn_of_slice, mesh.arc_length, mesh.centres),
        observers=(SolidObserver(yarns),),
        checks=(
            partial(require_sound, scene, model.loaded),
            *([touching.require_apart] if touching and touching.beside else []),
        ),
        constants={
            "crossing_tied": np.isfinite(tie.area).astype(np.int8),
            "tied_area": tie.area,
            "tied_centroid": tie.centroid,
        },
        fields=partial(_fields, yarns) if "fields" in scene.outputs else None,
        attributes={
            "dof": yarns.parts.nodes.size,
            "elements": sum(len(group.connectivity) for group in model.groups),
            **tie.attributes(),
            **(touching.attributes() if touching else {}),
        },
        meter=meter or Meter(),
    )


def _fields(yarns: SolidYarns, state: SolidState) -> dict[str, np.ndarray]:
    """Return the fields of a state."""
    return {"node_displacement": yarns.model.node_displacement(state)}


def _prescribed(yarns: SolidYarns, scene: Scene, motion: Motion) -> tuple[PrescribedDisplacement, np.ndarray]:
    """Return prescribed unknowns, and those of the driven nodes (k, 3) whose forces add up to the reaction."""
    ends, unity = yarns.parts.ends, yarns.parts.unity
    held, driven = (3 * yarns.unknown[nodes][:, None] + np.arange(3) for nodes in (ends.held, ends.driven))
    components = driven if scene.load.lateral == "fixed" else driven[:, [motion.axis]]
    count = components.shape[1]
    moved = motion.displacement if count == 3 else motion.displacement[:, [motion.axis]]
    fixed = np.concatenate([held.ravel(), components.ravel()])
    value = np.zeros((len(moved), len(fixed)))
    value[:, held.size :] = (unity[ends.driven][:, None] * moved[:, None]).reshape(len(moved), -1)
    return PrescribedDisplacement(fixed, value, motion.corners, motion.stops), driven[unity[ends.driven] == 1]


def structure(yarns: SolidYarns, prescribed: PrescribedDisplacement) -> KnitStructure:
    """Return where the unknowns lie; a patch reaches one element around nodes that are joined or touch.

    Where nodes are coefficients there are no patches: each has a share in whole sections and several spans, so that
    they would take in most of the yarns, and the yarns' factors know what is stiff at a crossing.
    """
    parts, tie, kept = yarns.parts, yarns.tie, yarns.retained
    patches = bool(np.all(parts.unity == 1))
    inside = np.zeros(len(kept), dtype=bool)
    if patches:
        joined = yarns.unknown[tie.joined]
        inside[joined[joined >= 0]] = True
        inside = yarns.model.assembly.connection() @ inside > 0
    return KnitStructure(
        position=parts.nodes[kept],
        unity=parts.unity[kept],
        yarn=parts.yarn[kept],
        station=parts.station[kept],
        bandwidth=parts.bandwidth,
        patch=np.flatnonzero(inside) if patches else None,
        fixed=prescribed.fixed,
    )


def linear_solver(name: str, yarns: SolidYarns, prescribed: PrescribedDisplacement) -> LinearSolver:
    """Return the linear solver of a scene; `auto` takes three scales, and LU where they fail in a small model."""
    if name == "lu":
        return LU()
    layout = structure(yarns, prescribed)
    small = name == "auto" and yarns.model.size <= DIRECT_UNKNOWNS
    preconditioner = AlgebraicMultigrid(layout) if name == "amg" else ThreeScale(layout)
    return Krylov(preconditioner, truncates=not small, direct=LU() if small else None)
