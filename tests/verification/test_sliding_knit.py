"""Direct simulation of a knit whose yarns slide on each other: what friction remembers, its ledger, stabilisation."""

import re
import signal

import numpy as np
import pytest
from pull import pull, pull_apart

from knitstudy.files import read_dataset
from knitstudy.measures.history_checks import ledger_gap
from knitstudy.study.configuration import load_scene

NAME = "dns-isotropic-course-coarse"

WHOLE = {"specimen": "knit", "load.stops": []}
"""Whole yarns: pieces of a cut cell that nothing ties come apart without a force."""

CELL = WHOLE | {
    "contact.tied_edges": "none",
    "pattern.loops": 1,
    "pattern.rows": 1,
    "mesh.size": 2 / 3,
    "load.strain": 0.015,
    "solver.increments": 6,
    "solver.linear": "three_scale",
}
"""One coarse cell, none of it tied, in which friction takes an eighth of the work."""


@pytest.fixture(scope="module")
def changes(full):
    """What makes the coarse 3 x 3 knit the one that is pulled here: nothing, or all to make it a cell."""
    return WHOLE | {"load.strain": 0.02, "solver.increments": 8} if full else CELL


@pytest.fixture(scope="module")
def scene(changes):
    return load_scene(NAME).vary(changes)


@pytest.fixture(scope="module")
def options(changes):
    """The same as words of a command line."""
    quoted = {key: f'"{value}"' if isinstance(value, str) else value for key, value in changes.items()}
    return [f"{key}={value}" for key, value in quoted.items()]


@pytest.fixture(scope="module")
def history(tmp_path_factory, options):
    """Pulled in one go by one thread."""
    file, done = pull_apart(tmp_path_factory.mktemp("one"), 1, NAME, *options)
    assert done.returncode == 0, done.stderr
    return read_dataset(file)


def difference(one, other, name):
    """Largest difference of a variable in two histories over its largest value."""
    one, other = one[name].to_numpy(), other[name].to_numpy()
    return float(np.abs(one - other).max() / np.abs(one).max())


def in_one_order(history):
    """Contact points ordered by increment, surfaces, and place."""
    reference = history["contact_reference"].to_numpy().T
    keys = (*reference, *(history[f"contact_{name}"] for name in ("target", "yarn", "increment")))
    return history.isel(point=np.lexsort(keys))


def test_every_increment_converges(history, scene, verify):
    verify.at_most("sliding knit: residual over mean internal force", float(history["residual"].max()), 1e-6)
    verify.at_most("sliding knit: last correction over h", float(history["correction"].max()), 1e-6)
    deepest = -float(history["smallest_gap"].min())
    verify.at_most("sliding knit: penetration over h", deepest / scene.metres("mesh.size"), 0.01)
    slid = history["contact_slip"].max()
    assert slid > 1e-2 * scene.metres("mesh.size"), "the cases here are about sliding"


def test_ledger_of_energies(history, verify):
    verify.at_most("sliding knit: ledger of energies over external work", ledger_gap(history), 0.01)
    end = history["energy"].isel(increment=-1)
    assert end.sel(form="friction") > 0.05 * end.sel(form="external")


def test_killed_and_restarted(tmp_path, history, options, verify):
    """Two threads, killed and started again, against one thread in one go: forces, and what every point has slid."""
    file, killed = pull_apart(tmp_path, 2, NAME, *options, "kill=4")
    assert killed.returncode == -signal.SIGKILL
    assert not file.exists()
    file, done = pull_apart(tmp_path, 2, NAME, *options)
    assert done.returncode == 0, done.stderr
    assert re.findall(r"^increment (\d+)", done.stdout, re.MULTILINE)[0] == "5", (
        "the log goes on at the next increment"
    )
    restarted = read_dataset(file)
    what = "sliding knit, 1 thread against 2 threads killed and restarted"
    verify.at_most(f"{what}: force", difference(history, restarted, "force"), 1e-6)
    verify.at_most(f"{what}: net forces on yarns", difference(history, restarted, "yarn_force"), 1e-6)
    one, two = in_one_order(history), in_one_order(restarted)
    for name in ("increment", "yarn", "target", "cell", "sticks"):
        np.testing.assert_array_equal(one[f"contact_{name}"], two[f"contact_{name}"], name)
    verify.at_most(f"{what}: slip of all points", difference(one, two, "contact_slip"), 1e-6)


@pytest.fixture(scope="module")
def stabilised(scene):
    """The same knit held by viscous forces, and by a tenth of them."""
    return [pull(scene.replace("solver.stabilisation", share)) for share in (1e-9, 1e-10)]


def test_work_of_stabilisation_is_booked(stabilised, verify):
    """It takes something of every increment but the one that ends at full load."""
    strong, weak = (run["energy"].sel(form="stabilisation").to_numpy() for run in stabilised)
    assert (np.diff(strong)[:-1] > 0).all()
    assert strong[-1] == strong[-2]
    verify.within("stabilisation: its work over that of a tenth of it", strong[-1] / weak[-1], 10, 0.05)
    verify.at_most("stabilised knit: ledger of energies over external work", ledger_gap(stabilised[0]), 0.01)
