"""Run a function in a process of its own, and measure its time and memory there.

``run("linear_solvers:solve", threads=2, solver="lu")`` imports the module, notes the memory of the bare process, calls
the function and returns the dictionary that it gives, with ``wall_s``, ``memory_growth_MB`` and ``memory_peak_MB``. A
function that first loads what it works on calls `ready` when the measurement is to begin.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from knitstudy.memory import Memory

HERE = Path(__file__).resolve().parent


def run(function: str, threads: int = 2, **options) -> dict:
    """Return what a function of a benchmark module measured in a fresh process.

    Raises
    ------
    SystemExit
        With the process's error message, if it failed.
    """
    done = subprocess.run(
        [sys.executable, str(HERE / "measure.py"), function, json.dumps(options)],
        env={**os.environ, "OMP_NUM_THREADS": str(threads)},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"error: the benchmark {function} {options} ended with status {done.returncode}")
    return json.loads(done.stdout.splitlines()[-1])


class _Start:
    """When and at what memory the measurement began."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.time, self.memory = time.perf_counter(), Memory()


START = _Start()


def ready() -> None:
    """Begin the measurement now: inputs are loaded."""
    START.reset()


def main(function: str, options: str) -> None:
    """Call the function and print one line of JSON."""
    module, name = function.split(":")
    sys.modules["measure"] = sys.modules["__main__"]
    call = getattr(importlib.import_module(module), name)
    ready()
    result = call(**json.loads(options))
    growth, peak = START.memory.measure()
    result |= {
        "wall_s": time.perf_counter() - START.time,
        "memory_growth_MB": growth / 1e6,
        "memory_peak_MB": peak / 1e6,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
