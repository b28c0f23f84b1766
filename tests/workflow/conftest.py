"""The real workflow in a copy of the checkout, in a folder whose name has a space."""

import fcntl
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOTS_PER_INCH = "75"  # of figures: what is drawn and from what is tested here, not how fine

PARTS = ("Snakefile", "benchmarks", "config", "profiles", "resources", "src", "workflow", "pyproject.toml")
FAMILIES = re.compile(r"[0-7]-|13-")
"""Families of scenes that tests of the workflow need: every start of Snakemake reads all that there are."""


def left_out(folder, names):
    """Return the names in a folder that copies leave out; they take compiled modules, which every job imports."""
    families = [name for name in names if Path(folder).name == "scenes" and not FAMILIES.match(name)]
    return {"extremes.yaml", *families} & set(names)


@pytest.fixture(scope="session")
def coarse_pictures():
    """Variables of the environment under which figures are coarse."""
    return {"KNITSTUDY_DPI": DOTS_PER_INCH}


def interruptible():
    """Let Ctrl-C end a process that is started, also where the tests run in the background of a shell."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@dataclass(frozen=True)
class Checkout:
    """A copy of all that the workflow needs."""

    folder: Path

    @property
    def python(self):
        """The interpreter, by a path that has a space as that of the environment of this checkout would."""
        return str(self.folder / ".venv" / "bin" / Path(sys.executable).name)

    @property
    def environment(self):
        """Variables under which the copy's own library is used, and nothing outside of it is written."""
        cache = self.folder / ".snakemake" / "cache"
        own = {
            "PYTHONPATH": str(self.folder / "src"),
            "XDG_CACHE_HOME": str(cache),
            "KNITSTUDY_DPI": DOTS_PER_INCH,
        }
        # Every job imports the same modules: what is kept of them lies in the copy.
        return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"} | own

    def run(self, *arguments):
        """Run Python in the copy."""
        options = {"cwd": self.folder, "env": self.environment, "capture_output": True, "text": True}
        return subprocess.run([self.python, *arguments], **options)

    def study(self, *arguments):
        """Run what `make study` runs."""
        return self.run("-m", "knitstudy", "study", *arguments)

    def start_study(self, *arguments, output=subprocess.DEVNULL):
        """Start what `make study` runs in a process group of its own, and return at once."""
        return subprocess.Popen(
            [self.python, "-m", "knitstudy", "study", *arguments],
            cwd=self.folder,
            env=self.environment,
            start_new_session=True,
            stdout=output,
            stderr=subprocess.STDOUT,
            text=True,
            preexec_fn=interruptible,
        )

    def snakemake(self, *arguments):
        """Run plain snakemake."""
        return self.run("-m", "snakemake", *arguments)

    def rewrite(self, path, old, new):
        """Replace the first of some texts in a file of the copy."""
        text = (self.folder / path).read_text()
        assert old in text, f"{path} has no {old!r}"
        (self.folder / path).write_text(text.replace(old, new, 1))

    def jobs(self, *arguments):
        """Return what Snakemake would do, as a set of the messages of its jobs."""
        ended = self.snakemake(*arguments, "--dry-run", "--config", "study=ci")
        assert ended.returncode == 0, ended.stderr
        actual = re.findall(r"^Job \d+: (.*)$", ended.stdout + ended.stderr, flags=re.MULTILINE)
        return set(actual) - {"Study ci: complete"}


def made_once(tmp_path_factory, name, make):
    """Return what a function of a folder makes there: once for all processes that share the tests.

    The first process makes it, and the others wait. It returns paths and results of processes: pickle would not find a
    class of a conftest.
    """
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    folder, kept = shared / name, shared / f"{name}.pickle"
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            shutil.rmtree(folder, ignore_errors=True)  # of a process that failed half-way
            folder.mkdir()
            kept.write_bytes(pickle.dumps(make(folder)))
    return pickle.loads(kept.read_bytes())


@pytest.fixture(scope="session")
def checkout_copy(tmp_path_factory):
    """Copy of the checkout without results, from which all others are made: an edit meanwhile changes none."""
    return made_once(tmp_path_factory, "checkout", copy_checkout)


