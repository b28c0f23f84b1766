"""VTK in a process of its own, which renders one picture after the other."""

from __future__ import annotations

import logging
import os
import pickle
import subprocess
import sys
import weakref
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from threading import Timer
from typing import IO

import numpy as np
from matplotlib.image import imread

import knitstudy
from knitstudy.figures.vtk_program import Job

log = logging.getLogger(__name__)

PATIENCE = 300.0
"""Time after which a rendering counts as failed [s]; a slow machine needs a tenth of it."""


class Renderer:
    """VTK, started for the first picture, which takes longer than to render it, given up after its first failure."""

    def __init__(self) -> None:
        self.failed = False
        self._process: subprocess.Popen | None = None
        self._errors: IO[bytes] | None = None

    def render(self, job: Job) -> np.ndarray | None:
        """Return the picture as RGBA array, or None, with a warning in the log, where that does not work."""
        if not self.failed:
            try:
                image = self._picture(job)
                if image[..., 3].any():
                    return image
                reason = "the picture is empty"
            except (OSError, subprocess.SubprocessError, SyntaxError) as error:
                reason = f"{error} {self._last_words()}".strip()
            self.failed = True
            log.warning("VTK cannot render here, pictures are drawn by matplotlib: %s", reason)
        return None

    def _picture(self, job: Job) -> np.ndarray:
        """Have a picture rendered, and read it."""
        if self._process is None:
            self._start()
        process = self._process
        with TemporaryDirectory() as folder:
            task, picture = Path(folder, "job.pickle"), Path(folder, "picture.png")
            task.write_bytes(pickle.dumps(job))
            late = Timer(PATIENCE, process.kill)
            late.start()
            try:
                process.stdin.write(f"{task}\t{picture}\n")
                process.stdin.flush()
                answered = process.stdout.readline()
            finally:
                late.cancel()
            if not answered:
                raise subprocess.SubprocessError(f"its process ended with status {process.wait()}")
            return imread(picture)

    def _start(self) -> None:
        source = Path(knitstudy.__file__).parents[1]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(source), *filter(None, sys.path)])}
        self._errors = TemporaryFile()  # a pipe that nobody reads would be full one day
        weakref.finalize(self, self._errors.close)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "knitstudy.figures.vtk_program"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=environment,
        )
        weakref.finalize(self, _end, self._process)

    def _last_words(self) -> str:
        """Return the last line that the process wrote as an error."""
        if self._errors is None:
            return ""
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").strip().splitlines()
        return said[-1] if said else ""


def _end(process: subprocess.Popen) -> None:
    """End a process that waits for pictures."""
    process.kill()
    process.communicate()
