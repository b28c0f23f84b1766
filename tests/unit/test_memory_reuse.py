"""Memory that a load path asks for again and again is not cleared by the system every time."""

import os
import platform
import subprocess
import sys

import pytest

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
