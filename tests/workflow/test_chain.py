"""The whole study on the coarsest 3 x 3 knit, and single files as targets."""

import re

import meshio
import numpy as np
import pytest

from knitstudy.datasets import read_dataset
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.run.configuration import load_scenes, load_study
from knitstudy.run.stages import STAGES


def test_every_scene_has_a_history_with_provenance(checkout):
    scenes = load_scenes(checkout.folder / "config")
    for name in load_study("ci", checkout.folder / "config"):
        history = read_dataset(checkout.folder / "results" / STAGES["simulation"].path(name))
        assert history.scene == name
        assert history.digest
        if scenes[name].is_knit:
            assert history.strain[-1] == pytest.approx(scenes[name].load.strain)
            assert (np.diff(history.force) > 0).all(), "a knit in tension pulls back harder and harder"


def test_deformed_yarns_for_paraview(checkout):
    results = checkout.folder / "results"
    history = read_dataset(results / "simulation" / "dns-tie-course-coarse.nc")
    mesh = SweptMesh.from_dataset(read_dataset(results / "mesh" / "dns-tie-course-coarse.nc"))
    read = meshio.read(results / "simulation" / "dns-tie-course-coarse.vtu")
    assert set(read.cell_data) == {"yarn", "scaled_jacobian", "von_mises [Pa]", "principal_stress [Pa]"}
    displacement = read.point_data["displacement [m]"]
    np.testing.assert_array_equal(displacement, history["node_displacement"])
    np.testing.assert_allclose(read.points, mesh.nodes, rtol=1e-12)  # discs tie yarns where they are


def test_report_logs_and_messages(finished, checkout):
    results, message = checkout.folder / "results", finished[1].stdout
    last = message.splitlines()[-1]
    assert last.startswith("Study ci: complete in ")
    assert str(results) in last
    assert str(results / "report.html") in last
    report = (results / "report.html").read_text(encoding="utf-8")
    (turning,) = re.findall(r'<iframe [^>]*srcdoc="([^"]*)"', report)
    assert "DecompressionStream" in turning
    assert len(turning) < 3e6
    messages = finished[1].stderr
    assert "100% [" in messages, "progress has the time left"
    assert re.search(r"^\[\d+/\d+\] Simulate dns-tie-course-coarse", messages, flags=re.MULTILINE)
    for kind in ("figures/*.png", "figures/*.pdf", "tables/*.csv"):
        made = list(results.glob(kind))
        assert made
        assert all(path.stat().st_size > 0 for path in made), kind
    log = (checkout.folder / "logs" / "simulation" / "dns-tie-course-coarse.log").read_text()
    assert "increment 1: strain" in log
    assert "numpy" in log


def test_both_snakefiles_are_the_same_study(fresh):
    jobs = fresh.jobs()
    assert any(job.startswith("Simulate ") for job in jobs)
    assert fresh.jobs("--snakefile", "workflow/Snakefile") == jobs


def test_a_mesh_as_target(fresh):
    target = "results/mesh/pair-slid-30.nc"
    ended = fresh.snakemake(target, "--cores", "1")
    assert ended.returncode == 0, ended.stderr
    assert SweptMesh.from_dataset(read_dataset(fresh.folder / target)).yarns == 2
    done = len(re.findall(r"^Finished jobid", ended.stdout + ended.stderr, flags=re.MULTILINE))
    assert done == 2
    path = "30: [[0, 0, -90e-6], [435e-6,"
    fresh.rewrite("config/scenes/3-pairs.yaml", path, path.replace("435", "436"))
    assert fresh.jobs(target) == set(), "the load path is no matter of the mesh"
