"""The wheel, installed in a fresh environment and used outside of any checkout."""

import re

import xarray as xr

SCENE = """\
studies: []
scenes:
- name: jersey
  case: tie-course
  keys: {knit: jersey, fidelity: rom3d, pattern.course_spacing: 0.9e-3, pattern.wale_spacing: 1.1e-3,
    yarn.diameter: 0.25e-3, pattern.loops: 1, pattern.rows: 1}
"""


def test_scene_of_ones_own(installed):
    """Its results say which commit the wheel was built from."""
    mine = installed.work / "mine"
    mine.mkdir()
    (mine / "jersey.yaml").write_text(SCENE)
    assert "mine: valid; " in installed.run("check", "mine")
    installed.run("run", "mine/jersey.yaml")
    assert "force along the load at the end" in installed.run("show", "runs/simulation/jersey.nc")
    with xr.open_dataset(installed.work / "runs" / "simulation" / "jersey.nc") as history:
        assert re.fullmatch(r"[\d.]+\+[0-9a-f]{7,12}(-dirty)?", history.attrs["code_version"])


def test_workflow(installed):
    assert "Study ci: complete" in installed.run("study", "ci", "--", "results/geometry/plain3x3.nc")
    assert (installed.work / "results" / "geometry" / "plain3x3.nc").is_file()
