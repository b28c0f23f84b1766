"""Direct numerical simulation: a knit of solid yarns in tension (sections 2.2 and 2.3 of the paper)."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.checkpoint import Checkpoint
from knitstudy.cost import Meter
from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.tied_crossings import tied_crossings, tied_pieces
from knitstudy.errors import ConvergenceError
from knitstudy.files.netcdf import write_dataset
from knitstudy.gates.increment import require_sound
from knitstudy.gates.resolution import ELEMENTS_ACROSS, require_elements_across
from knitstudy.geometry.pair import Pair
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Recorder, Stations
from knitstudy.load_path import Motion, load_path
from knitstudy.mechanics.hexahedron import OnePointHexahedron
from knitstudy.mechanics.incompatible import IncompatibleHexahedron
from knitstudy.mechanics.increment import Drive, Increment, Settings
from knitstudy.mechanics.linear.krylov import Krylov
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.linear.multigrid import AlgebraicMultigrid
from knitstudy.mechanics.linear.solver import LinearSolver
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.linear.three_scale import ThreeScale
from knitstudy.mechanics.material import Material
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.parallel import serial_blas
from knitstudy.mechanics.solid import Penetration, SolidModel, SolidState
from knitstudy.mechanics.stabilisation import Stabilisation
from knitstudy.mesh.grips import Grips, grips
from knitstudy.mesh.memory import require_memory_to_simulate
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids import observation
from knitstudy.solids.beside_ties import BesideTies
from knitstudy.solids.free_yarns import free_yarns
from knitstudy.solids.tie import Tie, tie_crossings
from knitstudy.solids.yarn_contact import yarn_contact
from knitstudy.study.scene import Scene

log = logging.getLogger(__name__)

DIRECT_UNKNOWNS = 20_000
"""Up to here a sparse LU is the fastest solver; beyond, its fill is not (see `make bench`)."""

Watcher = Callable[[Increment], None]
"""Called after every converged increment, for progress."""


@dataclass(frozen=True)
class Simulation:
    """All parts of a direct numerical simulation, ready to run.

    Attributes
    ----------
    scene : Scene
    mesh : SweptMesh
    model : SolidModel
    tie : Tie
    facets : CrossingFacets
    beside : BesideTies or None
        Watches tied yarns where others are in contact.
    ends : Grips
    drive : Drive
    settings : Settings
    solver : LinearSolver
    recorder : Recorder
    """

    scene: Scene
    mesh: SweptMesh
    model: SolidModel
    tie: Tie
    facets: CrossingFacets
    beside: BesideTies | None
    ends: Grips
    drive: Drive
    settings: Settings
    solver: LinearSolver
    recorder: Recorder


def assemble(scene: Scene, mesh: SweptMesh, specimen: Knit | Pair) -> Simulation:
    """Set up model, ties, contact, boundary conditions, solver and record of a scene.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded after
        the tied nodes were moved, a crossing cannot be tied, or yarns overlap.
    """
    _require_resolution(scene, mesh)
    meter = Meter()
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied)
    pieces = tied_pieces(mesh, specimen.crossings, tied)
    ends = grips(mesh, scene, specimen)
    model = _model(scene, mesh, tie, pieces, ends)
    motion = load_path(scene, specimen)
    drive, driven = _drive(scene, tie, motion, ends)
    stations = Stations(mesh.yarn_of_slice, mesh.arc_length, mesh.centres)
    recorder = Recorder(stations, driven, motion.axis, motion.at, motion.length, meter=meter)
    solver = linear_solver(scene.solver.linear, model, mesh, tie, drive)
    facets = CrossingFacets.of(specimen.crossings, mesh)
    settings, beside = Settings.of(scene.solver), None
    if model.contact is not None:
        # Where contact begins, a parabola through what came before overshoots far into the other yarn.
        settings = replace(settings, predictor=1)
        beside = BesideTies(scene, mesh, tie, pieces) if tied.any() else None
    return Simulation(scene, mesh, model, tie, facets, beside, ends, drive, settings, solver, recorder)


def _require_resolution(scene: Scene, mesh: SweptMesh) -> None:
    """Refuse meshes that are too coarse for the yarn, or too fine for the memory."""
    fewest = scene.gates.elements_across or ELEMENTS_ACROSS[scene.specimen]
    require_elements_across(scene.yarn.diameter, scene.mesh.size, fewest)
    require_memory_to_simulate(mesh.nodes.size, mesh.section.size + mesh.section.bandwidth, scene.mesh.size)


def _model(scene: Scene, mesh: SweptMesh, tie: Tie, pieces: np.ndarray, ends: Grips) -> SolidModel:
    yarn, size = scene.yarn, scene.mesh.size
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    corners = tie.nodes[mesh.hexahedra]
    if scene.mesh.element == "one_point":
        elements = OnePointHexahedron(corners, material, scene.solver.hourglass)
    else:
        elements = IncompatibleHexahedron(corners, material)
    dependence = tie.dependence() if len(tie.slave) else None
    each = elements.volume.reshape(-1, len(corners)).sum(axis=0)  # of its integration points
    volume = np.bincount(mesh.hexahedra.ravel(), np.repeat(each / 8, 8), len(tie.nodes))
    contact = stabilisation = free = None
    limits = Penetration()
    if scene.kind.interaction.touches:
        contact = yarn_contact(scene, mesh, tie.nodes, pieces)
        limits = Penetration(scene.contact.penetration * size, scene.contact.augmentations)
        free = free_yarns(mesh, tie, ends, volume, yarn.youngs_modulus, size)
    if scene.solver.stabilisation > 0:
        kept = volume if dependence is None else dependence.T @ volume
        stabilisation = Stabilisation.of(scene.solver.stabilisation, yarn.youngs_modulus, size, kept)
    return SolidModel(
        tie.nodes, mesh.hexahedra, elements, size, dependence, contact, limits, stabilisation, free
    )


def run(
    scene: Scene,
    mesh: SweptMesh,
    specimen: Knit | Pair,
    *,
    checkpoint: Path | None = None,
    partial: Path | None = None,
    progress: Watcher | None = None,
) -> xr.Dataset:
    """Load a specimen of solid yarns as its scene says.

    Parameters
    ----------
    scene, mesh, specimen
        What to simulate; mesh and specimen are those of the scene.
    checkpoint : Path, optional
        Restart file, rewritten at every increment and removed at the end. If it exists, the run goes on from it.
    partial : Path, optional
        Where the history of what had converged is written, with the reason as attribute `incomplete`, if full load is
        not reached; removed when it is.
    progress : callable, optional
        Called with every converged increment.

    Returns
    -------
    Dataset
        History in the format of docs/architecture.md, with the ties' forces and areas.

    Raises
    ------
    ConvergenceError
        If the load cannot be reached, yarns penetrate each other or lose contact over an end, or a gate of
        `knitstudy.gates` is not passed; `checkpoint` and `partial` keep what had converged.
    """
    simulation = assemble(scene, mesh, specimen)
    recorder = simulation.recorder
    restart = Checkpoint(checkpoint, scene.hash, SolidState) if checkpoint else None
    resume = restart.load(recorder) if restart else None
    if resume is not None:
        log.info("going on from increment %d at load factor %.4g (%s)", resume.index, resume.load, checkpoint)
    last = resume
    try:
        with serial_blas():
            for last in trace(
                simulation.model, simulation.drive, simulation.settings, simulation.solver, resume
            ):
                observation.record(simulation, last)
                # Before the restart file: a second run must not go on beyond a state that is refused.
                require_sound(scene, recorder, last, simulation.model.loaded(last.response))
                require_apart(simulation, last)
                if restart:
                    restart.save(last, recorder)
                if progress:
                    progress(last)
    except ConvergenceError as error:
        if partial is None or last is None:
            raise
        write_dataset(
            observation.dataset(simulation, last.state).assign_attrs(incomplete=str(error)), partial, scene
        )
        raise ConvergenceError(
            f"{str(error).rstrip('.')}. The history up to load factor {last.load:.4g} is in {partial}"
        ) from None
    dataset = observation.dataset(simulation, last.state)
    if restart:
        restart.remove()
    if partial:
        partial.unlink(missing_ok=True)
    return dataset


def require_apart(simulation: Simulation, increment: Increment) -> None:
    """Refuse a state in which tied yarns go through each other beside the ties; contact sees to all others.

    Raises
    ------
    ConvergenceError
        If the smallest gap is below the penetration that the scene allows.
    """
    if simulation.model.contact is None:
        return
    gap, limit = simulation.recorder.columns["smallest_gap"][-1], simulation.model.penetration.limit
    if gap < -limit:
        raise ConvergenceError(
            f"increment {increment.index}: tied yarns penetrate each other by {-gap:.3g} m beside their ties; "
            f"contact.penetration allows {limit:.3g} m. Use contact.tied_edges 'none', a larger tie.tolerance or a "
            "smaller load.strain"
        )


def _drive(scene: Scene, tie: Tie, motion: Motion, ends: Grips) -> tuple[Drive, np.ndarray]:
    """Return prescribed unknowns, and those of the driven nodes (k, 3)."""
    held, driven = (3 * tie.unknown[nodes][:, None] + np.arange(3) for nodes in (ends.held, ends.driven))
    components = driven if scene.load.lateral == "fixed" else driven[:, [motion.axis]]
    count = components.shape[1]
    moved = motion.displacement if count == 3 else motion.displacement[:, [motion.axis]]
    fixed = np.concatenate([held.ravel(), components.ravel()])
    value = np.zeros((len(moved), len(fixed)))
    value[:, held.size :] = np.tile(moved, len(driven))
    return Drive(fixed, value, motion.corners, motion.stops), driven


def structure(model: SolidModel, mesh: SweptMesh, tie: Tie, drive: Drive, rings: int = 1) -> KnitStructure:
    """Return where the unknowns lie; a patch reaches `rings` elements around the tied nodes."""
    kept = tie.kept
    inside = np.zeros(len(kept), dtype=bool)
    inside[tie.unknown[np.unique(tie.master)]] = True
    pattern = model.assembly.connection()
    for _ in range(rings):
        inside = pattern @ inside > 0
    return KnitStructure(
        position=tie.nodes[kept],
        yarn=mesh.yarn_of_slice[kept // mesh.section.size],
        slice=kept // mesh.section.size,
        bandwidth=mesh.section.size + mesh.section.bandwidth,
        patch=np.flatnonzero(inside),
        fixed=drive.fixed,
    )


def linear_solver(name: str, model: SolidModel, mesh: SweptMesh, tie: Tie, drive: Drive) -> LinearSolver:
    """Return the linear solver of a scene; `auto` takes LU for small models and three scales for large ones."""
    if name == "auto":
        name = "lu" if model.size <= DIRECT_UNKNOWNS else "three_scale"
    if name == "lu":
        return LU()
    layout = structure(model, mesh, tie, drive)
    preconditioner = ThreeScale(layout) if name == "three_scale" else AlgebraicMultigrid(layout)
    return Krylov(preconditioner)
