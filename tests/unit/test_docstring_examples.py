"""Examples in docstrings run and return what they show."""

import doctest
import importlib
from pathlib import Path

import pytest

import knitstudy

PACKAGE = Path(knitstudy.__file__).resolve().parent

WITH_EXAMPLES = [
    ".".join(("knitstudy", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_run(module):
    results = doctest.testmod(importlib.import_module(module))
    assert (results.failed, results.attempted > 0) == (0, True)
