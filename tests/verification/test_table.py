"""The table of verification that is kept must be of this physics and of all cases."""

import pandas as pd
import pytest

from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.committed_tables import stale_runs

TABLE = RESOURCES / "verification.csv"
REMEDY = "run `make verify` and commit resources/verification.csv"


@pytest.fixture(scope="module")
def table(request):
    if request.config.getoption("--table"):
        pytest.skip("`make verify` is writing the table: run this without --table")
    return pd.read_csv(TABLE)


def test_the_table_is_of_this_physics(table):
    message = f"the table is older than the physics it speaks of; {REMEDY}"
    assert not stale_runs(TABLE), message


def test_every_case_was_run(table, request):
    """Of the cases that were collected beside this test."""
    cases = {item.nodeid for item in request.session.items if "verify" in item.fixturenames}
    if not cases:
        pytest.skip("compares the table with the cases beside it: run all of tests/verification")
    missing = cases - set(table["test"])
    assert not missing, f"{sorted(missing)} not in the table; {REMEDY}"


def test_every_case_holds(table, columns):
    assert set(table) == columns
    assert table["holds"].all()
