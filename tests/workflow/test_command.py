"""The `knitstudy` command as a user types it: a small knit is run, shown, killed and gone on with."""

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from knitstudy.datasets import read_dataset

SOURCE = Path(__file__).resolve().parents[2] / "src"
SMALL = ("--set", "pattern.loops=1", "--set", "pattern.rows=1")


@pytest.fixture
def start(tmp_path, coarse_pictures):
    """Function that starts the command in an empty folder."""
    return lambda *arguments: subprocess.Popen(
        [sys.executable, "-P", "-m", "knitstudy", *arguments],  # as the installed command
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(SOURCE)} | coarse_pictures,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Ctrl-C ends it, also where the tests run in the background of a shell.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


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
    (path,) = (tmp_path / "runs" / "simulation").glob("rom3d-*.nc")
    assert f"runs/simulation/{path.name}:" in ended.stderr
    quantities = dict(line.split("\t")[:2] for line in ended.stdout.splitlines())
    assert quantities["scene"] == path.stem
    assert float(quantities["strain at the end"]) == 0.01
    assert float(quantities["force along the load at the end"]) > 0

    earlier = path.stat().st_mtime_ns
    again = knitstudy("run", "rom3d-tie-course-coarse", *SMALL)
    assert again.stderr.count(": taken from runs/") == 3
    assert path.stat().st_mtime_ns == earlier

    shown = knitstudy("show", str(path), "--plot", "force.png")
    assert shown.returncode == 0, shown.stderr
    assert set(ended.stdout.splitlines()) < set(shown.stdout.splitlines())
    assert (tmp_path / "force.png").stat().st_size > 10_000


BEAMS = ("run", "extreme-beam", "--set", "solver.increments=8")
"""Beams in contact: a few seconds, and a state that remembers where yarns touched."""


def history(folder):
    """Return the only history of beams in a folder of results, without the times that were measured."""
    (path,) = (folder / "simulation").glob("*.nc")
    return read_dataset(path).drop_vars("seconds")


def end_on_the_way(process, restart, end):
    """End a command by a signal once it has written a restart file again; return its status and its messages."""
    before = {path: path.stat().st_mtime_ns for path in restart.glob("*.npz")}
    with process:
        while process.poll() is None:
            files = restart.glob("[!.]*.npz")
            if any(path.stat().st_mtime_ns != before.get(path) for path in files):
                break
            time.sleep(0.02)
        process.send_signal(end)
        return process.wait(), process.stderr.read()


def test_ended_runs_go_on_to_the_same_numbers(start, knitstudy, tmp_path):
    """Interrupted, killed after a further increment, and run to the end."""
    restart = tmp_path / "runs" / "restart"
    status, messages = end_on_the_way(start(*BEAMS), restart, signal.SIGINT)
    assert status == 130
    assert "Traceback" not in messages
    (line,) = [line for line in messages.splitlines() if line.startswith("error")]
    message = "error: stopped; stages that were done and the last converged increment are kept in runs"
    assert line.startswith(message)
    assert end_on_the_way(start(*BEAMS), restart, signal.SIGKILL)[0] == -signal.SIGKILL
    assert not list((tmp_path / "runs" / "simulation").glob("*.nc"))
    for left in tmp_path.rglob("*.partial*"):  # where it was killed while it wrote
        os.utime(left, (0, 0))
    ended = knitstudy(*BEAMS)
    assert ended.returncode == 0, ended.stderr
    assert "going on from increment" in ended.stderr
    assert not list(tmp_path.rglob("*.partial*"))
    assert not list(restart.glob("*.npz"))
    assert knitstudy(*BEAMS, "-o", "undisturbed").returncode == 0
    assert history(tmp_path / "runs").equals(history(tmp_path / "undisturbed"))


def test_two_runs_of_one_scene_at_once_spoil_nothing(start, tmp_path):
    slightly = ("run", "extreme-beam", "--set", "load.strain=0.003", "--set", "solver.increments=2")
    with start(*slightly) as first, start(*slightly) as second:
        messages = [process.stderr.read() for process in (first, second)]
    assert (first.returncode, second.returncode) == (0, 0), messages
    assert np.isfinite(history(tmp_path / "runs")["force"]).all()
    assert not list(tmp_path.rglob("*.partial*"))
    assert not list(tmp_path.rglob("*.npz"))


