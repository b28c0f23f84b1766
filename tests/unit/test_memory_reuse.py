"""Memory that a load path asks for again and again is not cleared by the system every time."""

import os
import platform
import subprocess
import sys

import numpy as np
import pytest
from tubes import crossing

from knitstudy.mechanics.batches import Reserve
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact

# Pages that the system clears while arrays, 120 MB in all, are made once more
CLEARED = """
import resource
import numpy as np
from knitstudy.mechanics.batches import reuse_memory
reuse_memory()
for _ in range(2):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    arrays = [np.zeros(250_000) + 1 for _ in range(60)]
    del arrays
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="options of glibc")
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


def test_tangents_of_contact_share_memory_until_a_search_takes_it():
    nodes, grids, upper = crossing(0.02)
    after = nodes + np.where(upper[:, None], [0, 0, -0.08], 0)
    contact = Contact(nodes, Grids(grids), Coulomb(10.0, 7.0, 0.3), margin=0.2, overlap=1e-3)
    points = contact.points(after, nodes, ContactHistory.empty())
    first = contact.forces(points, stiffness=True)
    assert first.stiffness.nnz
    memory = address(contact.reserve.arrays((1,))[0])
    second = contact.forces(points, stiffness=True)
    assert address(contact.reserve.arrays((1,))[0]) == memory, "matrices refer to no memory of the reserve"
    np.testing.assert_array_equal(first.stiffness.data, second.stiffness.data)
    apart = contact.points(nodes, nodes, ContactHistory.empty())
    assert not contact.forces(apart, stiffness=True).stiffness.nnz
    contact.points(after, after, ContactHistory.empty())
    assert contact.reserve.size == 0
