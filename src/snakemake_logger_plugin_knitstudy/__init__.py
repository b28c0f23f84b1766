"""Progress of a study on the console: a line for every job that has ended, the time left, and one line of an error.

Snakemake loads this package for ``--logger knitstudy``, which ``knitstudy study`` asks for.
"""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from knitstudy.errors import printable_lines

EXPECTED: dict[int, tuple[str, float]] = {}
"""Kind and expected seconds of every job that is to run, by its number: the workflow says them at its start."""

SHORT = 5.0  # Expected seconds of other jobs

FAILED_JOB = re.compile("^RuleException|job did not complete")  # The job itself has said why
LATE = re.compile(r"older modification time \(.*?\) than input (?P<input>.+?) \((?P<time>[^()]+)\)\.")
EXPLAINED = ("error in ", "interrupted")
"""How the message of a job that failed begins in its log, and that of one that was ended."""


class LogHandler(LogHandlerBase):
    """Handler of Snakemake's log records."""

    writes_to_stream, writes_to_file = True, False
    has_filter, has_formatter, needs_rulegraph = True, True, False

    def __post_init__(self) -> None:
        self.messages: dict[int, str] = {}
        self.last, self.planned, self.clock = "", False, Clock()

    def emit(self, record: Any) -> None:
        """Print what a user wants to know of a record."""
        match getattr(record, "event", None):
            case LogEvent.RUN_INFO if self.common_settings.dryrun and not self.planned:
                self.planned = True
                for rule, count in record.stats.items():
                    self.print(f"{count:6}  {rule}")
            case LogEvent.JOB_INFO:
                self.messages[record.jobid] = record.rule_msg or record.rule_name
                self.clock.begin(record.jobid, record.rule_name)
            case LogEvent.JOB_FINISHED:
                self.last = self.messages.pop(record.job_id, "")
                self.clock.end(record.job_id)
            case LogEvent.PROGRESS:
                minutes = self.clock.left(record.total - record.done) / 60
                left = f" ({minutes:.0f} min left)" if minutes >= 1 else ""
                self.print(f"[{record.done}/{record.total}] {self.last}{left}")
            case LogEvent.JOB_ERROR:
                self.print(unexplained(record.rule_msg or record.rule_name, record.log))
            case LogEvent.ERROR if not FAILED_JOB.search(record.getMessage()):
                self.print(f"error: {in_own_words(record.getMessage().strip())}")
            case None if record.getMessage().startswith("Nothing to be done"):
                self.print(record.getMessage())

    def print(self, line: str) -> None:
        """Print a line on standard error, where messages of jobs appear as well."""
        if line:
            print(printable_lines(line), file=sys.stderr, flush=True)


class Clock:
    """Estimates the time that is left: jobs of one kind take the same share of what they were expected to take."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.running: dict[int, tuple[float, str]] = {}  # when each job began, and its rule
        self.ended: dict[str, list[float]] = {}  # seconds taken and expected, by kind

    def begin(self, job: int, rule: str) -> None:
        """Note that a job has begun."""
        self.running[job] = time.monotonic(), rule

    def end(self, job: int) -> None:
        """Note that a job has ended."""
        began, rule = self.running.pop(job, (time.monotonic(), ""))
        kind, expected = EXPECTED.pop(job, (rule, SHORT))
        taken = self.ended.setdefault(kind, [0.0, 0.0])
        taken[0] += time.monotonic() - began
        taken[1] += expected

    def left(self, jobs: int) -> float:
        """Return about how many seconds all other jobs take, as many at a time as so far."""
        kinds = list(EXPECTED.values()) or [("", SHORT)] * jobs
        taken, expected = map(sum, zip(*self.ended.values(), strict=True))
        at_once = max(taken / (time.monotonic() - self.started), 0.5)
        usual = min(taken / expected, 1.0)
        left = 0.0
        for kind, seconds in kinds:
            took, of = self.ended.get(kind, (usual, 1.0))
            left += seconds * took / of
        return left / at_once


def in_own_words(message: str) -> str:
    """Return an error of Snakemake; that of a clock that is wrong with what to do."""
    if not (late := LATE.search(message)):
        return message
    remedy = "set the clock, and type `touch` and its name; no number depends on times"
    return f"{late['input']} was written in the future, on {late['time']}, by the clock of this computer: {remedy}"


def unexplained(job: str, logs: list[str]) -> str:
    """Return a message of a job that failed without one, as where it was killed; else an empty text."""
    texts = [Path(log).read_text(encoding="utf-8", errors="replace") for log in logs if Path(log).is_file()]
    if any(line.startswith(EXPLAINED) for text in texts for line in text.splitlines()):
        return ""
    return f"error: {job}: ended without a message, as a killed process does; see {' '.join(logs)}"
