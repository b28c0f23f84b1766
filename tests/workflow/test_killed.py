"""A run that was killed goes on: lock, incomplete files and converged increments included."""

import os
import signal
import time

import numpy as np

from knitstudy.datasets import read_dataset

LOG = "logs/simulation/pair-slid-coarse.log"
HISTORY = "results/simulation/pair-slid-coarse.nc"
SLIDING = 8  # an increment in which the upper yarn slides on the lower one
PATIENCE = 120  # seconds until a simulation that reports no increment counts as failed


def wait_until(holds, what, patience=PATIENCE):
    deadline = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < deadline, f"no {what} within {patience} s"
        time.sleep(0.05)


def increments_kept(folder):
    """Return the last increment in the restart file of the only simulation, -1 if there is none."""
    for path in folder.glob("[!.]*.npz"):
        with np.load(path) as archive:
            return int(archive["index"])
    return -1


def test_killed_simulation_goes_on(checkout, meshed):
    """Killed while one yarn slides on the other: the history of contact goes on as well."""
    log, only = meshed.folder / LOG, ("--", "--until", HISTORY)
    process = meshed.start_study("ci", *only)
    wait_until(
        lambda: increments_kept(meshed.folder / "results" / "restart") >= SLIDING,
        "increment in which yarns slide",
    )
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (meshed.folder / HISTORY).exists()
    last = increments_kept(meshed.folder / "results" / "restart")

    # One scene is enough here; the rest of the study is made as in any other run.
    ended = meshed.study("ci", *only)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    text = log.read_text()
    assert text.index(f"going on from increment {last} ") < text.index(f"increment {last + 1}: ")
    assert f"increment {last}: " not in text, "what had converged is not computed again"

    force = read_dataset(meshed.folder / HISTORY).force
    reference = read_dataset(checkout.folder / HISTORY).force
    # The bar for restarts: 1e-6 of the largest force over the whole curve.
    np.testing.assert_allclose(force, reference, rtol=0, atol=1e-6 * float(abs(reference).max()))


def test_second_study_at_once_is_refused(fresh):
    process = fresh.start_study("ci")
    try:
        lock = fresh.folder / "run" / "study.lock"
        wait_until(lambda: lock.exists() and str(process.pid) in lock.read_text(), "lock")
        ended = fresh.study("ci")
        assert ended.returncode == 1
        assert f"a study is running here already (process {process.pid})" in ended.stderr
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
