"""Runs that are ended at random moments: the files that they leave, and whether they go on to the same numbers.

    python benchmarks/interruptions.py [--runs 100] [--seed 1] [--minutes 7]

Every run is a process of its own in a folder of its own. It is killed, terminated or interrupted, finds the disk full,
or has another run of the same scene beside it. Afterwards all files must be readable, at most the last increment may be
lost, and the same command must end with the history of an undisturbed run. Prints, keeps and continues
``results/tables/interruptions.csv``; the exit status is 1 if a run fails this.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import logging
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.datasets import read_dataset, read_table, write_table
from knitstudy.knit.loading.run import Progress, ReportProgress
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate
from knitstudy.run.stages import STAGES

TABLE = Path("results/tables/interruptions.csv")

SCENES = {
    "network": ("extreme-rom3d", {"solver.increments": 25, "load.strain": 0.1}),
    "beams": ("extreme-beam", {"solver.increments": 8}),
    "solid yarns": ("extreme-yarns-tie", {"solver.increments": 8}),
}
"""Scenes of a few seconds: without history, with contact, with solid yarns."""

SIGNALS = {"killed": signal.SIGKILL, "terminated": signal.SIGTERM, "interrupted": signal.SIGINT}
WAYS = (*SIGNALS, "disk full", "two at once")

LEFT_FULL = (500, 200_000)
"""Smallest and largest length of a file on a full disk [bytes]."""

STUCK = 120.0
"""Time limit of a run [s]."""

UNENDED = f"did not end within {STUCK:g} s"
"""Message of such a run."""

CONTEXT = multiprocessing.get_context("fork")  # what is imported here need not be imported again


@dataclass(frozen=True)
class Bench:
    """A scene, the folder that its runs begin with, and its history without disturbance.

    Attributes
    ----------
    scene : Scene
    begun : Path
        With the results that the scene is made from.
    history : Dataset
    seconds : float
        Wall time of a run.
    """

    scene: Scene
    begun: Path
    history: xr.Dataset
    seconds: float


def main() -> int:
    """Disturb runs, print and keep the table; return the exit status."""
    options = _options()
    os.environ["OMP_NUM_THREADS"] = "1"  # threads of this process would be missing in its forks
    plan, begun = Plan.of(), time.monotonic()
    table = read_table(TABLE, needs=("run", "seed", "wrong")) if TABLE.exists() else pd.DataFrame()
    if len(table) and set(table["seed"]) != {options.seed}:
        table = table[:0]
    report = Progress("interruptions", every=1.0)
    with tempfile.TemporaryDirectory() as scratch:
        benches = {name: _bench(name, plan, Path(scratch)) for name in SCENES}
        for number in range(len(table), options.runs):
            if time.monotonic() - begun > 60 * options.minutes:
                break
            name = list(benches)[number % len(benches)]
            way = WAYS[number // len(benches) % len(WAYS)]
            random = np.random.default_rng((options.seed, number))
            row = disturbed(benches[name], way, random, plan, Path(scratch) / f"run {number}")
            row = {"run": number + 1, "seed": options.seed, "scene": name, **row}
            table = pd.concat([table, pd.DataFrame([row])], ignore_index=True)
            write_table(table, TABLE)
            report((number + 1) / options.runs, f"{name}, {way}: {row['wrong'] or 'goes on'}")
    wrong = table[table["wrong"].fillna("") != ""]
    print(table.to_string(index=False, float_format="{:.3g}".format, na_rep="", max_colwidth=90))
    print(f"{len(table) - len(wrong)} of {len(table)} runs went on to the same numbers: {TABLE}")
    return 1 if len(wrong) else 0


def disturbed(bench: Bench, way: str, random: np.random.Generator, plan: Plan, folder: Path) -> dict:
    """Disturb a run in one way, repeat it, and return a row of the table."""
    shutil.copytree(bench.begun, folder)
    row: dict = {"way": way}
    if way == "two at once":
        pair = [_started(bench.scene, plan, folder) for _ in range(2)]
        ended = [run.ended() for run in pair]
        row |= {"said": " / ".join(filter(None, ended))}
        wrong = [f"one of two: {said}" for said in ended if said]
    elif way == "disk full":
        low, high = np.log(LEFT_FULL)
        row["moment"] = int(np.exp(random.uniform(low, high)))
        run = _started(bench.scene, plan, folder, largest=row["moment"])
        row["said"] = run.ended()
        wrong = [] if "Traceback" not in row["said"] else ["no message of one line"]
    else:
        row["moment"] = float(random.uniform(0, bench.seconds))
        run = _started(bench.scene, plan, folder)
        time.sleep(row["moment"])
        run.end(SIGNALS[way])
        row |= {"said": run.ended(), "reported": run.reported(), "kept": _kept(folder)}
        finished = (folder / STAGES["simulation"].path(bench.scene.name)).exists()
        lost = 0 if finished else row["reported"] - max(row["kept"], 0)
        wrong = [f"{lost} increments lost"] if lost > 1 else []
        wrong += [UNENDED] if row["said"] == UNENDED else []
    wrong += _unreadable(folder)
    for left in folder.rglob("*.partial*"):  # deleted once nobody has changed them for an hour
        os.utime(left, (0, 0))
    again = _started(bench.scene, plan, folder)
    if said := again.ended():
        wrong.append(f"does not go on: {said}")
    else:
        history = read_dataset(folder / STAGES["simulation"].path(bench.scene.name))
        if not _comparable(history).equals(_comparable(bench.history)):
            wrong.append("another history")
    wrong += [f"{path.name} stays" for path in folder.rglob("*.partial*")]
    shutil.rmtree(folder)
    return row | {"wrong": "; ".join(wrong)}


class Started:
    """A run in a process of its own."""

    def __init__(self, process: multiprocessing.Process, log: Path, said: Path) -> None:
        self._process, self._log, self._said = process, log, said

    def end(self, order: signal.Signals) -> None:
        """Send a signal, to a process that may have ended by itself."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, order)

    def ended(self) -> str:
        """Wait for the end and return the error message, empty without an error."""
        self._process.join(STUCK)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
            return UNENDED
        text = self._said.read_text(encoding="utf-8") if self._said.exists() else ""
        died = f"status {self._process.exitcode}" if self._process.exitcode else ""
        return text or died

    def reported(self) -> int:
        """Return the number of the last increment that was reported."""
        return len(self._log.read_bytes()) - 1 if self._log.exists() else -1


