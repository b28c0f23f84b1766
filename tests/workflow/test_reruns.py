"""A change runs what depends on it, and nothing else; the command and the workflow mean the same by that."""

import re

import netCDF4
import pytest

from knitstudy.files import read_dataset, recorded_digest

TIED = re.compile(r"(dns|rom3d|rom2d)-tie")
SHOWN = ("Draw", "Build", "Write the report")


@pytest.fixture
def edited(checkout):
    """Function that replaces text in a file of the checkout, which is undone at the end of the test."""
    before = {}

    def edit(path, old, new):
        path = checkout.folder / path
        text = path.read_text()
        before.setdefault(path, text)
        assert old in text, f"{path} has no {old!r}"
        path.write_text(text.replace(old, new, 1))

    yield edit
    for path, text in before.items():
        path.write_text(text)


def data(jobs):
    """Return the jobs that make no figure, no table and no report."""
    return {job for job in jobs if not job.startswith(SHOWN)}


def test_changes_run_what_reads_them(checkout, edited):
    """Values of keys, a scene that is changed and one that is added, and the code of all figures."""
    edited("config/defaults.yaml", "stiffness: 10               # E R", "stiffness: 11               # E R")
    edited("config/scenes/7-coarse-pair.yaml", "[318e-6, 318e-6", "[319e-6, 318e-6")
    added = "scenes:\n- {name: beam-added, studies: ci, keys: {interaction: rough, load.strain: 0.003}}\n"
    edited("config/scenes/6-beams.yaml", "scenes:\n", added)
    doubled = "rom2d: {fidelity: rom2d, rom.section: doubled}"
    edited("config/scenes/7-coarse.yaml", "rom2d: {fidelity: rom2d}", doubled)
    edited("src/knitstudy/figures/style.py", "\n\n\n", "\n\nEDITED = True\n\n\n")
    jobs = checkout.jobs()
    wanted = ("beam-isotropic-course-coarse", "pair-slid-coarse", "beam-added", "rom2d-tie-course-coarse")
    assert {f"Simulate {name}" for name in wanted} == {job for job in jobs if job.startswith("Simulate")}
    assert all(re.search(r"beam-|pair-slid|rom2d-", job) for job in data(jobs)), jobs
    assert not any(job.startswith(("Mesh", "Lay")) for job in jobs)
    assert "Draw fig02_interfaces" in jobs


def test_friction_law_runs_no_tied_model_and_no_mesh(checkout, edited):
    edited("src/knitstudy/mechanics/contact/friction.py", "\nOPEN, STICK", "\nEDITED = True\nOPEN, STICK")
    jobs = {job for job in checkout.jobs() if job.startswith(("Lay", "Mesh", "Simulate", "Find", "Average"))}
    assert "Simulate dns-isotropic-course-coarse" in jobs
    assert not [job for job in jobs if TIED.search(job) or job.startswith(("Mesh", "Lay"))]


def test_comments_and_a_new_key_with_a_default_run_nothing(checkout, edited):
    """What was planned and undone before has left nothing behind either."""
    for module in ("mechanics/newton.py", "mechanics/contact/friction.py", "figures/style.py"):
        edited(f"src/knitstudy/{module}", '"""', '"""Better said: ')
        edited(f"src/knitstudy/{module}", "\n\n\n", "\n\n\n# A better comment.\n")
    edited("src/knitstudy/study/scene.py", "\n\n\n", "\n\n\nEDITED = True\n\n\n")
    ended = checkout.study("ci")
    assert ended.returncode == 0
    assert ended.stdout.startswith("Study ci: nothing to do, everything is up to date.")


def knitstudy(checkout, *arguments):
    """Run the command in the checkout."""
    ended = checkout.run("-m", "knitstudy", *arguments)
    assert ended.returncode == 0, ended.stderr


def test_command_and_workflow_share_results(finished_copy):
    folder, name = finished_copy.folder, "rom3d-tie-course-coarse"
    path = folder / "results" / "simulation" / f"{name}.nc"
    first, time = recorded_digest(path), path.stat().st_mtime_ns
    knitstudy(finished_copy, "run", name)
    assert path.stat().st_mtime_ns == time, "the command uses what the workflow made"

    defaults = folder / "config" / "defaults.yaml"
    before = defaults.read_text()
    defaults.write_text(before.replace("youngs_modulus: 1.30e9", "youngs_modulus: 1.31e9"))
    knitstudy(finished_copy, "run", name)
    second = recorded_digest(path)
    assert second != first
    made = read_dataset(path)
    targets = [
        str(path.with_name(f"{model}-tie-course-coarse.nc").relative_to(folder))
        for model in ("rom3d", "rom2d")
    ]
    ended = finished_copy.snakemake(*targets, "--config", "study=ci")
    assert ended.returncode == 0, ended.stderr
    assert read_dataset(path).identical(made), "the workflow uses it as well"
    assert "Simulate rom2d-tie-course-coarse" in ended.stderr

    defaults.write_text(before)
    assert f"Simulate {name}" in finished_copy.jobs(*targets), "what the command made is of the other value"


def test_spoilt_results_are_made_again(finished_copy):
    """A truncated and an incomplete file are made again."""
    results = finished_copy.folder / "results"
    mesh, history = results / "mesh/pair-slid-coarse.nc", results / "simulation/pair-slid-coarse.nc"
    earlier = read_dataset(mesh)
    mesh.write_bytes(mesh.read_bytes()[:-1000])
    with netCDF4.Dataset(history, "a") as file:
        file.incomplete = "no balance"
    assert data(finished_copy.jobs(str(history.relative_to(finished_copy.folder)))) == {
        "Mesh pair-slid-coarse",
        "Simulate pair-slid-coarse",
    }
    ended = finished_copy.snakemake("results/mesh/pair-slid-coarse.nc", "--config", "study=ci")
    assert ended.returncode == 0, ended.stderr
    said = r"results/mesh/pair-slid-coarse.nc: is truncated or is not netCDF .*; it will be made again"
    assert re.search(said, ended.stdout + ended.stderr)
    assert read_dataset(mesh).equals(earlier)  # its time, and with it its checksum, is another
