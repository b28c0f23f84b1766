"""A test that lacks a package or a program is skipped with a remedy, and fails with --complete."""

import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]

LACKING = """
import pytest

@pytest.mark.needs("install it", module="json")
def test_there():
    pass

@pytest.mark.needs("install it", module="absent_package")
def test_module():
    raise AssertionError

@pytest.mark.needs("install it", program="absent-program")
def test_program():
    raise AssertionError

def test_found_out_while_it_runs(not_run_here):
    not_run_here("no OpenGL: install it")

@pytest.mark.full
def test_marked_long():
    raise AssertionError

@pytest.mark.parametrize("long", [False, True])
def test_long_case(long, skip_if_long):
    skip_if_long(long)
    assert not long
"""


@pytest.mark.parametrize(
    ("options", "counts"),
    [((), "2 passed, 5 skipped"), (("--complete",), "1 failed, 2 passed, 2 skipped, 2 errors")],
)
def test_what_is_missing_is_named_with_its_remedy(tmp_path, options, counts):
    """Long cases are skipped in both: they have a job of their own."""
    folder = tmp_path / "unit"
    folder.mkdir()
    (folder / "test_lacking.py").write_text(LACKING)
    command = [sys.executable, "-m", "pytest", "-c", "/dev/null", "-p", "conftest", "-p", "no:cacheprovider"]
    ended = subprocess.run(
        [*command, "--rootdir", tmp_path, "-rsf", *options, folder],
        env={"PYTHONPATH": f"{TESTS}:{TESTS.parent / 'src'}", "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
    )
    assert counts in ended.stdout, ended.stdout + ended.stderr
    reasons = (
        "the Python package absent_package is not installed: install it",
        "the program absent-program is not on the PATH: install it",
        "no OpenGL: install it",
        "run it with --full",
    )
    assert [reason for reason in reasons if reason not in ended.stdout] == []


def test_no_test_is_skipped_by_an_import():
    """pytest skips on a failed import without a remedy, and never fails; the mark `needs` does both."""
    skips = "importor" + "skip"
    assert [path for path in TESTS.rglob("*.py") if skips in path.read_text(encoding="utf-8")] == []
