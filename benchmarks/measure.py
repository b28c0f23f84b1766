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
from pathlib import Path

from knitstudy.interruption import end_with_parent
from knitstudy.knit.loading.history import Meter

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


_meter = Meter()


def ready() -> None:
    """Begin the measurement now: inputs are loaded."""
    global _meter
    _meter = Meter()


def main(function: str, options: str) -> None:
    """Call the function and print one line of JSON."""
    end_with_parent()
    module, name = function.split(":")
    sys.modules["measure"] = sys.modules["__main__"]
    call = getattr(importlib.import_module(module), name)
    ready()
    result = call(**json.loads(options))
    cost = _meter.read()
    result |= {
        "wall_s": cost["wall_seconds"],
        "memory_growth_MB": cost["memory_growth"] / 1e6,
        "memory_peak_MB": cost["memory_peak"] / 1e6,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
