"""Run a study with Snakemake: what `make study` does.

It takes the lock of a killed run away, shows what the stages report as they do, and ends with where the
results are or with one message of what is wrong.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from knitstudy.stages.cost import machine_memory

SNAKEFILE = Path(__file__).resolve().parents[1] / "Snakefile"
RESULTS = Path("results")
REPORT = RESULTS / "report.html"
LOCK = Path("run/study.lock")
LOCKS = Path(".snakemake/locks")
"""Snakemake's own: empty when it has ended."""

INTERRUPTED = 130
PATIENCE = 10
"""Seconds that Snakemake has to end after an interruption, before it is told again."""


def main() -> int:
    """Run the study named on the command line; return the exit status."""
    parser = argparse.ArgumentParser(prog="make study", description=__doc__.splitlines()[0])
    parser.add_argument(
        "study", nargs="?", default="reduced", help="ci, reduced (default), full or reference"
    )
    parser.add_argument("--folder", help="scenes, or a configuration, of one's own")
    parser.add_argument("options", nargs="*", help="more options of snakemake, after --")
    arguments = parser.parse_args()
    # glibc keeps arrays of up to 32 MB in a heap with holes: a third of the memory of a knit in contact
    # (docs/notes/performance.md, Memory in contact).
    os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(4 << 20))
    snakemake = [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE), *arguments.options]
    # Jobs wait until the memory that they declare is free.
    snakemake += ["--resources", f"mem_mb={machine_memory()}"]
    snakemake += ["--config", f"study={arguments.study}"]
    snakemake += [f"folder={arguments.folder}"] if arguments.folder else []
    try:
        with alone() as process:
            if process:
                return fail(f"a study is running here already (process {process}); wait for it or end it")
            return run(snakemake, arguments.study)
    except KeyboardInterrupt:
        print(
            f"stopped; finished files are in {RESULTS}, runs that were not done keep their last increment in "
            f"{LOCK.parent}: `make study` goes on from there",
            file=sys.stderr,
        )
        return INTERRUPTED
    except OSError as error:
        return fail(
            f"{error.filename or LOCK}: {error.strerror}; move away what is there, or mend its permissions"
        )


@contextmanager
def alone() -> Iterator[str]:
    """Hold this folder's lock, which ends with this process in any case; yield who else holds it."""
    LOCK.parent.mkdir(parents=True, exist_ok=True)
    with LOCK.open("a+", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield LOCK.read_text(encoding="utf-8", errors="replace").strip() or "unknown"
            return
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield ""


def run(snakemake: list[str], study: str) -> int:
    """Unlock, run and say how it ended; return the exit status."""
    started = time.monotonic()
    if any(LOCKS.glob("*")):
        # Holding our own lock, we know that Snakemake's is a killed run's.
        subprocess.run([*snakemake, "--unlock"], capture_output=True)
    status, steps, explained = execute(snakemake)
    if status and steps is None:
        plan = subprocess.run([*snakemake, "--dry-run"], capture_output=True, text=True)
        return fail(reason(plan.stdout + plan.stderr))
    if status and not explained:  # by the stage itself: it was killed, or Snakemake stopped
        logs = sorted(Path(".snakemake/log").glob("*.log"))
        return fail(f"the study stopped without a word of its stages; see {logs[-1] if logs else 'logs/'}")
    if status:
        return status
    if steps is None:
        print(f"Study {study}: nothing to do, everything is up to date. {places()}")
        return 0
    minutes, seconds = divmod(round(time.monotonic() - started), 60)
    print(f"Study {study}: complete in {minutes} min {seconds} s. {places()}")
    return 0


def execute(snakemake: list[str]) -> tuple[int, int | None, bool]:
    """Run Snakemake, itself silent, and show what the stages say after the number of steps done.

    Returns
    -------
    status : int
        Exit status of Snakemake.
    steps : int or None
        Jobs that it planned, the one that only collects results apart; None if it ended before there was one.
    explained : bool
        Whether a stage said why it failed.
    """
    done, steps, explained = 0, None, False
    silent = [*snakemake, "--quiet", "all"]
    with subprocess.Popen(silent, stderr=subprocess.PIPE, text=True, bufsize=1) as process:
        try:
            for line in process.stderr:
                if line.startswith("left out: "):
                    print(line, end="", flush=True)
                    continue
                if steps is None:  # still planning
                    planned = re.fullmatch(r"planned (\d+) jobs\n", line)
                    steps = int(planned[1]) - 1 if planned else None
                    continue
                done += bool(re.search(r"  done in \d+ s$", line))
                explained |= line.startswith("error")
                print(line if explained else f"[{done}/{steps}] {line}", end="", flush=True)
        except KeyboardInterrupt:
            end(process)
            raise
    return process.returncode, steps, explained


def end(process: subprocess.Popen) -> None:
    """Wait until an interrupted Snakemake has ended its jobs, in silence; a second interruption kills it.

    The terminal interrupts Snakemake as well; whoever interrupted this process alone did not. Jobs end with it.
    """
    for order in (None, signal.SIGINT, signal.SIGKILL):
        if order is not None:
            process.send_signal(order)
        try:
            process.communicate(timeout=PATIENCE)
            return
        except subprocess.TimeoutExpired:
            continue
        except KeyboardInterrupt:
            process.kill()


def reason(output: str) -> str:
    """Return why a plan failed: our own message, or the end of what Snakemake says."""
    lines = [line for line in output.splitlines() if line.strip()]
    own = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return own[0] if own else "Snakemake cannot plan the study:\n" + "\n".join(lines[-8:])


def places() -> str:
    """Say where the results are."""
    report = f"Report: {REPORT.absolute()}. " if REPORT.exists() else ""
    return f"{report}Pictures, tables and data: {RESULTS.absolute()}"


def fail(message: str) -> int:
    """Print one message; return the exit status of a failure."""
    print(f"error: {message}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
