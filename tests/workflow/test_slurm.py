"""The workflow on a cluster with Slurm, where there is one: what is left when jobs or Snakemake itself are ended."""

import importlib.util
import shutil
import signal
import subprocess

import pytest
from test_killed import wait_until

from knitstudy.files import recorded_digest

PROFILE = ("--workflow-profile", "profiles/slurm", "--slurm-init-seconds-before-status-checks", "5")
SOLIDS, NETWORK = (f"results/simulation/{name}-tie-course-coarse.nc" for name in ("dns", "rom3d"))
TOO_LITTLE = (
    "--set-resources",
    "simulation:mem_mb=attempt*330",
)  # MB: a network takes some 450 with Snakemake
CAMPAIGN = """
studies: []
scenes:
- {name: "alike-{length}", case: tie-course-coarse, keys: {knit: plain3x3, fidelity: rom2d, rom.length: "{length}"}}
"""


def said_by(*command):
    """Return what a command says, nothing where there is no such command."""
    found = shutil.which(command[0])
    return subprocess.run(command, capture_output=True, text=True).stdout if found else ""


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("snakemake_executor_plugin_slurm") is None,
        reason="the executor is not installed: python -m pip install '.[slurm]'",
    ),
    pytest.mark.skipif(not said_by("sinfo", "-h"), reason="there is no Slurm: `sinfo` finds no cluster"),
]


@pytest.fixture
def jobs():
    """Jobs of the queue since the test began, which are cancelled when it ends: a function of their fields."""
    shown = ("squeue", "--all", "--states=all", "--noheader", "--format")
    before = set(said_by(*shown, "%A").split())

    def read(fields="%T"):
        lines = [line.split(maxsplit=1) for line in sorted(said_by(*shown, f"%A {fields}").splitlines())]
        return [line[1] for line in lines if line[0] not in before]

    yield read
    subprocess.run(["scancel", *(set(said_by(*shown, "%A").split()) - before)])


def on_slurm(checkout, *arguments):
    """Start Snakemake on the cluster."""
    command = [checkout.python, "-m", "snakemake", *arguments, *PROFILE]
    return subprocess.Popen(
        command, cwd=checkout.folder, env=checkout.environment, stderr=subprocess.PIPE, text=True
    )


def test_killed_cancelled_and_without_memory(finished, fresh, jobs):
    """Results are those without a cluster, and what was done is not done again."""
    head = on_slurm(fresh, SOLIDS)
    wait_until(lambda: "RUNNING" in jobs(), "first job")
    subprocess.run(["scancel", jobs("%A %i")[0].split()[-1]])
    wait_until(lambda: "RUNNING" in jobs()[1:], "job in the place of the cancelled one")
    head.send_signal(signal.SIGKILL)
    wait_until(lambda: jobs() == ["CANCELLED", "COMPLETED"], "end of the job whose Snakemake was killed")
    done = (fresh.folder / SOLIDS).stat().st_mtime_ns

    assert fresh.snakemake(NETWORK, "--unlock").returncode == 0
    _, said = on_slurm(fresh, NETWORK, *TOO_LITTLE).communicate()
    assert (fresh.folder / NETWORK).exists(), said
    assert (fresh.folder / SOLIDS).stat().st_mtime_ns == done
    asked = jobs("%m %T")[2:]
    if "cgroup" in said_by("scontrol", "show", "config").partition("TaskPlugin ")[2].partition("\n")[0]:
        assert [each.split()[0] for each in asked] == ["330M", "660M"]
    for path in (SOLIDS, NETWORK):
        assert recorded_digest(fresh.folder / path) == recorded_digest(finished[0].folder / path)
