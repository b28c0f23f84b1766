"""Linear solvers on the tangents of the tied knit at no strain and at full strain, with the residual of a pull."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp
from knits import load
from measure import ready

from knitstudy.mechanics.constraints import Pinning
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.parallel import serial_blas
from knitstudy.solids import dns
from knitstudy.study.configuration import load_scene

TOLERANCE = 1e-8


def write_tangents(scene: str, folder: str) -> dict:
    """Write the pinned tangent and the residual of the next increment, at no strain and at full strain."""
    wanted = load_scene(scene)
    knit, mesh = load(folder)
    simulation = dns.assemble(wanted, mesh, knit)
    with serial_blas():
        for increment in trace(simulation.model, simulation.drive, simulation.settings, simulation.solver):
            if increment.load in (0.0, 1.0):
                _write(
                    simulation, increment.state, Path(folder) / f"{'start' if increment.load == 0 else 'end'}"
                )
    return {}


def _write(simulation, state, path: Path) -> None:
    drive, model = simulation.drive, simulation.model
    response = model.respond(state, stiffness=True)
    pull = np.zeros(model.size)
    pull[drive.fixed] = drive.value / simulation.settings.increments
    rhs = -(response.force + response.stiffness @ pull)
    rhs[drive.fixed] = 0
    Pinning(response.stiffness, drive.fixed).apply(response.stiffness)
    path.mkdir()
    for name in ("data", "indices", "indptr"):
        np.save(path / f"{name}.npy", getattr(response.stiffness, name))
    np.save(path / "rhs.npy", rhs)


def solve(scene: str, folder: str, state: str, solver: str) -> dict:
    """Solve one of the systems to `TOLERANCE` with a solver of the scene's choice, set-up included."""
    knit, mesh = load(folder)
    simulation = dns.assemble(load_scene(scene).replace("solver.linear", solver), mesh, knit)
    place = Path(folder) / state
    data, indices, indptr, rhs = (
        np.load(place / f"{name}.npy") for name in ("data", "indices", "indptr", "rhs")
    )
    matrix = sp.bsr_matrix((data, indices, indptr), shape=(len(rhs), len(rhs)))
    ready()
    with serial_blas():
        simulation.solver.use(matrix)
        solution = simulation.solver.solve(rhs, TOLERANCE)
    residual = np.linalg.norm(rhs - matrix @ solution.x) / np.linalg.norm(rhs)
    return {
        "dof": mesh.nodes.size,
        "krylov_iterations": solution.iterations,
        "setup_s": simulation.solver.setup_seconds,
        "residual": float(residual),
    }
