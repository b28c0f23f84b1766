"""Scenes start: they are built, and all gates accept their first increment.

With ``--full`` all scenes of all studies are started; else a few cheap ones, the same with every commit. What a scene
takes from simulations of others is taken from their first increments. ``resources/known_ends.csv`` lists the scenes
that end.

Outcomes with ``--full`` are kept in ``run/starts`` by the digest of the simulation: a check that was interrupted goes
on, and a scene is started again when its keys or the code behind it have changed.
"""

import csv
import re
import time
from functools import cache
from hashlib import md5
from pathlib import Path

import pytest

from knitstudy.datasets import read_dataset, write_dataset
from knitstudy.errors import ConvergenceError, KnitstudyError
from knitstudy.files import write_text
from knitstudy.knit.loading.run import Run
from knitstudy.mechanics.core.batches import serial_blas
from knitstudy.run.cost import expected_cost
from knitstudy.run.plan import Plan
from knitstudy.run.stages import STAGES

ROOT = Path(__file__).parents[2]
KNOWN = ROOT / "resources" / "known_ends.csv"
OF_OTHERS = ("contacts", "stress")  # Stages that a simulation takes results of with another scene
SHARED = ("geometry", "rest", *OF_OTHERS)  # Stages whose results several scenes need
BUDGET, DEAREST = 8.0, 4.0  # Expected processor time of all and of each of the scenes without --full [s]
GEOMETRY, REST = 1.0, 5.0  # The same of a geometry, and of one cell of a shape at rest [s]


class Reached(ConvergenceError):
    """The first increment is accepted: the history ends here."""


def stop(load, note=""):
    """End a run after its first increment."""
    if load > 0:
        raise Reached("the first increment is enough")


@cache
def plan():
    return Plan.of()


@cache
def known():
    """Reasons by the names of scenes that end, and the memory [MB] up to which scenes are started."""
    head, *lines = KNOWN.read_text().splitlines()
    rows = {row["scene"]: row["reason"] for row in csv.DictReader(lines)}
    return rows, float(re.search(r"more than (\d+) MB", head).group(1))


def simulated(scene):
    """Return a scene and those that it takes results of."""
    needs = plan().step("simulation", scene).needs.values()
    return [scene, *(step.scene for step in needs if step.stage.name in OF_OTHERS)]


def digest_of(scene):
    return plan().step("simulation", scene).digest


@cache
def sources():
    """Digests of the simulations that other scenes take results of, and of those among them that run to full load.

    Springs are measured where yarns have touched, which they may not do in the first increment.
    """
    others = [other for scene in plan().scenes.values() for other in simulated(scene)[1:]]
    known = {digest_of(other): other.kind.interaction.touches for other in others}
    return set(known), {digest for digest, touches in known.items() if touches}


class Starts:
    """First increments of scenes; what several of them need is kept in a folder."""

    def __init__(self, folder):
        self.folder = folder

    def obtain(self, step):
        """Return the result of a step, of simulations up to the first increment."""
        stage, digest = step.stage, step.digest
        path = self.folder / f"{digest}.nc"
        if path.is_file():
            return read_dataset(path)
        needed, (shared, whole) = {name: self.obtain(need) for name, need in step.needs.items()}, sources()
        run = {"run": Run() if digest in whole else Run(progress=stop)} if stage.restarts else {}
        try:
            with serial_blas():
                actual = stage.function(step.seen, **needed, **run)
        except Reached as reached:
            actual = reached.history
        if stage.name in SHARED or digest in shared:
            write_dataset(actual, path, step.scene.name, digest)
        return actual

    def why_it_ends(self, scene):
        """Return why a scene ends, or nothing where its first increment is accepted."""
        path = self.folder / f"{digest_of(scene)}.txt"
        if not path.is_file():
            started = time.process_time()
            try:
                self.obtain(plan().step("simulation", scene))
                message = ""
            except KnitstudyError as error:
                message = f"{type(error).__name__}: {error}"
            write_text(f"{scene.name}\n{time.process_time() - started:.1f}\n{message}", path)
        return path.read_text().split("\n", 2)[2]


def price(scene):
    """Return the expected processor time of all that it takes to start a scene [s]."""
    seconds, whole = GEOMETRY, sources()[1]
    if STAGES["rest"].of(scene):
        seconds += REST * scene.pattern.loops * scene.pattern.rows
    for each in simulated(scene):
        parts = 1 if digest_of(each) in whole else each.solver.increments
        seconds += expected_cost(each).seconds / parts
    return seconds


def sample():
    """Return the names of some scenes that fit into the budget and are not known to end.

    Digests of names mix the families and leave the order alone when scenes are added.
    """
    left = BUDGET
    for name in sorted(
        plan().scenes.keys() - known()[0].keys(), key=lambda name: md5(name.encode()).digest()
    ):
        if (needs := price(plan().scenes[name])) <= min(left, DEAREST):
            left -= needs
            yield name


def pytest_generate_tests(metafunc):
    if "name" not in metafunc.fixturenames:
        return
    names = plan().scenes if metafunc.config.getoption("--full") else sample()
    metafunc.parametrize("name", list(names))


@pytest.fixture(scope="module")
def starts(full, tmp_path_factory):
    return Starts(ROOT / "run" / "starts" if full else tmp_path_factory.mktemp("starts"))


def test_scene_starts(name, starts, request):
    scene, (reasons, most) = plan().scenes[name], known()
    if (takes := max(expected_cost(each).memory for each in simulated(scene))) > most:
        pytest.skip(
            f"{name} is expected to take {takes:.0f} MB of memory, more than the {most:.0f} MB of {KNOWN.name}: "
            "raise the number in the first line of that file to run it"
        )
    why = starts.why_it_ends(scene)
    repeat = f"repeat with: python -m pytest --full '{request.node.nodeid}'"
    if why and name not in reasons:
        pytest.fail(f"{name} ends before its first increment: {why}\n{repeat}", pytrace=False)
    if name in reasons and not why:
        listed = f"listed in {KNOWN.name} ({reasons[name]})"
        pytest.fail(f"{name} is {listed} but starts: take it off the list\n{repeat}", pytrace=False)


def test_listed_scenes_exist():
    assert set(known()[0]) <= set(plan().scenes)
    assert all(known()[0].values())
