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

Record = dict[str, Any]
Task = TypeVar("Task")


def record(folder: Path, name: str, depends_on: Any, make: Callable[[], Record]) -> Record:
    """Return a record from its file, or make and write it; `depends_on` is plain data."""
    path = folder / f"{name}-{digest(depends_on)}.json"
    if not path.is_file():
        write_text(json.dumps(make()), path)
    return json.loads(path.read_text(encoding="utf-8"))


def counted(tasks: Sequence[Task], what: str) -> Iterator[Task]:
    """Yield tasks, and print how many are done and how much time those left may take."""
    begun = time.monotonic()
    for number, task in enumerate(tasks):
        if number:
            left = (time.monotonic() - begun) / number * (len(tasks) - number)
            print(f"{number} of {len(tasks)} {what}, about {left / 60:.0f} min left", flush=True)
        yield task
