"""CalculiX as the independent code: run a deck, and read what it found and what it cost."""

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
print(os.waitstatus_to_exitcode(status), time.perf_counter() - start, cpu, usage.ru_maxrss)
"""
"""A small process to start CalculiX from: a child's largest resident size begins with that of its parent."""


@dataclass(frozen=True, eq=False)
class Run:
    """What one run of CalculiX found, and what it cost.

    Attributes
    ----------
    step : ndarray (i,) of int
        Step that every increment belongs to, from 1; decks with contact begin with one in which nothing is driven.
    time : ndarray (i,)
        Time at the end of every increment; a step lasts as long as the number of increments asked for.
    force : ndarray (i, 3)
        Total reaction of the driven set, N.
    iterations : ndarray (i,) of int
        Newton iterations of every increment, those of failed attempts included.
    seconds : float
        Wall time of the whole process.
    cpu_seconds : float
        Processor time of all its threads; more telling than the wall time where the machine is shared.
    memory_growth : int
        Largest resident size over that of a process that only prints its version, bytes.
    memory_peak : int
        Largest resident size, bytes.
    log : str
        Everything that it printed.
    """

    step: np.ndarray
    time: np.ndarray
    force: np.ndarray
    iterations: np.ndarray
    seconds: float
    cpu_seconds: float
    memory_growth: int
    memory_peak: int
    log: str

    @property
    def warnings(self) -> list[str]:
        """Warnings that it printed, without repetitions."""
        found = re.findall(r"\*WARNING[^\n]*(?:\n {9}[^\n]*)*", self.log)
        return list(dict.fromkeys(" ".join(text.split()) for text in found))


def available() -> bool:
    """Whether CalculiX can be run here."""
    return shutil.which(PROGRAM) is not None


def run(deck: Path | str, threads: int = 1, folder: Path | str | None = None) -> Run:
    """Run a deck in a scratch folder and read its results.

    Parameters
    ----------
    deck : Path or str
        Keyword file that prints the total reaction of one node set.
    threads : int
        Threads of element loops and of the equation solver.
    folder : Path or str, optional
        Where its files stay; by default they are deleted.

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
        place = Path(folder or scratch)
        place.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(deck, place / "deck.inp")
        bare = _measure([PROGRAM, "-v"], place, threads)
        process = _measure([PROGRAM, "-i", "deck"], place, threads)
        if process.status or "*ERROR" in process.log:
            errors = re.findall(r"\*ERROR[^\n]*(?:\n {7}[^\n]*)*", process.log) or ["it printed no error"]
            raise ConvergenceError(
                f"{deck}: CalculiX ended with status {process.status}: {' '.join(errors[0].split())}"
            )
        moments, force = read_totals(place / "deck.dat")
        step, iterations = read_iterations(place / "deck.sta")
    return Run(
        step=step,
        time=moments,
        force=force,
        iterations=iterations,
        seconds=process.seconds,
        cpu_seconds=process.cpu_seconds,
        memory_growth=process.peak - bare.peak,
        memory_peak=process.peak,
        log=process.log,
    )


def read_totals(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times (i,) and total forces (i, 3) that a `.dat` file holds.

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
    """Step (i,) and Newton iterations (i,) of every increment in a `.sta` file, failed attempts included.

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


@dataclass(frozen=True)
class _Process:
    """What an ended process printed, its status, its times (s) and its largest resident size (bytes)."""

    log: str
    status: int
    seconds: float
    cpu_seconds: float
    peak: int


def _measure(command: list[str], folder: Path, threads: int) -> _Process:
    """Run a command in a folder and measure it."""
    count = str(threads)
    settings = {"OMP_NUM_THREADS": count, "CCX_NPROC_EQUATION_SOLVER": count, "CCX_NPROC_STIFFNESS": count}
    with open(folder / "log.txt", "wb") as log:
        answer = subprocess.run(
            [sys.executable, "-I", "-S", "-c", LAUNCHER, *command],
            cwd=folder,
            env=os.environ | settings,
            stdout=subprocess.PIPE,
            stderr=log,
            check=True,
        )
    status, seconds, cpu_seconds, kibibytes = answer.stdout.split()
    return _Process(
        log=(folder / "log.txt").read_text(encoding="utf-8", errors="replace"),
        status=int(status),
        seconds=float(seconds),
        cpu_seconds=float(cpu_seconds),
        peak=int(kibibytes) * 1024,
    )
