"""What tests of several kinds share: one small plain knit that needs no optimisation, and how processes share tests."""

import csv
import importlib.util
import os
import platform
import re
import shutil
from functools import partial
from pathlib import Path

if platform.machine() == "x86_64":
    # Recorded histories are of these kernels (docs/reference/files.md); set before NumPy loads its BLAS.
    os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")

import numpy as np
import pytest
import yaml

from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.knit.models.beam import CellOfBeams
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import CellStrain, Pattern, SetYarn
from knitstudy.knit.scene.shared_sections import Friction
from knitstudy.knit.yarns.joints import contacts_of_crossings

SECONDS = Path(__file__).with_name("seconds.csv")
"""Tests that take longer than `LONG`, and what takes the time: the test, or the setup of what it shares with others."""

LONG = 2.0  # seconds
LONG_SETUP = 8.0  # seconds, beyond which --quick leaves out all tests of a file, which share the setup

QUICK_OF_WORKFLOW = ("test_chain.py", "test_stage.py")
"""Tests of the workflow that run with --quick: a tiny study from end to end, and one stage of it."""


class Seconds:
    """Writes how long tests take; a plugin of the process that collects the reports."""

    def __init__(self):
        self.rows = {}

    def pytest_runtest_logreport(self, report):
        if report.when in ("setup", "call") and report.duration > LONG:
            self.rows[report.nodeid, report.when] = report.duration

    def pytest_sessionfinish(self):
        with SECONDS.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("test", "when", "seconds"))
            table.writerows((*test, f"{seconds:.1f}") for test, seconds in sorted(self.rows.items()))


def left_out():
    """Return the tests, and the files with a long setup, that --quick leaves out."""
    with SECONDS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    tests = {row["test"] for row in rows if row["when"] == "call"}
    setups = [row for row in rows if row["when"] == "setup" and float(row["seconds"]) > LONG_SETUP]
    files = {row["test"].partition("::")[0] for row in setups}
    return tests, files


def pytest_addoption(parser):
    parser.addoption(
        "--quick", action="store_true", help=f"leave out tests above {LONG:g} s and most studies"
    )
    parser.addoption("--seconds", action="store_true", help=f"write {SECONDS.name}")
    parser.addoption(
        "--complete",
        action="store_true",
        help="fail a test that needs a package or program which is not installed, rather than skip it",
    )
    group = parser.getgroup("verification")
    group.addoption("--full", action="store_true", help="run cases of verification at full resolution")
    group.addoption("--cases", action="store_true", help="collect only tests that record a case")
    group.addoption("--table", metavar="FILE", help="write the table of verification cases")


def pytest_configure(config):
    config.addinivalue_line("markers", "full: takes long; runs with --full (`make verify`)")
    config.addinivalue_line("markers", "needs(remedy, module, program): needs something optional")
    if config.getoption("--seconds") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Seconds())
    config.addinivalue_line("markers", "optional_packages: needs the packages `use` and `paper`")


REMOVED = [name for name in ("use", "paper") if importlib.util.find_spec(f"knitstudy.{name}") is None]


def pytest_ignore_collect(collection_path):
    """Leave out files that import a removed package, themselves or through a helper or a benchmark."""
    return True if REMOVED and collection_path.suffix == ".py" and imports_removed(collection_path) else None


def imports_removed(path):
    """Return whether a file imports a removed package, or a module of the folders without packages that does."""
    text = path.read_text(encoding="utf-8")
    if re.search(rf"^from knitstudy\.({'|'.join(REMOVED)})\b", text, re.MULTILINE):
        return True
    names = set(re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)) - {path.stem}
    folders = path.parent, Path(__file__).parents[1] / "benchmarks"
    others = (folder / f"{name}.py" for folder in folders for name in names)
    return any(other.is_file() and imports_removed(other) for other in others)


TAKES_LONG = "takes minutes or full resolution: run it with --full; `make verify` and the nightly job do"


def pytest_runtest_setup(item):
    if item.get_closest_marker("full") and not item.config.getoption("--full"):
        pytest.skip(TAKES_LONG)
    if item.get_closest_marker("optional_packages") and REMOVED:
        pytest.skip(f"tests {' and '.join(REMOVED)}, removed here: run it in a complete checkout")
    for mark in item.iter_markers("needs"):
        if reason := lacking(*mark.args, **mark.kwargs):
            not_run(item.config, reason)


def lacking(remedy, *, module=None, program=None):
    """Return why a test cannot run and what to install, or nothing where the module or the program is there."""
    if module is not None and importlib.util.find_spec(module) is None:
        return f"the Python package {module} is not installed: {remedy}"
    if program is not None and shutil.which(program) is None:
        return f"the program {program} is not on the PATH: {remedy}"
    return ""


def not_run(config, reason):
    """Skip a test for want of something that is not installed; fail it with --complete."""
    if config.getoption("--complete"):
        pytest.fail(f"{reason} (without --complete this test is skipped)", pytrace=False)
    pytest.skip(reason)


