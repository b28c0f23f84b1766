"""A test that lacks a package or a program is skipped with a remedy, and fails with --complete."""

from pathlib import Path
from types import SimpleNamespace

import pytest

TESTS = Path(__file__).resolve().parents[1]


@pytest.fixture
def rules(request):
    """The module that all tests share, tests/conftest.py."""
    return request.config.pluginmanager.get_plugin(str(TESTS / "conftest.py"))


def options(*given):
    """Return what a test reads of the options of pytest."""
    return SimpleNamespace(getoption=lambda name: name in given)


def marked(mark, config):
    """Return a test with one mark."""
    return SimpleNamespace(
        config=config,
        get_closest_marker=lambda name: mark if name == mark.name else None,
        iter_markers=lambda name: [mark] if name == mark.name else [],
    )


ABSENT = [
    ({"module": "absent_package"}, "the Python package absent_package is not installed: install it"),
    ({"program": "absent-program"}, "the program absent-program is not on the PATH: install it"),
]


@pytest.mark.parametrize(("absent", "reason"), ABSENT)
def test_a_missing_package_skips_a_test_and_fails_a_complete_run(rules, absent, reason):
    mark = pytest.mark.needs("install it", **absent).mark
    with pytest.raises(pytest.skip.Exception, match=reason):
        rules.pytest_runtest_setup(marked(mark, options()))
    with pytest.raises(pytest.fail.Exception, match=reason):
        rules.pytest_runtest_setup(marked(mark, options("--complete")))


def test_what_is_there_is_tested(rules):
    for there in ({"module": "json"}, {"program": "sh"}):
        rules.pytest_runtest_setup(
            marked(pytest.mark.needs("install it", **there).mark, options("--complete"))
        )


def test_long_tests_say_who_runs_them(rules):
    """Also in a complete run: they have a job of their own."""
    mark = pytest.mark.full.mark
    with pytest.raises(pytest.skip.Exception, match="run it with --full"):
        rules.pytest_runtest_setup(marked(mark, options("--complete")))
    rules.pytest_runtest_setup(marked(mark, options("--full")))


def test_no_test_is_skipped_by_an_import():
    """pytest skips on a failed import without a remedy, and never fails; the mark `needs` does both."""
    skips = "importor" + "skip"
    assert [path for path in TESTS.rglob("*.py") if skips in path.read_text(encoding="utf-8")] == []
