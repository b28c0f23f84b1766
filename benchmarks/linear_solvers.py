"""Linear solvers on the tangents of the tied knit at no strain and at full strain, with the residual of a pull."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp
from knits import load
from measure import ready

from knitstudy.mechanics.batches import serial_blas
from knitstudy.mechanics.model import DirichletElimination
from knitstudy.mechanics.newton import trace
from knitstudy.models.simulate import build
from knitstudy.study.configuration import load_scene

TOLERANCE = 1e-8


def write_tangents(scene: str, folder: str) -> dict:
    """Write the pinned tangent and the residual of the next increment, at no strain and at full strain."""
    wanted = load_scene(scene)
    knit, mesh = load(folder)
    problem = build(wanted, knit, mesh=mesh)
    with serial_blas():
        for increment in trace(problem.model, problem.prescribed, problem.settings, problem.solver):
            if increment.load in (0.0, 1.0):
                _write(
                    problem, increment.state, Path(folder) / f"{'start' if increment.load == 0 else 'end'}"
                )
    return {}


def _write(problem, state, path: Path) -> None:
    prescribed, model = problem.prescribed, problem.model
    response = model.respond(state, stiffness=True)
    pull = np.zeros(model.size)
    pull[prescribed.fixed] = prescribed.value / problem.settings.increments
    rhs = -(response.force + response.stiffness @ pull)
    rhs[prescribed.fixed] = 0
    DirichletElimination(response.stiffness, prescribed.fixed).apply(response.stiffness)
    path.mkdir()
    for name in ("data", "indices", "indptr"):
        np.save(path / f"{name}.npy", getattr(response.stiffness, name))
    np.save(path / "rhs.npy", rhs)


def solve(scene: str, folder: str, state: str, solver: str) -> dict:
    """Solve one of the systems to `TOLERANCE` with a solver of the scene's choice, set-up included."""
    knit, mesh = load(folder)
    problem = build(load_scene(scene).replace("solver.linear", solver), knit, mesh=mesh)
    place = Path(folder) / state
    data, indices, indptr, rhs = (
        np.load(place / f"{name}.npy") for name in ("data", "indices", "indptr", "rhs")
    )
    matrix = sp.bsr_matrix((data, indices, indptr), shape=(len(rhs), len(rhs)))
    ready()
    with serial_blas():
        problem.solver.use(matrix)
        solution = problem.solver.solve(rhs, TOLERANCE)
    residual = np.linalg.norm(rhs - matrix @ solution.x) / np.linalg.norm(rhs)
    return {
        "dof": mesh.nodes.size,
        "krylov_iterations": solution.iterations,
        "setup_s": problem.solver.setup_seconds,
        "residual": float(residual),
    }
