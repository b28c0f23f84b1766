"""The whole study on the coarsest 3 x 3 knit: results, nothing to do, and what an edit runs again."""

import re

import meshio
import numpy as np
import pytest

from knitstudy.files import read_dataset
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.stages.table import STAGES
from knitstudy.study.configuration import load_scenes, load_study

SIMULATION = {"geometry", "mesh", "simulation", "contacts"}


@pytest.fixture(scope="module")
def checkout(finished):
    checkout, ended = finished
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


def test_last_line_says_where_the_results_are(finished):
    checkout, ended = finished
    last = ended.stdout.splitlines()[-1]
    assert last.startswith("Study ci: complete in ")
    assert str(checkout.folder / "results") in last


def test_every_scene_has_a_history_with_provenance(checkout):
    scenes = load_scenes(checkout.folder / "config")
    for name in load_study("ci", checkout.folder / "config"):
        history = read_dataset(checkout.folder / "results" / STAGES["simulation"].path(scenes[name]))
        assert history.scene == name
        assert history.digest
        if scenes[name].specimen == "knit":
            assert history.strain[-1] == pytest.approx(scenes[name].load.strain)
            assert (np.diff(history.force) > 0).all(), "a knit in tension pulls back harder and harder"


def test_deformed_yarns_for_paraview(checkout):
    results = checkout.folder / "results"
    history = read_dataset(results / "simulation" / "dns-tie-course-coarse.nc")
    mesh = SweptMesh.from_dataset(read_dataset(results / "mesh" / "dns-tie-course-coarse.nc"))
    read = meshio.read(results / "simulation" / "dns-tie-course-coarse.vtu")
    displacement = read.point_data["displacement [m]"]
    np.testing.assert_array_equal(displacement, history["node_displacement"])
    # The ends of the yarns are driven: exactly, but for the rounding of the load factor.
    travel = float(history["displacement"][-1])
    np.testing.assert_allclose(displacement[mesh.end_nodes("left")], 0, atol=1e-12 * travel)
    np.testing.assert_allclose(displacement[mesh.end_nodes("right"), 0], travel, rtol=1e-12)
    np.testing.assert_allclose(read.points, mesh.nodes, rtol=1e-12)  # discs tie yarns where they are


def test_report_and_all_its_parts_are_there(finished, checkout):
    results = checkout.folder / "results"
    assert str(results / "report.html") in finished[1].stdout.splitlines()[-1]
    for kind in ("figures/*.png", "figures/*.pdf", "tables/*.csv"):
        made = list(results.glob(kind))
        assert made
        assert all(path.stat().st_size > 0 for path in made), kind


def test_progress_has_the_time_left(finished):
    assert "100% [" in finished[1].stdout


def test_logs_say_what_ran(checkout):
    log = (checkout.folder / "logs" / "simulation" / "dns-tie-course-coarse.log").read_text()
    assert "increment 1: strain" in log
    assert "numpy" in log


def test_again_there_is_nothing_to_do(checkout):
    ended = checkout.study("ci")
    assert ended.returncode == 0
    assert ended.stdout.startswith("Study ci: nothing to do, everything is up to date.")


@pytest.fixture
def edited(checkout):
    """Function that appends a line to a file of the checkout, taken away again at the end of the test."""
    before = {}

    def edit(path, line="EDITED = True\n"):
        path = checkout.folder / path
        before[path] = path.read_text()
        path.write_text(before[path] + line)

    yield edit
    for path, text in before.items():
        path.write_text(text)


def test_edited_figures_run_no_simulation(checkout, edited):
    for path in sorted((checkout.folder / "src" / "knitstudy" / "figures").glob("*.py")):
        edited(path.relative_to(checkout.folder))
    planned = checkout.planned()
    assert "figure" in planned
    assert not planned & SIMULATION


def test_edited_solver_runs_simulations_and_no_mesh(checkout, edited):
    edited("src/knitstudy/mechanics/newton.py")
    planned = checkout.planned()
    assert {"simulation", "contacts"} <= planned
    assert not {"geometry", "mesh"} & planned


def test_edited_documentation_of_the_scene_runs_nothing(checkout, edited):
    edited("src/knitstudy/study/scene.py")
    assert checkout.planned() == set()


def test_changed_scene_runs_itself_and_what_depends_on_it(checkout, edited):
    path = checkout.folder / "config" / "scenes" / "7-coarse.yaml"
    edited("config/scenes/7-coarse.yaml", "")
    text, changed = path.read_text(), "rom2d: {fidelity: rom2d, rom.section: doubled}"
    assert "rom2d: {fidelity: rom2d}" in text
    path.write_text(text.replace("rom2d: {fidelity: rom2d}", changed))
    planned = checkout.planned()
    assert "simulation" in planned
    assert not {"geometry", "mesh", "contacts"} & planned


def test_single_files_are_targets(checkout):
    assert checkout.planned("results/mesh/dns-tie-course.nc") == {"mesh"}


def test_mesh_of_two_crossing_yarns(fresh):
    target = "results/mesh/pair-slid-30.nc"
    ended = fresh.snakemake(target, "--cores", "1")
    assert ended.returncode == 0, ended.stderr
    assert SweptMesh.from_dataset(read_dataset(fresh.folder / target)).yarns == 2
    family = fresh.folder / "config" / "scenes" / "3-pairs.yaml"
    family.write_text(family.read_text().replace("[435e-6,", "[436e-6,"))
    assert fresh.planned(target) == set(), "the way of the yarns is no matter of their mesh"


def test_ready_jobs_are_looked_for_when_one_has_ended(fresh):
    """Not again a second after each time that they were, which adds up to a core with nothing else to do."""
    targets = [f"results/mesh/pair-{way}-{angle}.nc" for way in ("slid", "tied") for angle in (30, 90)]
    ended = fresh.snakemake(*targets, "--cores", "1", "--verbose")
    assert ended.returncode == 0, ended.stderr
    done = len(re.findall(r"^Finished jobid", ended.stdout + ended.stderr, flags=re.MULTILINE))
    looks = len(re.findall(r"^Ready jobs", ended.stdout + ended.stderr, flags=re.MULTILINE))
    assert done == 6
    assert done <= looks <= done + 1
