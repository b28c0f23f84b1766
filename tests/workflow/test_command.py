"""The `knitstudy` command as a user types it: a small knit is run, shown, killed and gone on with."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src"
SMALL = ("--set", "pattern.loops=1", "--set", "pattern.rows=1")


@pytest.fixture
def start(tmp_path):
    def run(*arguments):
        return subprocess.Popen(
            [sys.executable, "-m", "knitstudy", *arguments],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(SOURCE)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    return run


@pytest.fixture
def knitstudy(start):
    def run(*arguments):
        process = start(*arguments)
        output, messages = process.communicate()
        return subprocess.CompletedProcess(arguments, process.returncode, output, messages)

    return run


def test_run_and_show(knitstudy, tmp_path):
    ended = knitstudy("run", "rom3d-tie-course-coarse", *SMALL)
    assert ended.returncode == 0, ended.stderr
    (path,) = (tmp_path / "results" / "rom").glob("*.nc")
    assert f"results/rom/{path.name}:" in ended.stderr
    quantities = dict(line.split("\t")[:2] for line in ended.stdout.splitlines())
    assert quantities["scene"] == path.stem
    assert float(quantities["strain at the end"]) == 0.01
    assert float(quantities["force along the load at the end"]) > 0

    earlier = path.stat().st_mtime_ns
    again = knitstudy("run", "rom3d-tie-course-coarse", *SMALL)
    assert again.stderr.count(": taken from results/") == 5
    assert path.stat().st_mtime_ns == earlier

    shown = knitstudy("show", str(path), "--plot", "force.png")
    assert shown.returncode == 0, shown.stderr
    assert set(ended.stdout.splitlines()) < set(shown.stdout.splitlines())
    assert (tmp_path / "force.png").stat().st_size > 10_000


def test_killed_run_goes_on(start, knitstudy, tmp_path):
    arguments = ("run", "dns-tie-course-coarse", *SMALL, "--set", "solver.increments=12")
    restart = tmp_path / "results" / "restart"
    with start(*arguments) as process:
        while process.poll() is None and not list(restart.glob("dns-*.npz")):
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (tmp_path / "results" / "dns").exists()

    ended = knitstudy(*arguments)
    assert ended.returncode == 0, ended.stderr
    assert "going on from increment" in ended.stderr
    assert list((tmp_path / "results" / "dns").glob("dns-tie-course-coarse-*.nc"))
    assert not list(restart.glob("*.npz"))
