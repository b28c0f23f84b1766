"""Modules lie in rooms, one above the other: imports run downwards and never in a circle (``.importlinter``)."""

import subprocess
import sys
from pathlib import Path

CONTRACTS = Path(__file__).parents[2] / ".importlinter"


def test_contracts_of_imports_are_kept():
    run = "from importlinter.cli import lint_imports; import sys; sys.exit(lint_imports(sys.argv[1], cache_dir=None))"
    command = [sys.executable, "-c", run, str(CONTRACTS)]  # in a process of its own: it disables loggers
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout
