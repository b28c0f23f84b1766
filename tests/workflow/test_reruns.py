"""A change runs what depends on it, and nothing else."""

import re
import shutil

import netCDF4
import pytest
from conftest import Checkout

from knitstudy.datasets import recorded_digest

SHOWN = ("Draw", "Build", "Write the report")
PINNED = "config/scenes/7-coarse.yaml", "beam.tie: rigid", "beam.tie: pinned"


@pytest.fixture
def edited(checkout):
    """Function that replaces text in a file of the checkout, which is undone at the end of the test."""
    before = {}

    def edit(path, old, new):
        before.setdefault(checkout.folder / path, (checkout.folder / path).read_text())
        checkout.rewrite(path, old, new)

    yield edit
    for path, text in before.items():
        path.write_text(text)


def data(jobs):
    """Return the jobs that make no figure, no table and no report."""
    return {job for job in jobs if not job.startswith(SHOWN)}


def test_changes_run_the_stages_that_read_them(checkout, edited):
    """Values of keys, a scene that is changed and one that is added, and the code of all figures."""
    edited(*PINNED)
    edited("config/scenes/7-coarse-pair.yaml", "[318e-6, 318e-6", "[319e-6, 318e-6")
    added = "scenes:\n- {name: beam-added, studies: ci, keys: {interaction: rough, load.strain: 0.003}}\n"
    edited("config/scenes/6-beams.yaml", "scenes:\n", added)
    doubled = "rom2d: {fidelity: rom2d, rom.section: doubled}"
    edited("config/scenes/7-coarse.yaml", "rom2d: {fidelity: rom2d}", doubled)
    edited("src/knitstudy/use/style.py", "\n\n\n", "\n\nEDITED = True\n\n\n")
    jobs = checkout.jobs()
    expected = ("beam-isotropic-course-coarse", "pair-slid-coarse", "beam-added", "rom2d-tie-course-coarse")
    assert {f"Simulate {name}" for name in expected} == {job for job in jobs if job.startswith("Simulate")}
    assert all(re.search(r"beam-|pair-slid|rom2d-", job) for job in data(jobs)), jobs
    assert not any(job.startswith(("Mesh", "Lay")) for job in jobs)
    assert "Draw fig02_interfaces" in jobs


def test_code_of_models_runs_every_simulation_and_no_mesh(checkout, edited):
    edited("src/knitstudy/mechanics/core/newton.py", "\n\n\n", "\n\nEDITED = True\n\n\n")
    jobs = {job for job in checkout.jobs() if job.startswith(("Lay", "Mesh", "Simulate"))}
    assert {"Simulate dns-isotropic-course-coarse", "Simulate dns-tie-course-coarse"} <= jobs
    assert not [job for job in jobs if job.startswith(("Mesh", "Lay"))]


def test_code_that_makes_no_number_runs_nothing(checkout, edited):
    """Earlier plans that were undone have left nothing behind either."""
    for path in ("run/plan.py", "knit/scene/documents.py"):
        edited(f"src/knitstudy/{path}", "\n\n\n", "\n\nEDITED = True\n\n\n")
    ended = checkout.study("ci")
    assert ended.returncode == 0
    assert "Nothing to be done" in ended.stderr


def knitstudy(checkout, *arguments):
    """Run the command in the checkout."""
    ended = checkout.run("-m", "knitstudy", *arguments)
    assert ended.returncode == 0, ended.stderr


def test_command_takes_results_of_the_study_and_writes_elsewhere(finished_copy):
    folder, name = finished_copy.folder, "rom3d-tie-course-coarse"
    path = folder / "results" / "simulation" / f"{name}.nc"
    first, time = recorded_digest(path), path.stat().st_mtime_ns
    knitstudy(finished_copy, "run", name)
    assert not (folder / "runs").exists(), "the command uses what the study made"
    finished_copy.rewrite("config/defaults.yaml", "youngs_modulus: 1.30e9", "youngs_modulus: 1.31e9")
    knitstudy(finished_copy, "run", name)
    assert recorded_digest(folder / "runs" / "simulation" / f"{name}.nc") != first
    assert path.stat().st_mtime_ns == time, "results of a study are those of Snakemake"
    assert f"Simulate {name}" in finished_copy.jobs(str(path.relative_to(folder)))


def test_copies_run_nothing_whatever_their_times_and_else_as_the_study_does(checkout, tmp_path):
    """A fresh clone beside kept results: new times in any order, and nothing that Snakemake knows of them."""
    folder = tmp_path / "a clone"
    shutil.copytree(checkout.folder, folder, symlinks=True, copy_function=shutil.copy, ignore=without_records)
    clone = Checkout(folder)
    (folder / "results" / "geometry" / "pair90.nc").touch()
    assert clone.jobs() == set()
    clone.rewrite(*PINNED)
    (folder / "results" / "tables" / "interactions.csv").unlink()
    damaged = folder / "results" / "mesh" / "pair-slid-coarse.nc"
    damaged.write_bytes(damaged.read_bytes()[:2000])
    jobs = clone.jobs()
    assert {"Mesh pair-slid-coarse", "Build the table interactions"} <= jobs
    # The simulation is made again if the damaged mesh comes out as another one.
    simulated = {job for job in data(jobs) if job.startswith("Simulate")} - {"Simulate pair-slid-coarse"}
    assert simulated == {"Simulate beam-isotropic-course-coarse"}
    assert all(re.search(r"beam-|pair-slid|^Mesh", job) for job in data(jobs)), jobs


def test_results_that_somebody_has_edited_are_made_again_aloud(finished_copy):
    """Tables, pictures and histories, and a history whose digest is right; a study beside them runs nothing else."""
    results = finished_copy.folder / "results"
    table, picture = results / "tables" / "interactions.csv", results / "figures" / "fig01_unit_cell.png"
    history = results / "simulation" / "pair-slid-coarse.nc"
    targets = [str(path.relative_to(finished_copy.folder)) for path in (table, picture, history)]
    before = {path: path.read_bytes() for path in (table, picture)}
    for path in before:
        path.write_bytes(path.read_bytes() + b" ")
    with netCDF4.Dataset(history, "a") as file:
        file["force"].units = "kN"
    ended = finished_copy.study("ci", "--", *targets)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.count("; it is made again") == 3
    assert {path: path.read_bytes() for path in before} == before
    with netCDF4.Dataset(history) as file:
        assert file["force"].units == "N"


def without_records(folder, names):
    """Return what Snakemake keeps, which a fresh clone does not have."""
    return {".snakemake"} & set(names)
