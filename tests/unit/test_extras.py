"""Simulations need no package of an extra, and what needs one says how to install it."""

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from knitstudy.registry import EXTRAS

ROOT = Path(__file__).resolve().parents[2]

BLOCK = f"""
import importlib.abc, sys

class Blocked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {set(EXTRAS)!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Blocked())
"""

SOLVE = """
from knitstudy import load_scene, simulate
history = simulate(load_scene("cell-course-coarse")).history
print(float(history["force_per_width"].sel(plane="course")[-1]))
"""

NUMBERS = """
from knitstudy import fabric_sheet, load_scene, simulate
from knitstudy.run.commands.main import main
simulate(load_scene("rom3d-tie-course-coarse"), "results")
main(["show", "results/simulation/rom3d-tie-course-coarse.nc"])
"""

COMMAND = """
from knitstudy.run.commands.main import main
main({arguments!r})
"""


@pytest.fixture
def without_extras(tmp_path):
    """Function that runs code in a Python that finds no package of an extra; it returns the finished process."""

    def run(code):
        command = [sys.executable, "-c", BLOCK + code]
        environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    return run


def test_a_cell_is_solved_without_extras(without_extras):
    ended = without_extras(SOLVE)
    assert ended.returncode == 0, ended.stderr
    assert float(ended.stdout) > 0


@pytest.mark.optional_packages
def test_numbers_are_printed_without_extras(without_extras):
    ended = without_extras(NUMBERS)
    assert ended.returncode == 0, ended.stderr
    assert "force" in ended.stdout


@pytest.mark.optional_packages
def test_a_plot_names_its_extra(without_extras):
    ended = without_extras("import knitstudy\nknitstudy.plot")
    assert ended.stderr.splitlines()[-1] == (
        "knitstudy.errors.MissingPackageError: matplotlib is not installed:"
        ' python -m pip install "knitstudy[pictures]"'
    )


@pytest.mark.optional_packages
@pytest.mark.parametrize(
    ("arguments", "module", "extra"),
    [
        (["study", "ci"], "snakemake", "study"),
        (["loop"], "matplotlib", "pictures"),
    ],
)
def test_a_command_names_its_extra(without_extras, arguments, module, extra):
    ended = without_extras(COMMAND.format(arguments=arguments))
    assert ended.returncode == 1
    assert ended.stderr == f'error: {module} is not installed: python -m pip install "knitstudy[{extra}]"\n'


def test_extras_install_what_they_are_named_for():
    """Every module of `EXTRAS` is of a package that its extra lists, and no package of an extra is left out."""
    described = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    of_modules = packages_distributions()
    listed = {
        (extra, re.split(r"[<>=\[]", line)[0].lower())
        for extra in set(EXTRAS.values())
        for line in described["optional-dependencies"][extra]
    } - {("study", "knitstudy")}
    # VTK is a dependency of PyVista.
    modules = {module: extra for module, extra in EXTRAS.items() if module != "vtkmodules"}
    assert {(extra, of_modules[module][0].lower()) for module, extra in modules.items()} == listed
    base = {re.split(r"[<>=\[]", line)[0].lower() for line in described["dependencies"]}
    assert not base & {name for _, name in listed}
