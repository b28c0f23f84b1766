"""The table of verification that is kept must be of this physics and of all cases."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
TABLE = HERE.parents[1] / "resources" / "verification.csv"
REMEDY = "run `make verify` and commit resources/verification.csv"


@pytest.fixture(scope="module")
def lines(request):
    if request.config.getoption("--table"):
        pytest.skip("the table is being made")
    return TABLE.read_text().splitlines()


@pytest.fixture(scope="module")
def rows(lines):
    return list(csv.DictReader(lines[1:]))


def test_the_table_is_of_this_physics(lines, heads):
    assert lines[0] == heads[0], f"the table is older than the physics it speaks of; {REMEDY}"


def test_every_case_was_run(rows):
    collected = subprocess.run(
        [sys.executable, *"-m pytest --collect-only --cases -q -p no:cacheprovider".split(), str(HERE)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    cases = {line for line in collected if "::" in line}
    assert cases, "no case was collected"
    missing = cases - {row["test"] for row in rows}
    assert not missing, f"{sorted(missing)} not in the table; {REMEDY}"


def test_every_case_holds(rows, heads):
    assert set(rows[0]) == set(heads[1])
    assert all(row["holds"] == "True" for row in rows)
