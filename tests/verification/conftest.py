"""Cases of verification record what they measured; `make verify` keeps that as a table.

A case takes the fixture `verify` and hands it a result, its reference and its bar. With ``--full`` cases run at full
resolution; with ``--table FILE`` the run writes the table of all cases, when all of them have run.
"""

from pathlib import Path

import pandas as pd
import pytest

from knitstudy.run.committed_tables import RUN, keep_table

COLUMNS = ("case", "reference", "result", "bar", "holds", "test")


class Verify:
    """Judges one case after the other and keeps a row of each."""

    def __init__(self, test, rows):
        self._test, self._rows = test, rows

    def within(self, case, result, reference, bar):
        """The result differs from the reference by at most the share `bar` of it."""
        self._judge(
            case, f"{reference:.6g}", f"{result:.6g}", f"within {bar:.2g}", abs(result / reference - 1) <= bar
        )

    def at_most(self, case, result, bar, reference="0"):
        """An error is at most `bar`."""
        self._judge(case, reference, f"{result:.3g}", f"<= {bar:.2g}", result <= bar)

    def at_least(self, case, result, bar, reference):
        """A rate is at least `bar`."""
        self._judge(case, reference, f"{result:.4g}", f">= {bar:g}", result >= bar)

    def _judge(self, case, reference, result, bar, holds):
        values = (case, reference, result, bar, bool(holds), self._test)
        self._rows.append(dict(zip(COLUMNS, values, strict=True)))
        assert holds, f"{case}: {result}, reference {reference}, bar {bar}"


ROWS = pytest.StashKey[list]()


def pytest_configure(config):
    config.stash[ROWS] = []


def pytest_collection_modifyitems(config, items):
    if config.getoption("--cases"):
        items[:] = [item for item in items if "verify" in item.fixturenames]


@pytest.fixture
def verify(request):
    return Verify(request.node.nodeid, request.config.stash[ROWS])


@pytest.fixture(scope="session")
def full(request):
    """Whether cases run at full resolution."""
    return request.config.getoption("--full")


@pytest.fixture(scope="session")
def columns():
    """Columns of the table."""
    return {*COLUMNS, RUN}


def pytest_sessionfinish(session, exitstatus):
    path = session.config.getoption("--table")
    if not path or exitstatus != 0:
        return
    table = pd.DataFrame(session.config.stash[ROWS], columns=COLUMNS).sort_values(["test", "case"])
    keep_table(table, Path(path).resolve(), "make verify")


def pytest_terminal_summary(terminalreporter, exitstatus, config):
    path = config.getoption("--table")
    if path and exitstatus == 0:
        rows = config.stash[ROWS]
        terminalreporter.write_line(f"{len(rows)} cases of verification hold: {path}")
