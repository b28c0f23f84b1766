"""A change runs what depends on it, and nothing else; the command and the workflow mean the same by that."""

import re
import subprocess

import netCDF4
import pytest

from knitstudy.files import read_dataset, recorded_digest

TIED = re.compile(r"(dns|rom3d|rom2d)-tie")
SHOWN = ("Draw", "Build", "Write the report")


@pytest.fixture(scope="module")
def checkout(finished):
    checkout, ended = finished
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


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


def test_comments_and_a_new_key_with_a_default_run_nothing(checkout, edited):
    for module in ("mechanics/newton.py", "mechanics/contact/friction.py", "figures/style.py"):
        edited(f"src/knitstudy/{module}", '"""', '"""Better said: ')
        edited(f"src/knitstudy/{module}", "\n\n\n", "\n\n\n# A better comment.\n")
    edited("src/knitstudy/study/scene.py", "\n\n\n", "\n\n\nEDITED = True\n\n\n")
    assert checkout.jobs() == set()


def test_values_run_the_scenes_that_read_them(checkout, edited):
    edited("config/defaults.yaml", "stiffness: 10               # E R", "stiffness: 11               # E R")
    edited("config/scenes/3-pairs.yaml", "[318e-6, 318e-6", "[319e-6, 318e-6")
    jobs = data(checkout.jobs())
    assert {"Simulate beam-isotropic-course-coarse", "Simulate pair-slid-90"} <= jobs
    assert all(re.search(r"beam-|pair-slid-90", job) for job in jobs), jobs
    assert not any(job.startswith(("Mesh", "Lay")) for job in jobs)


def test_scene_that_is_added_or_changed_runs_itself_and_what_lists_it(checkout, edited):
    edited(
        "config/scenes/6-beams.yaml",
        "scenes:\n",
        "scenes:\n- {name: beam-added, studies: ci, keys: {interaction: rough, load.strain: 0.003}}\n",
    )
    edited(
        "config/scenes/7-coarse.yaml",
        "rom2d: {fidelity: rom2d}",
        "rom2d: {fidelity: rom2d, rom.section: doubled}",
    )
    jobs = checkout.jobs()
    assert "Simulate beam-added" in jobs
    assert all(re.match(r"Simulate (beam-added|rom2d-)", job) for job in data(jobs))


def test_friction_law_runs_no_tied_model_and_no_mesh(checkout, edited):
    edited("src/knitstudy/mechanics/contact/friction.py", "\nOPEN, STICK", "\nEDITED = True\nOPEN, STICK")
    jobs = {job for job in checkout.jobs() if job.startswith(("Lay", "Mesh", "Simulate", "Find", "Average"))}
    assert "Simulate dns-isotropic-course-coarse" in jobs
    assert not [job for job in jobs if TIED.search(job) or job.startswith(("Mesh", "Lay"))]


def test_edited_figure_runs_no_simulation(checkout, edited):
    edited("src/knitstudy/figures/style.py", "\n\n\n", "\n\nEDITED = True\n\n\n")
    jobs = checkout.jobs()
    assert any(job.startswith("Draw") for job in jobs)
    assert data(jobs) == set()


def test_nothing_to_do_at_last(checkout):
    """What was planned and undone has left nothing behind."""
    ended = checkout.study("ci")
    assert ended.returncode == 0
    assert ended.stdout.startswith("Study ci: nothing to do, everything is up to date.")


def knitstudy(checkout, *arguments):
    """Run the command in the checkout."""
    command = [checkout.python, "-m", "knitstudy", *arguments]
    ended = subprocess.run(
        command, cwd=checkout.folder, env=checkout.environment, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    return ended


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
    jobs = finished_copy.jobs()
    assert f"Simulate {name}" not in jobs or takes_over(finished_copy, path), "the workflow uses it as well"
    assert "Simulate rom3d-tie-wale-coarse" in jobs

    defaults.write_text(before)
    assert f"Simulate {name}" in finished_copy.jobs(), "what the command made is of the other value"


def takes_over(checkout, path):
    """Whether a job for a result leaves the result of the command as it is."""
    before = read_dataset(path)
    ended = checkout.snakemake(str(path.relative_to(checkout.folder)), "--config", "study=ci")
    assert ended.returncode == 0, ended.stderr
    return read_dataset(path).identical(before)


def test_spoilt_results_are_made_again_or_refused(finished_copy):
    """A truncated and an incomplete file are made again; who needs an edited one says so."""
    results = finished_copy.folder / "results"
    mesh, history, edited = (
        results / name
        for name in (
            "mesh/pair-slid-90.nc",
            "simulation/pair-slid-90.nc",
            "geometry/pair90.nc",
        )
    )
    earlier = read_dataset(mesh)
    mesh.write_bytes(mesh.read_bytes()[:-1000])
    with netCDF4.Dataset(history, "a") as file:
        file.incomplete = "no balance"
    assert data(finished_copy.jobs(str(history.relative_to(finished_copy.folder)))) == {
        "Mesh pair-slid-90",
        "Simulate pair-slid-90",
    }
    ended = finished_copy.snakemake("results/mesh/pair-slid-90.nc", "--config", "study=ci")
    assert ended.returncode == 0, ended.stderr
    said = r"results/mesh/pair-slid-90.nc: is truncated or is not netCDF .*; it will be made again"
    assert re.search(said, ended.stdout + ended.stderr)
    assert read_dataset(mesh).equals(earlier)  # its time, and with it its checksum, is another

    with netCDF4.Dataset(edited, "a") as file:
        name = next(
            name for name, values in file.variables.items() if values.dtype == float and values.size > 1
        )
        file[name][...] = 1.01 * file[name][...]
    ended = finished_copy.snakemake("results/simulation/pair-slid-90.nc", "--config", "study=ci")
    assert ended.returncode == 1
    assert "results/geometry/pair90.nc: was changed after it was written; delete it" in ended.stderr
