"""Direct numerical simulation: a specimen of solid yarns under load (sections 2.2 and 2.3 of the paper)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from knitstudy.gates.increment import require_sound
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.specimen import read_specimen
from knitstudy.loading.cost import Meter
from knitstudy.loading.follow import follow
from knitstudy.loading.history import Stations
from knitstudy.loading.load_path import Motion, load_path
from knitstudy.loading.problem import Problem
from knitstudy.loading.run import IN_MEMORY, Run
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear.in_turn import InTurn
from knitstudy.mechanics.linear.krylov import Krylov
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.linear.multigrid import AlgebraicMultigrid
from knitstudy.mechanics.linear.solver import LinearSolver
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.linear.three_scale import ThreeScale
from knitstudy.mechanics.solid import SolidState
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.observation import SolidObserver
from knitstudy.solids.solid_yarns import SolidYarns, assemble
from knitstudy.study.scene import Scene

DIRECT_UNKNOWNS = 20_000
"""Up to here sparse LU serves where iterations fail; beyond, its time and memory are too much (docs/performance.md)."""


def simulate(scene: Scene, geometry: xr.Dataset, mesh: xr.Dataset, run: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene of fidelity "dns".

    Parameters
    ----------
    scene : Scene
    geometry, mesh : Dataset
        Of the scene, in the formats of docs/architecture.md.
    run : Run

    Raises
    ------
    MeshError
        As `problem`.
    ConvergenceError, DataFileError
        As `knitstudy.loading.follow.follow`.
    """
    return follow(problem(scene, SweptMesh.from_dataset(mesh), read_specimen(geometry)), run)


def run(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair, how: Run = IN_MEMORY) -> xr.Dataset:
    """Return the history of a scene: `problem`, followed; see `simulate`."""
    return follow(problem(scene, mesh, specimen), how)


def problem(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> Problem:
    """Return a scene of fidelity "dns" as a problem.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded after
        the tied nodes were moved, a crossing cannot be tied, or yarns overlap.
    """
    meter = Meter()
    return problem_of(assemble(scene, mesh, specimen), scene, specimen, meter)


def problem_of(
    yarns: SolidYarns, scene: Scene, specimen: Knit | YarnPair, meter: Meter | None = None
) -> Problem:
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
        position=tie.nodes[kept],
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
    solver = Krylov(AlgebraicMultigrid(layout) if name == "amg" else ThreeScale(layout), truncates=not small)
    return InTurn(solver) if small else solver
