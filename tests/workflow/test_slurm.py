"""The workflow on a cluster with Slurm, where there is one: files that are left when jobs or Snakemake are ended."""

import importlib.util
import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from test_killed import wait_until

PROFILE = ("--workflow-profile", "profiles/slurm", "--slurm-init-seconds-before-status-checks", "5")
ONE, FOUR = (f"results/simulation/own-{size}.nc" for size in ("1x1", "2x2"))
OWN = ("--config", "folder=own.yaml")
PATIENCE = 900  # s
CAMPAIGN = """
studies: []
keys: {specimen: cell, fidelity: spline_yarns, interaction: tie, load.strain: 0.01, solver.increments: 2}
size:
  1x1: {knit: cell1x1, pattern.loops: 1, pattern.rows: 1}
  2x2: {knit: cell2x2, pattern.loops: 2, pattern.rows: 2}
scenes:
- {name: "own-{size}", size: all}
"""


def output_of(*command):
    """Return what a command says, nothing where there is no such command."""
    actual = shutil.which(command[0])
    return subprocess.run(command, capture_output=True, text=True).stdout if actual else ""


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("snakemake_executor_plugin_slurm") is None,
        reason="runs on a cluster alone, with Snakemake's plugin: python -m pip install '.[slurm]'",
    ),
    pytest.mark.skipif(
        not output_of("sinfo", "-h"),
        reason="runs on a cluster alone, and `sinfo` finds none: run this file on the head node of one",
    ),
]


@pytest.fixture
def own(fresh, tmp_path):
    """Checkout in which nothing was run, with a campaign of two scenes; arrays need a path without a space."""
    own = replace(fresh, folder=fresh.folder.rename(tmp_path / "checkout"))
    (own.folder / "own.yaml").write_text(CAMPAIGN)
    return own


@pytest.fixture
def jobs(own):
    """Return a function of the fields of all jobs of a checkout in the order of their numbers; its end cancels them."""

    def read(fields="%T"):
        queue = output_of("squeue", "--all", "--states=all", "--array", "--noheader", "-o", f"%Z|%A|{fields}")
        actual = [line.split("|") for line in queue.splitlines() if line.startswith(f"{own.folder}|")]
        return [rest for _, job, rest in sorted(actual, key=lambda job: int(job[1]))]

    yield read
    subprocess.run(["scancel", *read("%A")])


def on_slurm(checkout, *arguments):
    """Start Snakemake on the cluster."""
    command = [checkout.python, "-m", "snakemake", *PROFILE, *arguments]
    return subprocess.Popen(
        command, cwd=checkout.folder, env=checkout.environment, stderr=subprocess.PIPE, text=True
    )


def test_killed_cancelled_and_without_memory(own, jobs):
    """Results are those without a cluster, and finished jobs are not run again."""
    head = on_slurm(own, ONE, *OWN)
    wait_until(lambda: jobs() == ["RUNNING"], "first job", PATIENCE)
    subprocess.run(["scancel", *jobs("%A")])
    wait_until(lambda: jobs()[1:] == ["RUNNING"], "job in the place of the cancelled one", PATIENCE)
    head.kill()
    wait_until(lambda: jobs() == ["CANCELLED", "COMPLETED"], "end of the job without Snakemake", PATIENCE)
    done = (own.folder / ONE).stat().st_mtime_ns

    assert own.snakemake("campaign", "--unlock", *OWN).returncode == 0
    # A simulation takes some 450 MB with Snakemake.
    little = ("--set-resources", "simulation:mem_mb=attempt*330")
    _, queue = on_slurm(own, "campaign", *little, *OWN).communicate()
    assert (own.folder / FOUR).exists(), queue
    assert (own.folder / ONE).stat().st_mtime_ns == done
    if re.search("^TaskPlugin .*cgroup", output_of("scontrol", "show", "config"), flags=re.MULTILINE):
        assert jobs("%m")[-2:] == ["330M", "660M"]
    for path in (ONE, FOUR):
        again = own.run("-m", "knitstudy", "run", path, "--force")
        assert "to the last bit" in again.stderr, again.stdout + again.stderr


def test_campaign_is_an_array_whose_jobs_ask_for_the_needs_of_the_largest(own, jobs):
    assert own.snakemake("campaign", "--until", "geometry", *OWN).returncode == 0
    campaign = ("campaign", "--slurm-array-jobs", "simulation", *OWN)
    _, queue = on_slurm(own, "--jobs", "1", *campaign).communicate()
    assert "--jobs is 1 but must be at least 2" in queue
    _, queue = on_slurm(own, *campaign).communicate()
    assert sorted(jobs("%K %T")) == ["1 COMPLETED", "2 COMPLETED"], queue
    assert len(set(jobs("%m %l"))) == 1
