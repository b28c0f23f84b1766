"""Direct numerical simulation: a knit of solid yarns in tension (sections 2.2 and 2.3 of the paper)."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.checkpoint import Checkpoint
from knitstudy.contact.tie import Tie, tie_crossings
from knitstudy.cost import Meter
from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.fem.hexahedron import OnePointHexahedron
from knitstudy.fem.incompatible import IncompatibleHexahedron
from knitstudy.fem.increment import Drive, Increment, Settings
from knitstudy.fem.linear.conjugate import ConjugateGradients
from knitstudy.fem.linear.lu import LU
from knitstudy.fem.linear.multigrid import AlgebraicMultigrid
from knitstudy.fem.linear.solver import LinearSolver
from knitstudy.fem.linear.structure import KnitStructure
from knitstudy.fem.linear.three_scale import ThreeScale
from knitstudy.fem.material import Material
from knitstudy.fem.newton import trace
from knitstudy.fem.parallel import serial_blas
from knitstudy.fem.solid import SolidModel, SolidState
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Recorder, Stations
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.scene import Scene

log = logging.getLogger(__name__)

DIRECT_UNKNOWNS = 20_000
"""Up to here a sparse LU is the fastest solver; beyond, its fill is not (see `make bench`)."""

HOURGLASS_SHARE = 0.05
"""Largest share of hourglass energy in the internal energy: beyond it the stabilisation carries load."""

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
    drive : Drive
    settings : Settings
    solver : LinearSolver
    recorder : Recorder
    """

    scene: Scene
    mesh: SweptMesh
    model: SolidModel
    tie: Tie
    drive: Drive
    settings: Settings
    solver: LinearSolver
    recorder: Recorder


def assemble(scene: Scene, mesh: SweptMesh, knit: Knit) -> Simulation:
    """Set up model, ties, boundary conditions, solver and record of a scene.

    Raises
    ------
    MeshError
        If an element is folded after the tied nodes were moved, or a crossing cannot be tied.
    """
    meter = Meter()
    tie = tie_crossings(mesh, knit, scene.tie.tolerance)
    yarn = scene.yarn
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    corners = tie.nodes[mesh.hexahedra]
    if scene.mesh.element == "one_point":
        elements = OnePointHexahedron(corners, material, scene.solver.hourglass)
    else:
        elements = IncompatibleHexahedron(corners, material)
    model = SolidModel(tie.nodes, mesh.hexahedra, elements, scene.mesh.size, tie.dependence())
    drive, driven = _drive(scene, mesh, tie, knit)
    stations = Stations(mesh.yarn_of_slice, mesh.arc_length, mesh.centres)
    travel = scene.load.strain * knit.width
    recorder = Recorder(stations, driven, axis=0, travel=travel, length=knit.width, meter=meter)
    solver = linear_solver(scene.solver.linear, model, mesh, tie, drive)
    settings = Settings.of(scene.solver)
    return Simulation(scene, mesh, model, tie, drive, settings, solver, recorder)


def run(
    scene: Scene,
    mesh: SweptMesh,
    knit: Knit,
    *,
    checkpoint: Path | None = None,
    progress: Watcher | None = None,
) -> xr.Dataset:
    """Pull a solid knit to the strain of its scene.

    Parameters
    ----------
    scene, mesh, knit
        What to simulate; mesh and knit are those of the scene.
    checkpoint : Path, optional
        Restart file, rewritten at every increment and removed at the end. If it exists, the run goes on from it.
    progress : callable, optional
        Called with every converged increment.

    Returns
    -------
    Dataset
        History in the format of docs/architecture.md, with the ties' forces and areas.

    Raises
    ------
    ConvergenceError
        If the load cannot be reached, or the hourglass control carries load; the restart file keeps what had
        converged.
    """
    simulation = assemble(scene, mesh, knit)
    recorder = simulation.recorder
    restart = Checkpoint(checkpoint, scene.hash, SolidState) if checkpoint else None
    resume = restart.load(recorder) if restart else None
    if resume is not None:
        log.info("going on from increment %d at load factor %.4g (%s)", resume.index, resume.load, checkpoint)
    last = resume
    with serial_blas():
        for last in trace(simulation.model, simulation.drive, simulation.settings, simulation.solver, resume):
            record(simulation, last)
            if restart:
                restart.save(last, recorder)
            require_small_hourglass(last, scene.solver.hourglass)
            if progress:
                progress(last)
    dataset = _dataset(simulation, last.state)
    if restart:
        restart.remove()
    return dataset


