"""One table of columns: what it refuses, and that the documentation prints it."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from knitstudy.errors import DataFileError
from knitstudy.loading.columns import CONTACTS, HISTORY, STRESSES

SCRIPT = Path(__file__).parents[2] / "docs" / "columns.py"


@pytest.fixture
def docs():
    specification = importlib.util.spec_from_file_location("docs_columns", SCRIPT)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_variables_take_dims_and_unit_from_the_table():
    variables = HISTORY.variables({"yarn": np.array([0, 1]), "force": np.array([1.0])})
    assert list(variables) == ["force", "yarn"]
    dims, values, attributes = variables["force"]
    assert (dims, values[0], attributes["units"]) == (("increment",), 1.0, "N")


@pytest.mark.parametrize("columns", [HISTORY, CONTACTS, STRESSES])
def test_an_unknown_name_is_refused(columns):
    with pytest.raises(DataFileError, match=r"has no variable 'forse'.*knitstudy\.loading\.columns"):
        columns.variables({"forse": np.zeros(1)})


def test_documentation_is_up_to_date(docs):
    """Otherwise: python docs/columns.py."""
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.renewed(page) == page


def test_a_page_without_a_place_for_a_table(docs):
    page = docs.PAGE.read_text(encoding="utf-8").replace("<!-- end of columns of history -->", "")
    with pytest.raises(ValueError, match="columns of history"):
        docs.renewed(page)
