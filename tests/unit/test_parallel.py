"""Threads: how many there are, and that results do not depend on it; memory that is kept."""

import os
import platform
import subprocess
import sys
import threading

import numpy as np
import pytest
from refusals import refusal

from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.simulate import build
from knitstudy.mechanics.contact.friction import ContactHistory
from knitstudy.mechanics.contact.solid import SolidState
from knitstudy.mechanics.core.batches import VARIABLE, Reserve, by_parts, share, threads


@pytest.mark.parametrize("value", ["x", "0", "-1", "1.5", ",2", "x,2", "²"])
def test_a_number_of_threads_that_is_none(monkeypatch, value):
    monkeypatch.setenv(VARIABLE, value)
    with pytest.raises(ConfigurationError) as caught:
        threads()
    assert f"{VARIABLE} is {value!r}" in str(caught.value)
    assert "a whole number of at least 1" in str(caught.value)


@pytest.mark.parametrize("count", ["1", "2"])
def test_the_first_error_ends_it(monkeypatch, count):
    monkeypatch.setenv(VARIABLE, count)

    def work(number):
        if number == 3:
            raise ConvergenceError("three")

    with refusal("three"):
        share(work, 10)


def test_shared_work_may_share(monkeypatch):
    """Work that is shared from within shared work is done by the thread that asks for it."""
    monkeypatch.setenv(VARIABLE, "2")

    def rows(row):
        own = threading.get_ident()
        return share(lambda column: (row, column, threading.get_ident() == own), 3)

    assert share(rows, 4) == [[(row, column, True) for column in range(3)] for row in range(4)]
    assert share(rows, 1) == [[(0, column, True) for column in range(3)]]  # and afterwards again


STARTED = """
import signal, threading
from knitstudy.mechanics.core.batches import share
start = threading.Thread.start
def interrupted(thread):
    start(thread)
    signal.raise_signal(signal.SIGINT)
threading.Thread.start = interrupted
signal.signal(signal.SIGINT, signal.default_int_handler)
share(lambda number: number, 2)
"""


def test_parts_are_put_together_again():
    """Arrays and pairs of points alike, whatever the size of a part."""
    number = np.arange(7)
    every = ContactHistory.of_open(number, number % 2, np.stack([number, -number], axis=1), np.zeros(()))
    for size in (3, 7, 100):
        squares, odd = by_parts(
            lambda part: (number[part] ** 2, every[part][np.flatnonzero(number[part] % 2)]), len(number), size
        )
        np.testing.assert_array_equal(squares, number**2)
        np.testing.assert_array_equal(odd.point, [1, 3, 5])
        np.testing.assert_array_equal(odd.xi, [[1, -1], [3, -3], [5, -5]])
    some = odd.joined(every, chosen=np.array([2, 3 + 6, 0]))
    np.testing.assert_array_equal(some.point, [5, 6, 1])
    assert some.search_status is None
    assert some.dissipated == 0


def test_an_interruption_while_a_thread_starts_ends_the_program():
    """Nobody would tell that thread to end, and the program would wait for it."""
    command, two = [sys.executable, "-c", STARTED], os.environ | {VARIABLE: "2"}
    ended = subprocess.run(command, env=two, capture_output=True, text=True, timeout=60)
    assert ended.returncode != 0
    assert ended.stderr.rstrip().endswith("KeyboardInterrupt")


@pytest.mark.parametrize("element", ["one_point", "quadratic"])
def test_forces_and_tangents_do_not_depend_on_threads(monkeypatch, plain_scene, knit_of, element):
    keys = {"pattern.loops": 1, "pattern.rows": 1, "mesh.size": 1, "tie.radius": 0.3, "mesh.element": element}
    scene = plain_scene.vary({"fidelity": "hexahedra", "gates.elements_across": 2.0} | keys)
    knit = knit_of(scene)
    mesh = mesh_fabric(knit, scene.mesh.size)

    def response(count):
        monkeypatch.setenv(VARIABLE, count)
        model = build(scene, knit, mesh=mesh).observer.model
        shift = 1e-5 * np.random.default_rng(0).normal(size=(model.size // 3, 3))
        return [model.respond(SolidState(scale * shift), stiffness=True) for scale in (0.5, 1.0)][1]

    one, three = response("1"), response("3")
    np.testing.assert_array_equal(one.force, three.force)
    np.testing.assert_array_equal(one.stiffness.data, three.stiffness.data)
    assert one.energy == three.energy


# Pages that the system clears while arrays, 120 MB in all, are made once more
CLEARED = """
import resource
import numpy as np
from knitstudy.mechanics.core.batches import reuse_memory
reuse_memory()
for _ in range(2):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    arrays = [np.zeros(250_000) + 1 for _ in range(60)]
    del arrays
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc",
    reason="options of malloc that glibc alone has: runs on Linux with glibc",
)
@pytest.mark.parametrize(("users", "kept"), [({}, True), ({"MALLOC_TRIM_THRESHOLD_": "131072"}, False)])
def test_memory_is_kept_unless_the_user_decides(users, kept):
    others = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    command = [sys.executable, "-c", CLEARED]
    done = subprocess.run(command, env=others | users, capture_output=True, text=True, check=True)
    assert (int(done.stdout) < 1000) == kept, done.stdout


def address(array):
    return array.ctypes.data


def test_arrays_in_use_keep_their_memory():
    reserve = Reserve()
    one, other = reserve.arrays((20,), (3, 4))
    assert not np.shares_memory(one, other)
    part, first = other[1:], address(one)
    del one, other
    (new,) = reserve.arrays((5, 2))
    assert not np.shares_memory(new, part)
    del new, part
    (kept,) = reserve.arrays((2, 5))
    assert address(kept) != first, "the memory of arrays that were in use is theirs"
    reserve.give_back()
    kept[:] = 1.0
    assert reserve.size == 0
