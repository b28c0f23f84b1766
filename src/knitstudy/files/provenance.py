"""What made a result: versions of the code and of the numerical libraries."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.metadata import version
from pathlib import Path

import knitstudy


def provenance() -> dict[str, str]:
    """Return what made a result: version of the code and of the numerical libraries."""
    return {"code_version": code_version()} | {name: version(name) for name in ("numpy", "scipy", "pyamg")}


@cache
def code_version() -> str:
    """Return the package's version, with ``git describe`` where the package lies in its checkout."""
    here = Path(__file__).resolve().parent
    command = ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
        inside = subprocess.run(
            ["git", "-C", str(here), "ls-files", "--error-unmatch", __file__], capture_output=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return knitstudy.__version__
    tracked = inside.returncode == 0  # an environment inside another project's checkout is not that project
    return f"{knitstudy.__version__}+{answer.stdout.strip()}" if tracked else knitstudy.__version__