def copy_checkout(folder):
    """Copy the parts of the checkout that the workflow needs, and return the folder."""
    for part in PARTS:
        source, target = ROOT / part, folder / part
        if source.is_dir():
            shutil.copytree(source, target, ignore=left_out, symlinks=True)
        else:
            shutil.copy2(source, target)
    (folder / ".venv").symlink_to(sys.prefix)
    return folder


def copied(folder, target):
    """Copy a checkout with all its times."""
    shutil.copytree(folder, target, symlinks=True)
    return Checkout(target)


@pytest.fixture(scope="session")
def finished(checkout_copy, tmp_path_factory):
    """Checkout in which the coarsest study was run from nothing: (checkout, ended process).

    It is run once for all processes that share the tests; each gets a copy.
    """

    def run(folder):
        checkout = copied(checkout_copy, folder / "a checkout")
        return checkout.folder, checkout.study("ci")

    folder, ended = made_once(tmp_path_factory, "finished", run)
    own = copied(folder, tmp_path_factory.mktemp("workflow") / "a checkout")
    ended.stdout = ended.stdout.replace(str(folder), str(own.folder))
    return own, ended


@dataclass(frozen=True)
class Environment:
    """A virtual environment with the wheel of this checkout; all that the wheel needs is that of the tests."""

    folder: Path

    @property
    def work(self):
        """The folder in which commands run."""
        return self.folder / "work"

    def run(self, *arguments):
        """Run a command of knitstudy, which has to succeed, and return what it prints."""
        variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        variables |= {"XDG_CACHE_HOME": str(self.folder / "cache")}
        command = [self.folder / "environment" / "bin" / "python", "-m", "knitstudy", *arguments]
        ended = subprocess.run(command, cwd=self.work, env=variables, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
        return ended.stdout + ended.stderr


@pytest.fixture(scope="session")
def installed(checkout_copy, tmp_path_factory):
    """The wheel, installed in a fresh environment: built once for all processes that share the tests."""
    return Environment(
        made_once(tmp_path_factory, "installed", lambda folder: install(checkout_copy, folder))
    )


def install(checkout_copy, folder):
    """Build the wheel of a committed copy of the checkout, install it in a new environment, and return the folder."""
    source, wheels, environment = folder / "source", folder / "wheels", folder / "environment"
    shutil.copytree(checkout_copy, source, symlinks=True)
    for name in ("README.md", "LICENSE", "setup.py"):
        shutil.copy2(ROOT / name, source)
    committed = "-c user.name=a -c user.email=a@b.c commit --quiet --allow-empty --message a".split()
    for command in (["init", "--quiet"], committed):
        subprocess.run(["git", "-C", source, *command], check=True)
    pip, offline = [sys.executable, "-m", "pip", "--quiet"], ["--no-deps", "--no-index"]
    subprocess.run(
        [*pip, "wheel", *offline, "--no-build-isolation", "--wheel-dir", wheels, source], check=True
    )
    shutil.rmtree(source)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    (wheel,) = wheels.iterdir()
    python = environment / "bin" / "python"
    subprocess.run([*pip, "--python", python, "install", *offline, wheel], check=True)
    (packages,) = environment.glob("lib/python*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    (folder / "work").mkdir()
    return folder


@pytest.fixture
def finished_copy(finished, tmp_path):
    """Copy of the checkout in which the coarsest study was run, to be spoilt."""
    return copied(finished[0].folder, tmp_path / "a checkout")


@pytest.fixture
def fresh(checkout_copy, tmp_path):
    """Checkout in which nothing was run."""
    return copied(checkout_copy, tmp_path / "a checkout")


@pytest.fixture(scope="module")
def checkout(finished):
    checkout, ended = finished
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


@pytest.fixture
def meshed(checkout, fresh):
    """Checkout with the knits and meshes of the coarsest study alone: they are taken as they are by their digests."""
    for stage in ("geometry", "mesh"):
        shutil.copytree(checkout.folder / "results" / stage, fresh.folder / "results" / stage)
    return fresh
