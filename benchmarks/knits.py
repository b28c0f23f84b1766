"""The inputs of benchmarks: knit and mesh of a scene, made once and kept in a scratch folder; and runs on them."""

from __future__ import annotations

from pathlib import Path

from measure import ready

from knitstudy.crossings import contacts
from knitstudy.files.netcdf import read_dataset, write_dataset
from knitstudy.geometry.build import build
from knitstudy.geometry.pattern import Knit
from knitstudy.mesh.knit import mesh_knit
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.networks.rom.crossing_contacts import contacts_of_crossings
from knitstudy.networks.rom.run import run as run_rom
from knitstudy.solids import dns
from knitstudy.study.configuration import load_scene
from knitstudy.study.scene import Scene


def prepare(scene: Scene, folder: Path) -> None:
    """Write knit and mesh of a DNS scene."""
    knit = build(scene)
    write_dataset(knit, folder / "knit.nc")
    mesh = mesh_knit(Knit.from_dataset(knit), scene.mesh.size, scene.mesh.growth)
    write_dataset(mesh.to_dataset(), folder / "mesh.nc")


def load(folder: str) -> tuple[Knit, SweptMesh]:
    """Read them."""
    place = Path(folder)
    return (
        Knit.from_dataset(read_dataset(place / "knit.nc")),
        SweptMesh.from_dataset(read_dataset(place / "mesh.nc")),
    )


def run_dns(scene: str, folder: str, increments: int | None = None) -> dict:
    """Run a DNS scene from its files; its contacts stay in the folder."""
    wanted = load_scene(scene)
    if increments:
        wanted = wanted.replace("solver.increments", increments)
    knit, mesh = load(folder)
    history = dns.run(wanted, mesh, knit)
    write_dataset(contacts.extract(knit, history), Path(folder) / "contacts.nc")
    return cost(history)


def run_reduced(scene: str, folder: str) -> dict:
    """Run a reduced model of the DNS in the folder."""
    knit = Knit.from_dataset(read_dataset(Path(folder) / "knit.nc"))
    return cost(run_rom(load_scene(scene), knit, read_dataset(Path(folder) / "contacts.nc")))


def run_tiled(scene: str, folder: str, loops: int, increments: int) -> dict:
    """Run a tied reduced model of `loops` x `loops` cells of the knit in the folder, joined where it crosses itself."""
    loop = Knit.from_dataset(read_dataset(Path(folder) / "knit.nc")).loop
    size = {"pattern.loops": loops, "pattern.rows": loops}
    wanted = load_scene(scene).vary(size | {"solver.increments": increments})
    ready()
    knit = Knit(loop, loops, loops)
    return cost(run_rom(wanted, knit, contacts_of_crossings(knit)))


def cost(history) -> dict:
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