def _started(scene: Scene, plan: Plan, folder: Path, largest: int | None = None) -> Started:
    marks = Path(tempfile.mkdtemp(dir=folder.parent))
    log, said = marks / "log", marks / "said"
    process = CONTEXT.Process(target=_run, args=(scene, plan, folder, log, said, largest))
    process.start()
    return Started(process, log, said)


def _run(scene: Scene, plan: Plan, folder: Path, log: Path, said: Path, largest: int | None) -> None:
    """Simulate a scene, write a byte for every increment, and keep the error message."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    marks = os.open(log, os.O_CREAT | os.O_WRONLY)
    words = os.open(said, os.O_CREAT | os.O_WRONLY)

    def begin(label: str) -> ReportProgress:
        return lambda done, note: os.write(marks, b".") if label.endswith(scene.name) else None

    if largest is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY))
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            simulate(scene, folder, progress=begin, plan=plan)
    except (Exception, KeyboardInterrupt) as error:
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        os.write(words, f"{type(error).__name__}: {' '.join(str(error).split())}".encode())
        os._exit(1)


def _kept(folder: Path) -> int:
    """Return the increment in the only restart file, -1 where there is none."""
    for path in (folder / "restart").glob("[!.]*.npz"):
        with np.load(path) as archive:
            return int(archive["index"])
    return -1


def _unreadable(folder: Path) -> list[str]:
    """Return the errors of reading files with the names of results."""
    found = []
    for path in sorted(folder.rglob("[!.]*.*")):
        try:
            if path.suffix == ".nc":
                read_dataset(path)
            elif path.suffix == ".npz":
                with np.load(path) as archive:
                    dict(archive)
        except Exception as error:  # whatever bytes are there
            found.append(f"{path.name} is unreadable: {error}")
    return found


def _comparable(history: xr.Dataset) -> xr.Dataset:
    """Return a history without measured times."""
    return history.drop_vars("seconds")


def _bench(name: str, plan: Plan, scratch: Path) -> Bench:
    """Run a scene undisturbed, and keep the results that it needs."""
    base, changes = SCENES[name]
    scene = plan.labelled(plan.scenes[base].vary(changes))
    begun = scratch / f"begun {name}"
    history = simulate(scene, begun, plan=plan).history
    # Disturbed runs make all results of the scene themselves.
    for stage in STAGES.values():
        if stage.of(scene):
            (begun / stage.path(scene)).unlink(missing_ok=True)
    whole = scratch / f"whole {name}"
    shutil.copytree(begun, whole)
    started = time.monotonic()
    if said := _started(scene, plan, whole).ended():
        sys.exit(f"error: {name} fails without disturbance: {said}")
    seconds = time.monotonic() - started
    shutil.rmtree(whole)
    return Bench(scene, begun, history, seconds)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=100, help="runs that are disturbed (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the moments (%(default)s)")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin none after so many")
    return parser.parse_args()


if __name__ == "__main__":
    logging.getLogger("knitstudy").setLevel(logging.ERROR)
    sys.exit(main())
