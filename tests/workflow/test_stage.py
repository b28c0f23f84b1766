"""A workflow script writes into its log; the console gets its progress or one message."""

import subprocess
import sys
import textwrap

import pytest

FRAME = """
import logging, os, sys, warnings
from pathlib import Path
from types import SimpleNamespace
from knitstudy.errors import MeshError
from knitstudy.run.job import frame
job = SimpleNamespace(rule="knit_mesh", params={"stage": "mesh"}, wildcards=["dns-a"], threads=2, log=[sys.argv[1]])
with frame(job) as progress:
"""


PARENT = """
import pathlib, subprocess, sys, time
log = pathlib.Path(sys.argv[1])
subprocess.Popen(sys.argv[2:])
while not log.exists() or "ready" not in log.read_text():
    time.sleep(0.05)
"""


def command(log, body, *arguments):
    code = FRAME + textwrap.indent(textwrap.dedent(body), "    ")
    return [sys.executable, "-c", code, str(log), *arguments]


def run(log, body, *arguments):
    return subprocess.run(command(log, body, *arguments), capture_output=True, text=True, check=False)


def test_everything_printed_is_in_the_log(tmp_path):
    log = tmp_path / "logs" / "a.log"
    ended = run(
        log,
        """
        print("printed")
        logging.getLogger("knitstudy.x").info("logged")
        warnings.warn("warned")
        os.write(2, b"written by a library\\n")
        progress(0.5, "half")
        """,
    )
    assert ended.returncode == 0
    text = log.read_text()
    for expected in ("printed", "logged", "warned", "written by a library", "50%", "2 threads", "done in"):
        assert expected in text
    console = ended.stderr.splitlines()
    assert [line.split()[:2] for line in console] == [["mesh", "dns-a"]]
    assert "half" in console[0]
    assert ended.stdout == ""


@pytest.mark.parametrize(
    ("error", "message"),
    [
        ("MeshError('element 7 is folded')", "error in mesh dns-a: element 7 is folded"),
        ("ValueError('shapes differ')", "error in mesh dns-a: ValueError: shapes differ"),
    ],
)
def test_one_message_on_the_console_and_the_traceback_in_the_log(tmp_path, error, message):
    ended = run(tmp_path / "a.log", f"raise {error}")
    assert ended.returncode == 1
    assert message in ended.stderr.splitlines()
    assert "Traceback" not in ended.stderr
    assert "Traceback" in (tmp_path / "a.log").read_text()


def test_ends_with_the_process_that_started_it(tmp_path):
    log = tmp_path / "a.log"
    stage = command(log, "print('ready', flush=True); import time; time.sleep(60)")
    # The stage holds the other end of this pipe as its console: the call returns when it has ended.
    subprocess.run(
        [sys.executable, "-c", PARENT, str(log), *stage], stderr=subprocess.PIPE, timeout=40, check=True
    )