@pytest.fixture
def not_run_here(request):
    """Function of a reason that skips a test for want of something that is not installed, or fails it."""
    return partial(not_run, request.config)


@pytest.fixture
def skip_if_long(request):
    """Function that skips a case that takes long, unless --full is given."""

    def skip(long):
        if long and not request.config.getoption("--full"):
            pytest.skip(TAKES_LONG)

    return skip


def is_quick(item, tests, files):
    """Return whether a test runs with --quick."""
    file, _, _ = item.nodeid.partition("::")
    if item.path.parent.name == "workflow":
        return item.path.name in QUICK_OF_WORKFLOW
    return item.nodeid not in tests and file not in files


def pytest_collection_modifyitems(config, items):
    """Begin with the study that tests of the workflow look at; what waits for it comes after the other long tests.

    Short tests come last: processes that share the tests then end together.
    """
    if config.getoption("--quick"):
        long = left_out()
        others = [item for item in items if not is_quick(item, *long)]
        config.hook.pytest_deselected(items=others)
        items[:] = [item for item in items if item not in set(others)]
    waiting = {item.path for item in items if {"finished", "finished_copy"} & set(item.fixturenames)}
    kinds = ("workflow", "verification", "regression", "unit")

    def place(item):
        return item.path.name != "test_chain.py", kinds.index(item.path.parent.name), item.path in waiting

    items.sort(key=place)


def merged(defaults, sections):
    """Return defaults with other keys in some sections."""
    return defaults | {
        name: defaults[name] | keys if isinstance(keys, dict) else keys for name, keys in sections.items()
    }


FILE = yaml.safe_load((Path(__file__).parents[1] / "config" / "defaults.yaml").read_text())
del FILE["pattern"]["loop"]
OWN = {
    "specimen": "knit",
    "pair": {"length": 10e-3},
    "yarn": {"youngs_modulus": 1.3e9},
    "geometry": {"beta": 1.0, "gamma": 1.0, "beta_0": 1.0, "samples": 50},
    "solver": {"increments": 10},
}
DEFAULTS = merged(FILE, OWN)


@pytest.fixture(scope="session")
def defaults_with():
    """Function that returns the defaults of small configurations with other keys in some sections."""
    return lambda **sections: merged(DEFAULTS, sections)


@pytest.fixture(scope="session")
def plain_scene(defaults_with):
    """Scene of a 3 x 3 knit whose yarns just do not touch: an analytic loop of 39.3 mm of 1.8 mm yarn."""
    t = 2 * np.pi * np.arange(12) / 12
    wale, course, height = 10.15e-3, 7.85e-3, 13.52e-3
    x = wale * (t / (2 * np.pi) + 0.24 * np.sin(2 * t))
    points = np.column_stack([x, -height / 2 * np.cos(t), -1.135e-3 * np.cos(2 * t)])
    loop = {"course_spacing": course, "wale_spacing": wale, "control_points": points.tolist()}
    defaults = defaults_with(
        fidelity="rom3d",
        pattern=loop | {"clearance": 0.02},
        pair={"clearance": 0.02},
        yarn={"diameter": 1.8e-3},
        geometry={"beta": 1e-3, "free": [""] * 12, "samples": 100},
        mesh={"size": 0.5},
        solver={"increments": 4},
        rom={"joint": "rigid"},
    )
    own = {"name": "plain-rom3d", "knit": "plain", "rom": {"contacts_from": "plain-dns"}}
    return Scene.from_dict(own, defaults=defaults)


@pytest.fixture(scope="session")
def jersey():
    """A cell of the jersey of the tutorial."""
    return CellOfBeams(
        pattern=Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1),
        yarn=SetYarn(diameter=0.25e-3, youngs_modulus=200e6),
        load=CellStrain(deformation="course", strain=0.1, lateral="free"),
        contact=Friction(friction=0.3),
    ).vary({"name": "jersey", "knit": "jersey"})


@pytest.fixture(scope="session")
def knit_of():
    """Return the function that lays out the knit of a scene as its control points describe it."""
    return lambda scene: plain_knit(initial_loop(scene), scene.pattern.loops, scene.pattern.rows)


@pytest.fixture(scope="session")
def knit(plain_scene, knit_of):
    """Knit of the plain scene."""
    return knit_of(plain_scene)


@pytest.fixture(scope="session")
def contacts(knit):
    """Contacts of that knit, by geometry alone."""
    return contacts_of_crossings(knit)


@pytest.fixture(scope="session")
def docs_script():
    """Return the module of a script in docs, by its name."""

    def load(name):
        path = Path(__file__).parents[1] / "docs" / "reference" / f"{name}.py"
        specification = importlib.util.spec_from_file_location(f"docs_{name}", path)
        module = importlib.util.module_from_spec(specification)
        specification.loader.exec_module(module)
        return module

    return load
