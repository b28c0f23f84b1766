"""Progress of a study on the console: a line for every job that has ended, the time left, and one line of an error.

Snakemake loads this package for ``--logger knitstudy``, which ``knitstudy study`` asks for.
"""

from __future__ import annotations

import logging
import re
import sys
import time
from pathlib import Path

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

FAILED_JOB = re.compile("^RuleException|job did not complete")  # The job itself has said why
EXPLAINED = "error in "  # How the message of a job that failed begins, in its log and on the console


class LogHandler(LogHandlerBase):
    """Handler of Snakemake's log records."""

    writes_to_stream, writes_to_file = True, False
    has_filter, has_formatter, needs_rulegraph = True, True, False

    def __post_init__(self) -> None:
        self.started, self.messages, self.last, self.planned = time.monotonic(), {}, "", False

    def emit(self, record: logging.LogRecord) -> None:
        """Print what a user wants to know of a record."""
        match getattr(record, "event", None):
            case LogEvent.RUN_INFO if self.common_settings.dryrun and not self.planned:
                self.planned = True
                for rule, count in record.stats.items():
                    self.print(f"{count:6}  {rule}")
            case LogEvent.JOB_INFO:
                self.messages[record.jobid] = record.rule_msg or record.rule_name
            case LogEvent.JOB_FINISHED:
                self.last = self.messages.pop(record.job_id, "")
            case LogEvent.PROGRESS:
                self.print(
                    f"[{record.done}/{record.total}] {self.last}{self.left(record.done, record.total)}"
                )
            case LogEvent.JOB_ERROR:
                self.print(unexplained(record.rule_msg or record.rule_name, record.log))
            case LogEvent.ERROR if not FAILED_JOB.search(record.getMessage()):
                self.print(f"error: {record.getMessage().strip()}")
            case None if record.getMessage().startswith("Nothing to be done"):
                self.print(record.getMessage())

    def left(self, done: int, total: int) -> str:
        """Return in words how long the other jobs take, if they take as long as those that are done."""
        minutes = (time.monotonic() - self.started) * (total / done - 1) / 60
        return f" ({minutes:.0f} min left)" if minutes >= 1 else ""

    def print(self, line: str) -> None:
        """Print a line on standard error, where messages of jobs appear as well."""
        if line:
            print(line, file=sys.stderr, flush=True)


def unexplained(job: str, logs: list[str]) -> str:
    """Return a message of a job that failed without one: it was killed."""
    texts = [Path(log).read_text(encoding="utf-8", errors="replace") for log in logs if Path(log).is_file()]
    if any(line.startswith(EXPLAINED) for text in texts for line in text.splitlines()):
        return ""
    return f"error: {job}: ended without a message, as a killed process does; see {' '.join(logs)}"