@pytest.mark.parametrize("closed", [">&- 2>&-", "<&- >&-"])
def test_closed_streams_are_no_error(tmp_path, closed):
    """Printed lines go nowhere, and not into a file that happens to take the place of the stream."""
    command = f"{shlex.quote(sys.executable)} -m knitstudy list {closed}"
    environment = os.environ | {"PYTHONPATH": str(SOURCE)}
    ended = subprocess.run(command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")


def test_reader_that_has_gone_ends_the_command_in_silence(start):
    with start("list") as process:
        process.stdout.close()
        messages = process.stderr.read()
    assert (process.returncode, messages) == (1, "")


def test_a_cell_writes_its_outputs_and_pictures(knitstudy, tmp_path):
    changes = ("--set", "outputs=[fields,vtu]", "--set", "solver.increments=2", "--set", "name=cell")
    assert knitstudy("run", "cell-course", *changes).returncode == 0
    runs = tmp_path / "runs" / "simulation"
    assert {"cell.nc", "cell.pvd", "cell.vtu"} <= {path.name for path in runs.iterdir()}
    shown = ("show", str(runs / "cell.nc"), "--picture", "cell.png", "--picture", "cell.html")
    ended = knitstudy(*shown, "--colour", "stress")
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "cell.png").stat().st_size > 10_000
    assert "von Mises stress (MPa)" in (tmp_path / "cell.html").read_text()
    ended = knitstudy("show", str(runs / "cell.nc"), "--picture", "cell.webp")
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "cell.webp").read_bytes()[8:12] == b"WEBP"
    refused = knitstudy("show", str(runs / "cell.nc"), "--picture", "cell.gif")
    assert (refused.returncode, refused.stderr) == (
        1,
        "error: cell.gif: must end with .png, .pdf, .webp, .html or .stl\n",
    )


EVIL = "open({path!r}, 'a').write(__name__)\n"


def test_no_code_of_the_working_folder_runs(knitstudy, tmp_path):
    """Profiles, modules called as those of Python, and modules where Snakemake puts its scripts."""
    ran = EVIL.format(path=str(tmp_path / "RAN"))
    (tmp_path / "profiles" / "default").mkdir(parents=True)
    (tmp_path / "profiles" / "default" / "config.yaml").write_text("configfiles: [evil.yaml]\n")
    (tmp_path / "evil.yaml").write_text("plugins: [evil]\n")
    (tmp_path / ".snakemake" / "scripts").mkdir(parents=True)
    for name in ("evil", "json", "signal", "pickle", "numpy", "pyvista", "sitecustomize"):
        for folder in (tmp_path, tmp_path / ".snakemake" / "scripts"):
            (folder / f"{name}.py").write_text(ran)
    ended = knitstudy("study", "ci", "--", "results/geometry/pair90.nc")
    assert ended.returncode == 0, ended.stderr
    drawn = knitstudy("loop", "cell-course", "-o", "loop.png")
    assert drawn.returncode == 0, drawn.stderr
    assert (tmp_path / "loop.png").stat().st_size > 10_000
    assert not (tmp_path / "RAN").exists(), (tmp_path / "RAN").read_text()


def test_a_profile_that_somebody_names_is_read(knitstudy, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "config.yaml").write_text("dry-run: true\n")
    ended = knitstudy("study", "ci", "--", "results/geometry/pair90.nc", "--profile", "mine")
    assert ended.returncode == 0, ended.stderr
    assert "     1  geometry" in ended.stderr
    assert not (tmp_path / "results" / "geometry").exists()


def test_a_study_that_is_ended_says_so_and_ends_its_jobs(start, tmp_path):
    """A job may take hours; what it has done is kept."""
    restart = tmp_path / "results" / "restart"
    study = ("study", "ci", "--", "results/simulation/pair-slid-coarse.nc")
    status, messages = end_on_the_way(start(*study), restart, signal.SIGTERM)
    assert status == 130, messages
    assert "ending the jobs that run; what they have done is kept\n" in messages
    errors = [line for line in messages.splitlines() if line.startswith("error")]
    assert len(errors) == 1, errors
    assert errors[0].startswith("error: stopped; finished files are in results")
    assert list(restart.glob("*.npz"))
    assert not (tmp_path / "results" / "simulation" / "pair-slid-coarse.nc").exists()


def test_a_link_in_the_place_of_the_lock_is_refused(knitstudy, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "study.lock").symlink_to(tmp_path / "elsewhere")
    ended = knitstudy("study", "ci", "--", "results/geometry/pair90.nc")
    assert ended.returncode == 1
    assert ended.stderr == "error: run/study.lock: is not a regular file, and is not written to; delete it\n"
    assert not (tmp_path / "elsewhere").exists()


def test_a_file_from_the_future_is_named(knitstudy, tmp_path):
    assert knitstudy("study", "ci", "--", "results/geometry/pair90.nc").returncode == 0
    later = time.time() + 1e7
    os.utime(tmp_path / "results" / "geometry" / "pair90.nc", (later, later))
    ended = knitstudy("study", "ci", "--", "results/mesh/pair-slid-coarse.nc")
    assert ended.returncode == 1
    (line,) = [line for line in ended.stderr.splitlines() if line.startswith("error")]
    assert line.startswith("error: results/geometry/pair90.nc was written in the future, on ")
    assert "set the clock, and type `touch` and its name" in line


def test_a_dry_run_lists_the_jobs_and_runs_none(knitstudy, tmp_path):
    ended = knitstudy("study", "ci", "--", "results/geometry/plain3x3.nc", "--dry-run")
    assert ended.returncode == 0, ended.stderr
    assert "     1  geometry" in ended.stderr
    assert "nothing has been run" in ended.stdout
    assert not (tmp_path / "results" / "geometry").exists()
