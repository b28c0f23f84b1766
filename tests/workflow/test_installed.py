"""The wheel, installed in a fresh environment and used outside of any checkout."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import xarray as xr

SCENE = """\
studies: []
scenes:
- name: jersey
  case: tie-course
  keys: {knit: jersey, fidelity: rom3d, pattern.course_spacing: 0.9e-3, pattern.wale_spacing: 1.1e-3,
    yarn.diameter: 0.25e-3, pattern.loops: 1, pattern.rows: 1}
"""


@pytest.fixture(scope="module")
def installed(checkout_copy, tmp_path_factory):
    """Function that runs a command of an environment with the wheel; all that the wheel needs is that of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    source, wheels, environment = folder / "source", folder / "wheels", folder / "environment"
    shutil.copytree(checkout_copy, source, symlinks=True)
    for name in ("README.md", "LICENSE", "setup.py"):
        shutil.copy2(Path(__file__).resolve().parents[2] / name, source)
    committed = "-c user.name=a -c user.email=a@b.c commit --quiet --allow-empty --message a".split()
    for command in (["init", "--quiet"], committed):
        subprocess.run(["git", "-C", source, *command], check=True)
    pip, offline = [sys.executable, "-m", "pip", "--quiet"], ["--no-deps", "--no-index"]
    subprocess.run(
        [*pip, "wheel", *offline, "--no-build-isolation", "--wheel-dir", wheels, source], check=True
    )
    shutil.rmtree(source)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    (wheel,) = wheels.iterdir()
    python = environment / "bin" / "python"
    subprocess.run([*pip, "--python", python, "install", *offline, wheel], check=True)
    (packages,) = environment.glob("lib/python*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    work = folder / "work"
    (work / "mine").mkdir(parents=True)
    (work / "mine" / "jersey.yaml").write_text(SCENE)
    variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    variables |= {"XDG_CACHE_HOME": str(folder / "cache")}

    def run(*arguments):
        command = [python, "-m", "knitstudy", *arguments]
        ended = subprocess.run(command, cwd=work, env=variables, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
        return ended.stdout + ended.stderr

    return run, work


def test_scene_of_ones_own(installed):
    """Its results say which commit the wheel was built from."""
    run, work = installed
    assert "mine: valid; " in run("check", "mine")
    run("run", "mine/jersey.yaml")
    assert "force along the load at the end" in run("show", "runs/simulation/jersey.nc")
    with xr.open_dataset(work / "runs" / "simulation" / "jersey.nc") as history:
        assert re.fullmatch(r"[\d.]+\+[0-9a-f]{7,12}(-dirty)?", history.attrs["code_version"])


def test_workflow(installed):
    run, work = installed
    assert "Study ci: complete" in run("study", "ci", "--", "results/geometry/plain3x3.nc")
    assert (work / "results" / "geometry" / "plain3x3.nc").is_file()
