"""Records of runs that take long, each in a file that is named by the digest of all that it depends on.

Where the file is there the run is done: a campaign that was stopped goes on where it was, and what has changed runs
again. A run that fails is a record as well, so that no campaign ends with it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from knitstudy.files import write_text
from knitstudy.knit.scene.scene import digest
from knitstudy.run.code_digest import statements

Record = dict[str, Any]
Task = TypeVar("Task")


def record(folder: Path, name: str, depends_on: Any, make: Callable[[], Record]) -> Record:
    """Return a record from its file, or make and write it; `depends_on` is plain data."""
    path = folder / f"{name}-{digest(depends_on)}.json"
    if not path.is_file():
        write_text(json.dumps(make()), path)
    return json.loads(path.read_text(encoding="utf-8"))


def code_of(*files: str) -> str:
    """Return the statements of scripts, without comments and docstrings: records depend on what a script does."""
    return "\n".join(statements(Path(file).read_text(encoding="utf-8")) for file in files)


READ = 0.1
"""Seconds below which a task counts as read from its record, which says nothing of the time of a run."""


def counted(tasks: Sequence[Task], what: str, clock: Callable[[], float] = time.monotonic) -> Iterator[Task]:
    """Yield tasks, and print how many are done and how much time those left may take, since the first that ran."""
    first = None  # number of the first task that ran, and when it began
    for number, task in enumerate(tasks, 1):
        begun = clock()
        yield task
        if first is None and clock() - begun > READ:
            first = number, begun
        left = len(tasks) - number
        text = f"{number} of {len(tasks)} {what}"
        if first and left:
            each = (clock() - first[1]) / (number - first[0] + 1)
            text += f", about {each * left / 60:.0f} min left"
        print(text, flush=True)
