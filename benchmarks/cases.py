"""Functions that benchmarks measure, each in a process of its own; geometry and mesh lie in a scratch folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import calculix
import numpy as np
import scipy.sparse as sp
import xarray as xr
from measure import ready

from knitstudy.datasets import read_dataset, write_dataset
from knitstudy.errors import ConvergenceError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.loading.run import Run
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.simulate import build, simulate
from knitstudy.knit.yarns.solids import linear_solver
from knitstudy.mechanics.core.batches import serial_blas
from knitstudy.mechanics.core.linear import System
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import eliminate
from knitstudy.run.stages import STAGES
from knitstudy.use.decks.deck import specimen_deck
from knitstudy.use.decks.inp import write_inp

TOLERANCE = 1e-8
"""True relative residual of linear solves."""


def prepare(scene: Scene, folder: Path) -> None:
    """Write the geometry of a scene, and the mesh if it has one."""
    geometry = STAGES["geometry"].function(scene)
    write_dataset(geometry, folder / "geometry.nc")
    if STAGES["mesh"].of(scene):
        write_dataset(STAGES["mesh"].function(scene, geometry), folder / "mesh.nc")


def _read(folder: str, name: str) -> xr.Dataset | None:
    path = Path(folder) / f"{name}.nc"
    return read_dataset(path) if path.exists() else None


def _load(scene: Scene, folder: str) -> tuple[Fabric, SweptMesh]:
    """Read fabric and mesh."""
    return fabric_of(_read(folder, "geometry")), SweptMesh.from_dataset(_read(folder, "mesh"))


def run_solid(scene: dict, folder: str) -> dict:
    """Run solid yarns on the geometry and the mesh in a folder; their contacts stay there."""
    wanted = Scene.from_dict(scene)
    geometry = _read(folder, "geometry")
    mesh = _read(folder, "mesh")
    ready()
    history = simulate(wanted, geometry, mesh=mesh)
    contacts = STAGES["contacts"].function(wanted, geometry=geometry, history=history)
    write_dataset(contacts, Path(folder) / "contacts.nc")
    return cost(history)


def run_reduced(scene: dict, folder: str) -> dict:
    """Run a reduced model with the contacts in a folder, if any."""
    geometry, contacts = _read(folder, "geometry"), _read(folder, "contacts")
    return cost(simulate(Scene.from_dict(scene), geometry, contacts=contacts))


def run_whole(scene: dict, restart: str) -> dict:
    """Lay out and run a large scene; a run that was interrupted goes on from its restart file."""
    wanted = Scene.from_dict(scene)
    resumed = Path(restart).exists()
    ready()
    geometry = STAGES["geometry"].function(wanted)
    mesh = STAGES["mesh"].function(wanted, geometry) if STAGES["mesh"].of(wanted) else None
    run = Run(restart=Path(restart))
    history = simulate(wanted, geometry, mesh=mesh, run=run)
    run.forget()
    return cost(history) | {"resumed": resumed, "increments_s": float(history["seconds"].sum())}


def cost(history: xr.Dataset) -> dict:
    """Return force and cost of a history; `path_s` excludes reading and writing."""
    newton, krylov = (int(history[f"{name}_iterations"].sum()) for name in ("newton", "krylov"))
    phases = history["seconds"].sum("increment") / max(newton, 1)
    return {
        "dof": int(history.attrs["dof"]),
        "path_s": float(history.attrs["wall_seconds"]),
        "increments": history.sizes["increment"] - 1,
        "newton_iterations": newton,
        "krylov_iterations": krylov,
        "krylov_per_newton": krylov / max(newton, 1),
        "force_N": float(history["force"][-1]),
        **{f"{phase}_s_per_newton": float(phases.sel(phase=phase)) for phase in phases["phase"].to_numpy()},
    }


def run_calculix(scene: Scene, folder: Path, threads: int) -> dict:
    """Run CalculiX, which measures itself, on the geometry and the mesh in a folder."""
    fabric, mesh = _load(scene, str(folder))
    write_inp(replace(specimen_deck(scene, fabric, mesh), fields=False), folder / "peer.inp", "calculix")
    try:
        run = calculix.run(folder / "peer.inp", threads)
    except ConvergenceError as error:
        return {"dof": mesh.nodes.size, "note": str(error)}
    return {
        "dof": mesh.nodes.size,
        "increments": int((run.step == run.step[-1]).sum()),
        "newton_iterations": int(run.iterations.sum()),
        "force_N": float(run.force[-1, DIRECTIONS.index(scene.load.direction)]),
        "wall_s": run.seconds,
        "memory_growth_MB": run.memory_growth / 1e6,
        "memory_peak_MB": run.memory_peak / 1e6,
        "note": " ".join(run.warnings),
    }


# ---- Linear solvers on the tangents of a tied knit, with the residual of the next increment


def write_tangents(scene: dict, folder: str) -> dict:
    """Write tangent and residual at no strain and at full strain."""
    wanted = Scene.from_dict(scene)
    problem = build(wanted, *_load(wanted, folder))
    with serial_blas():
        for increment in trace(problem.model, problem.prescribed, problem.settings, problem.solver):
            if increment.load in (0.0, 1.0):
                _write_tangent(problem, increment.state, Path(folder) / f"{increment.load:.0f}.npz")
    return {}


def _write_tangent(problem, state, path: Path) -> None:
    prescribed, model = problem.prescribed, problem.model
    response = model.respond(state, stiffness=True)
    pull = np.zeros(model.size)
    pull[prescribed.fixed] = prescribed.value / problem.settings.increments
    rhs = -(response.force + response.stiffness @ pull)
    rhs[prescribed.fixed] = 0
    tangent = response.stiffness
    eliminate(tangent, prescribed.fixed)
    np.savez(path, data=tangent.data, indices=tangent.indices, indptr=tangent.indptr, rhs=rhs)


def solve(scene: dict, folder: str, load: int, solver: str) -> dict:
    """Solve one of the systems to `TOLERANCE` with a linear solver, including its set-up."""
    wanted = Scene.from_dict(scene)
    problem = build(wanted, *_load(wanted, folder))
    linear = linear_solver(solver, problem.observer, problem.prescribed)
    with np.load(Path(folder) / f"{load}.npz") as kept:
        rhs = kept["rhs"]
        matrix = sp.bsr_matrix((kept["data"], kept["indices"], kept["indptr"]), shape=2 * rhs.shape)
    ready()
    with serial_blas():
        linear.use(System(matrix))
        solution = linear.solve(rhs, TOLERANCE)
    return {
        "dof": rhs.size,
        "krylov_iterations": solution.iterations,
        "setup_s": linear.setup_seconds,
        "residual": float(np.linalg.norm(rhs - matrix @ solution.x) / np.linalg.norm(rhs)),
    }
