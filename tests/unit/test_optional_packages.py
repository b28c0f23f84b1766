"""The packages `use` and `paper` can be removed: what is left imports, lists its commands and simulates a scene."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from knitstudy.registry import optional_packages

PACKAGE = Path(__file__).parents[2] / "src" / "knitstudy"
LEFT_OUT = shutil.ignore_patterns("use", "paper", "__pycache__")

IMPORTS = """
import importlib, pkgutil, knitstudy
names = [module.name for module in pkgutil.walk_packages(knitstudy.__path__, "knitstudy.")]
for name in names:
    if not name.endswith("__main__"):
        importlib.import_module(name)
print(len(names), [name for name in names if name.startswith(("knitstudy.use", "knitstudy.paper"))])
"""

SIMULATES = """
from knitstudy import load_scene, simulate
small = {"name": "small", "pattern.loops": 1, "pattern.rows": 1, "solver.increments": 2, "load.strain": 0.005}
history = simulate(load_scene("rom3d-tie-course-coarse").vary(small), "results").history
print(history.sizes["increment"], float(history["force"][-1]) > 0)
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """Function that runs Python without the optional packages, in an empty folder; it returns the finished process."""
    folder = tmp_path_factory.mktemp("bare")
    shutil.copytree(PACKAGE, folder / "src" / "knitstudy", ignore=LEFT_OUT)
    shutil.copytree(PACKAGE / "data", folder / "src" / "knitstudy" / "data", dirs_exist_ok=True)

    def run(*arguments):
        paths = {"PYTHONPATH": str(folder / "src")}
        command = [sys.executable, *arguments]
        return subprocess.run(
            command, cwd=folder, env=os.environ | paths, capture_output=True, text=True, check=True
        )

    return run


def test_optional_packages_are_found():
    commands = {name for package in optional_packages() for name in package.commands}
    assert {"show", "export", "fit"} <= commands if (PACKAGE / "use").is_dir() else not commands
    assert any(package.report for package in optional_packages()) == (PACKAGE / "paper").is_dir()


def test_without_optional_packages_everything_else_imports(bare):
    assert int(bare("-c", IMPORTS).stdout.removesuffix(" []\n")) > 100


def test_without_optional_packages_the_command_lists_core_commands(bare):
    listed = bare("-m", "knitstudy", "--help").stdout.partition("Commands:")[2]
    assert [line.split()[0] for line in listed.splitlines() if line] == [
        "list",
        "check",
        "plan",
        "measure",
        "run",
        "study",
    ]


def test_without_optional_packages_a_scene_runs(bare):
    assert bare("-c", SIMULATES).stdout == "3 True\n"


def test_without_optional_packages_a_study_has_no_figures_tables_and_report(bare):
    jobs = set(bare("-m", "knitstudy", "study", "ci", "--", "--dry-run").stderr.split())
    assert "simulation" in jobs
    assert not {"figure", "table", "report", "mesh_vtu"} & jobs
