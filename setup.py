"""Wheels hold the commit that they were built from; everything else about the package is in pyproject.toml."""

import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithCommit(build_py):
    """Write ``git describe`` into the file ``COMMIT`` of the package (`knitstudy.datasets.commit`)."""

    def run(self) -> None:
        """Build, and write the commit where there is one."""
        super().run()
        command = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
        try:
            found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
        except (OSError, subprocess.SubprocessError):
            return
        if not self.editable_mode:
            Path(self.build_lib, "knitstudy", "COMMIT").write_text(found.stdout.strip(), encoding="utf-8")


setup(cmdclass={"build_py": BuildWithCommit})
