"""The inputs of benchmarks: knit and mesh of a scene, made once and kept in a scratch folder; and runs on them."""

from __future__ import annotations

from pathlib import Path

import xarray as xr
from measure import ready

from knitstudy.files import read_dataset, write_dataset
from knitstudy.geometry.fabric import Fabric, plain_knit
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.simulate import solve
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene


def prepare(scene: Scene, folder: Path) -> None:
    """Write geometry and mesh of a DNS scene."""
    geometry = STAGES["geometry"].function(scene)
    write_dataset(geometry, folder / "geometry.nc")
    write_dataset(STAGES["mesh"].function(scene, geometry), folder / "mesh.nc")


def load(folder: str) -> tuple[Fabric, SweptMesh]:
    """Read them."""
    return Fabric.from_dataset(_read(folder, "geometry")), SweptMesh.from_dataset(_read(folder, "mesh"))


def _read(folder: str, name: str) -> xr.Dataset:
    return read_dataset(Path(folder) / f"{name}.nc")


def run_dns(scene: str, folder: str, increments: int | None = None) -> dict:
    """Run a DNS scene from its files; its contacts stay in the folder."""
    wanted = load_scene(scene)
    if increments:
        wanted = wanted.replace("solver.increments", increments)
    return run_direct(wanted, folder)


def run_direct(scene: Scene, folder: str) -> dict:
    """Run a DNS scene on the geometry and the mesh in a folder; its contacts stay there."""
    geometry, mesh = _read(folder, "geometry"), _read(folder, "mesh")
    ready()
    history = STAGES["simulation"].function(scene, geometry=geometry, mesh=mesh)
    contacts = STAGES["contacts"].function(scene, geometry=geometry, history=history)
    write_dataset(contacts, Path(folder) / "contacts.nc")
    return cost(history)


def run_reduced(scene: str, folder: str) -> dict:
    """Run a reduced model of the DNS in the folder."""
    geometry, contacts = _read(folder, "geometry"), _read(folder, "contacts")
    return cost(STAGES["simulation"].function(load_scene(scene), geometry=geometry, contacts=contacts))


def run_tiled(scene: str, folder: str, loops: int, increments: int) -> dict:
    """Run a tied reduced model of `loops` x `loops` cells of the knit in the folder, joined where it crosses itself."""
    loop = load(folder)[0].loop
    size = {"pattern.loops": loops, "pattern.rows": loops}
    wanted = load_scene(scene).vary(size | {"solver.increments": increments})
    ready()
    knit = plain_knit(loop, loops, loops)
    return cost(solve(wanted, knit, contacts=contacts_of_crossings(knit)))


def cost(history: xr.Dataset) -> dict:
    """Return the columns of a history that tell what it cost; `path_s` leaves out reading and writing."""
    newton = int(history["newton_iterations"].sum())
    phases = history["seconds"].sum("increment") / max(newton, 1)
    return {
        "dof": int(history.attrs["dof"]),
        "path_s": float(history.attrs["wall_seconds"]),
        "increments": history.sizes["increment"] - 1,
        "newton_iterations": newton,
        "krylov_iterations": int(history["krylov_iterations"].sum()),
        "force_N": float(history["force"][-1]),
        **{f"{phase}_s_per_newton": float(phases.sel(phase=phase)) for phase in phases["phase"].to_numpy()},
    }
