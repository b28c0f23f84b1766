"""The table of verification that is kept must be of this physics and of all cases."""

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from knitstudy.run.stages import physics_digest

HERE = Path(__file__).parent
TABLE = HERE.parents[1] / "resources" / "verification.csv"
REMEDY = "run `make verify` and commit resources/verification.csv"


@pytest.fixture(scope="module")
def table(request):
    if request.config.getoption("--table"):
        pytest.skip("the table is being made")
    return pd.read_csv(TABLE)


def test_the_table_is_of_this_physics(table):
    message = f"the table is older than the physics it speaks of; {REMEDY}"
    assert set(table["physics"]) == {physics_digest()}, message


def test_every_case_was_run(table):
    collected = subprocess.run(
        [sys.executable, *"-m pytest --collect-only --cases -q -p no:cacheprovider".split(), str(HERE)],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTEST_ADDOPTS": ""},  # -v would print another list
    ).stdout.splitlines()
    cases = {line for line in collected if "::" in line}
    assert cases, "no case was collected"
    missing = cases - set(table["test"])
    assert not missing, f"{sorted(missing)} not in the table; {REMEDY}"


def test_every_case_holds(table, columns):
    assert set(table) == columns
    assert table["holds"].all()
