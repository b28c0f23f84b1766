"""CalculiX as the independent code: run a deck, and read its results and its cost."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knitstudy.errors import ConvergenceError, DataFileError

PROGRAM = "ccx"

LAUNCHER = """
import os, sys, time
start = time.perf_counter()
child = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)])
_, status, usage = os.wait4(child, 0)
cpu = usage.ru_utime + usage.ru_stime
print(os.waitstatus_to_exitcode(status), time.perf_counter() - start, cpu, 1024 * usage.ru_maxrss)
"""
"""A small process to start CalculiX from: a child's largest resident size begins with that of its parent."""


@dataclass(frozen=True, eq=False)
class Run:
    """Results and cost of one run of CalculiX."""

    step: np.ndarray  # (i,) step of every increment, from 1; decks with contact begin with a step of rest
    time: np.ndarray  # (i,) at the end of every increment; a step lasts as long as its number of increments
    force: np.ndarray  # (i, 3) total reaction of the driven set [N]
    iterations: np.ndarray  # (i,) Newton iterations, including failed attempts
    seconds: float  # wall time
    cpu_seconds: float  # of all threads
    memory_growth: int  # largest resident size over that of a process that prints its version [bytes]
    memory_peak: int  # [bytes]
    log: str

    @property
    def warnings(self) -> list[str]:
        """Warnings without repetitions."""
        found = re.findall(r"\*WARNING[^\n]*(?:\n {9}[^\n]*)*", self.log)
        return list(dict.fromkeys(" ".join(text.split()) for text in found))


def available() -> bool:
    """Whether CalculiX can be run here."""
    return shutil.which(PROGRAM) is not None


def run(deck: Path | str, threads: int = 1) -> Run:
    """Run a deck in a scratch folder and read its results.

    Parameters
    ----------
    deck : Path or str
        Keyword file that prints the total reaction of one node set.
    threads : int
        Threads of element loops and of the equation solver.

    Raises
    ------
    DataFileError
        If CalculiX is not installed, the deck is missing, or there are no results.
    ConvergenceError
        If CalculiX ended with an error.
    """
    if not available():
        raise DataFileError(
            f"{PROGRAM} is not on the PATH; install CalculiX (Debian: calculix-ccx) to compare"
        )
    deck = Path(deck)
    if not deck.is_file():
        raise DataFileError(f"{deck}: there is no such file")
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        shutil.copyfile(deck, place / "deck.inp")
        *_, bare, _ = _measure(["-v"], place, threads)
        status, seconds, cpu_seconds, peak, log = _measure(["-i", "deck"], place, threads)
        if status or "*ERROR" in log:
            errors = re.findall(r"\*ERROR[^\n]*(?:\n {7}[^\n]*)*", log) or ["it printed no error"]
            raise ConvergenceError(
                f"{deck}: CalculiX ended with status {status}: {' '.join(errors[0].split())}"
            )
        moments, force = read_totals(place / "deck.dat")
        step, iterations = read_iterations(place / "deck.sta")
    return Run(step, moments, force, iterations, seconds, cpu_seconds, peak - bare, peak, log)


def read_totals(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (i,) and total forces (i, 3) in a `.dat` file.

    Raises
    ------
    DataFileError
        If there are none.
    """
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    number = r"([-+]?\d\.\d+E[-+]\d+)"
    blocks = re.findall(rf"total force[^\n]*time\s+{number}\s+{number}\s+{number}\s+{number}", text)
    if not blocks:
        raise DataFileError(f"{path}: no total force of a node set; the deck must print it")
    values = np.array(blocks, dtype=float)
    return values[:, 0], values[:, 1:]


def read_iterations(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return step (i,) and Newton iterations (i,) of every increment in a `.sta` file, including failed attempts.

    Raises
    ------
    DataFileError
        If there are none.
    """
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    rows = re.findall(r"^\s*(\d+)\s+(\d+)\s+\d+U?\s+(\d+)\s", text, flags=re.MULTILINE)
    if not rows:
        raise DataFileError(f"{path}: no increments; CalculiX did not get that far")
    *place, count = np.array(rows, dtype=int).T
    increments, owner = np.unique(place, axis=1, return_inverse=True)
    return increments[0], np.bincount(owner.ravel(), count).astype(int)


def _measure(arguments: list[str], folder: Path, threads: int) -> tuple[int, float, float, int, str]:
    """Run CalculiX in a folder; return its status, wall and processor time (s), peak memory (bytes) and output."""
    count = str(threads)
    settings = {"OMP_NUM_THREADS": count, "CCX_NPROC_EQUATION_SOLVER": count, "CCX_NPROC_STIFFNESS": count}
    with open(folder / "log.txt", "wb") as log:
        answer = subprocess.run(
            [sys.executable, "-I", "-S", "-c", LAUNCHER, PROGRAM, *arguments],
            cwd=folder,
            env=os.environ | settings,
            stdout=subprocess.PIPE,
            stderr=log,
            check=True,
        )
    status, seconds, cpu_seconds, peak = answer.stdout.split()
    text = (folder / "log.txt").read_text(encoding="utf-8", errors="replace")
    return int(status), float(seconds), float(cpu_seconds), int(peak), text
