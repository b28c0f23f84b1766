"""The frame of a workflow script: its log file, its progress, and the message on the console when it fails."""

from __future__ import annotations

import logging
import os
import resource
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO

from knitstudy.datasets import provenance
from knitstudy.errors import KnitstudyError, printable_lines
from knitstudy.files import open_regular
from knitstudy.interruption import end_with_parent
from knitstudy.knit.loading.run import Progress

INTERRUPTED = 130  # Exit status after Ctrl-C: whoever started the study says the rest


@contextmanager
def frame(job: Any) -> Iterator[Progress]:
    """Run the body of a Snakemake script with everything it prints in the log file of its rule; yield its progress.

    Standard streams go to the log at the level of file descriptors, so that messages of compiled libraries are there
    too. The console gets the progress of long jobs, and on failure one message and the name of
    the log; the script then ends with status 1.
    """
    end_with_parent()
    label = " ".join([job.params.get("stage", job.rule), *job.wildcards])
    path = Path(job.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    with open_regular(path) as log, _redirected_to(log) as console:
        log.truncate(0)
        versions = ", ".join(f"{name} {version}" for name, version in provenance().items())
        print(f"{label}, {time.strftime('%Y-%m-%d %H:%M:%S')}, {job.threads} threads", file=sys.stderr)
        print(f"Python {sys.version.split()[0]}, {versions}", file=sys.stderr)
        try:
            yield Progress(label, streams=(console, sys.stderr))
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            sys.exit(INTERRUPTED)
        except (Exception, SystemExit) as error:  # a plugin may exit
            traceback.print_exc()
            kind = "" if isinstance(error, KnitstudyError) else f"{type(error).__name__}: "
            for stream in (sys.stderr, console):
                message = f"error in {label}: {kind}{error}\n  traceback in {path}"
                print(printable_lines(message), file=stream)
            sys.exit(1)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux
        seconds = time.monotonic() - started
        print(f"done in {seconds:.1f} s, largest resident memory {peak:.0f} MiB", file=sys.stderr)


@contextmanager
def _redirected_to(log: TextIO) -> Iterator[TextIO]:
    """Send standard output and error, logging and warnings to a file; yield the former standard error."""
    sys.stdout.flush()
    sys.stderr.flush()
    with os.fdopen(os.dup(2), "w", buffering=1) as console:
        for descriptor in (1, 2):
            os.dup2(log.fileno(), descriptor)
        if isinstance(sys.stdout, TextIOWrapper):
            sys.stdout.reconfigure(line_buffering=True)
        form = "%(asctime)s %(name)s: %(message)s"
        logging.basicConfig(stream=sys.stderr, level=logging.INFO, format=form, force=True)
        logging.captureWarnings(True)
        try:
            yield console
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(console.fileno(), 2)
