"""Mistakes of a user end with one message and status 1, and earlier results stay."""

import os
import signal
import subprocess

from knitstudy.datasets import read_dataset

RESULT = "results/simulation/pair-slid-coarse.nc"


def one_message(ended):
    """Return the only line of a failed run that is not progress."""
    assert ended.returncode == 1
    lines = [line for line in (ended.stdout + ended.stderr).splitlines() if line.startswith("error")]
    assert len(lines) == 1, lines
    assert "Traceback" not in ended.stdout + ended.stderr
    return lines[0]


def test_wrong_configuration_runs_nothing(fresh):
    fresh.rewrite("config/defaults.yaml", "strain:", "strane:")
    near = "(did you mean 'load.strain', 'load.turns' or 'load.start'?)"
    assert f"unknown key 'load.strane' {near}" in one_message(fresh.study("ci"))
    assert not (fresh.folder / "results").exists()


def test_run_that_cannot_go_on_keeps_converged_increments(meshed):
    """Yarns that are pressed too far into each other: the curve is there, and a second study leaves it out."""
    meshed.rewrite("config/defaults.yaml", "augmentations: 10", "augmentations: 0")
    message = one_message(meshed.study("ci", "--", "--until", RESULT))
    assert message.startswith("error in simulation pair-slid-coarse: ended at leg ")
    assert "surfaces penetrate each other by" in message
    assert "contact.augmentations" in message
    kept = "results/simulation/pair-slid-coarse.incomplete.nc"
    assert f"The curve up to there is in {kept}" in message
    history = read_dataset(meshed.folder / kept)
    assert history.incomplete in message
    assert history.sizes["increment"] > 1
    assert not (meshed.folder / RESULT).exists()
    again = meshed.study("ci", "--", "--until", RESULT)  # who names the file gets the same end, at once
    assert again.returncode == 1
    assert f"left out: pair-slid-coarse, since pair-slid-coarse {history.incomplete}" in again.stderr
    assert message in again.stderr


def test_interrupted_study_says_in_one_line_how_to_go_on(meshed):
    """The terminal interrupts the whole group: this process, Snakemake and its jobs."""
    with meshed.start_study("ci", "--", "--until", RESULT, output=subprocess.PIPE) as process:
        reason = []
        for line in process.stdout:
            reason.append(line)
            if "  0% [" in line:
                os.killpg(process.pid, signal.SIGINT)
                break
        reason += process.stdout.read().splitlines()
    assert process.returncode == 130
    assert not [line for line in reason if "Traceback" in line or "KeyboardInterrupt" in line]
    assert reason[-1].startswith("error: stopped; finished files are in results")
    assert reason[-1].endswith("repeat the command to resume")
