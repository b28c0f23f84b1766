"""Tables of columns: what they refuse, and that the documentation prints them."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from knitstudy.errors import DataFileError
from knitstudy.loading.columns import CONTACTS, HISTORY, STRESSES

SCRIPT = Path(__file__).parents[2] / "docs" / "columns.py"


@pytest.mark.parametrize("columns", [HISTORY, CONTACTS, STRESSES])
def test_an_unknown_name_is_refused(columns):
    with pytest.raises(DataFileError, match=r"has no variable 'forse'.*knitstudy/loading/columns\.tsv"):
        columns.variables({"forse": np.zeros(1)})


def test_documentation_is_up_to_date():
    """Otherwise: python docs/columns.py."""
    specification = importlib.util.spec_from_file_location("docs_columns", SCRIPT)
    docs = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(docs)
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.renewed(page) == page
    with pytest.raises(ValueError, match="columns of history"):
        docs.renewed(page.replace("<!-- end of columns of history -->", ""))