def require_small_hourglass(increment: Increment, coefficient: float) -> None:
    """Refuse a state in which hourglass control carries load.

    In the first tenth of the load, with a hundredth of the energy, rounding and slack may prevail.

    Raises
    ------
    ConvergenceError
        If hourglass energy exceeds `HOURGLASS_SHARE` of the internal energy.
    """
    energy = increment.response.energy
    if increment.load >= 0.1 and energy["hourglass"] > HOURGLASS_SHARE * energy["internal"]:
        raise ConvergenceError(
            f"increment {increment.index}: hourglass energy is {energy['hourglass'] / energy['internal']:.1%} of the "
            f"internal energy and may be {HOURGLASS_SHARE:.0%}: the mesh is too coarse for solver.hourglass = "
            f"{coefficient:g}; use a smaller mesh.size, or the usual 0.005"
        )


def _drive(scene: Scene, mesh: SweptMesh, tie: Tie, knit: Knit) -> tuple[Drive, np.ndarray]:
    """Return prescribed unknowns, and those of the driven nodes (k, 3): left ends held, right ends pulled in x."""
    if scene.load.direction != "course":
        raise ConfigurationError(f"load.direction is {scene.load.direction!r}; a DNS knows 'course'")
    held, driven = (
        3 * tie.unknown[mesh.end_nodes(side)][:, None] + np.arange(3) for side in ("left", "right")
    )
    travel = scene.load.strain * knit.width
    components = driven if scene.load.lateral == "fixed" else driven[:, :1]
    fixed = np.concatenate([held.ravel(), components.ravel()])
    value = np.concatenate(
        [np.zeros(held.size), np.tile([travel, 0.0, 0.0][: components.shape[1]], len(driven))]
    )
    return Drive(fixed, value), driven


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
    return ConjugateGradients(preconditioner)


def record(simulation: Simulation, increment: Increment) -> None:
    """Add a converged increment to the history: centreline motion, and what the ties carry."""
    model, mesh, tie, recorder = simulation.model, simulation.mesh, simulation.tie, simulation.recorder
    displacement = model.node_displacement(increment.state)
    rings = mesh.slice_nodes(np.arange(mesh.slices))[:, mesh.section.ring]
    recorder.add(
        increment,
        displacement[rings].mean(axis=1),
        crossing_force=tie.resultants(increment.response.node_force),
        crossing_displacement=tie.mean_displacement(displacement),
    )
    log.info(
        "increment %d: strain %.4f, force %.6g N, %d Newton and %d Krylov iterations, residual %.1e",
        increment.index,
        recorder.columns["strain"][-1],
        recorder.columns["force"][-1],
        increment.newton_iterations,
        increment.krylov_iterations,
        increment.residual,
    )


def _dataset(simulation: Simulation, state: SolidState) -> xr.Dataset:
    scene, mesh, model, tie = simulation.scene, simulation.mesh, simulation.model, simulation.tie
    dataset = simulation.recorder.to_dataset(
        scene=scene.name,
        scene_hash=scene.hash,
        fidelity=scene.fidelity,
        interaction=scene.interaction,
        dof=mesh.nodes.size,
        unknowns=model.size - len(simulation.drive.fixed),
        elements=len(mesh.hexahedra),
        linear_solver=type(getattr(simulation.solver, "preconditioner", simulation.solver)).__name__,
        linear_setups=getattr(simulation.solver, "setups", 0),
        tie_tolerance=tie.tolerance,
        tie_nodes=len(tie.slave),
        tie_largest_adjustment=float(tie.adjustment.max()),
    )
    dataset["tied_area"] = ("crossing", tie.area, {"units": "m2", "long_name": "tied area"})
    dataset["tied_centroid"] = (
        ("crossing", "xyz"),
        tie.centroid,
        {"units": "m", "long_name": "its centroid"},
    )
    if "fields" in scene.outputs:
        field = model.node_displacement(state)
        dataset["node_displacement"] = (("node", "xyz"), field, {"units": "m", "long_name": "displacement"})
    return dataset
