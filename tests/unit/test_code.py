"""The code behind a result is found from import statements, and counts without its comments."""

import ast
import sys

import pytest

from knitstudy.stages import code
from knitstudy.stages.code import PACKAGE, code_digest, modules_behind, tree_digest


def names(*modules):
    return {module.path.relative_to(PACKAGE).as_posix() for module in modules_behind(*modules)}


def test_modules_behind_the_simulation_without_carriers_of_data():
    found = names("knitstudy.models.hexahedra")
    assert {"models/hexahedra.py", "mechanics/newton.py", "mechanics/__init__.py"} <= found
    assert not {name for name in found if name.startswith(("figures/", "cli/", "study/", "stages/"))}
    assert not {"errors.py", "registry.py", "__init__.py"} & found


CODE = '''\
"""What it is for."""
import math

LARGEST = 3
"""What it is."""

# Why.
def f(x):
    """What it does."""
    return math.sin(x) + LARGEST
'''


def digest(text):
    return tree_digest(ast.parse(text))


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("# Why.", "# A better reason,\n# at length.", True),
        ('"""What it is for."""', '"""Another purpose."""', True),
        ('"""What it is."""\n', "", True),
        ("sin", "cos", False),
        ("def f", "def g", False),
        ("+ LARGEST", "+ len('a')", False),
    ],
)
def test_instructions_count_and_comments_do_not(old, new, same):
    assert old in CODE
    assert (digest(CODE.replace(old, new)) == digest(CODE)) is same


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Folder of modules of one's own; what is known of code is forgotten whenever one is written."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        sys.modules.pop(name, None)
        for cached in (code_digest, code._read, code._path_of, code._counts):
            cached.cache_clear()

    return write


def test_a_module_that_a_plugin_imports_counts(plugin):
    plugin(
        "law_of_a_test", "import numpy\nimport constants_of_a_test\nfrom knitstudy.mechanics import newton\n"
    )
    plugin("constants_of_a_test", "STIFFNESS = 1\n")
    found = {module.path.name for module in modules_behind("law_of_a_test")}
    assert {"law_of_a_test.py", "constants_of_a_test.py", "newton.py"} <= found
    assert not any("numpy" in str(module.path) for module in modules_behind("law_of_a_test"))
    before = code_digest("law_of_a_test")
    plugin("constants_of_a_test", "STIFFNESS = 2\n")
    assert code_digest("law_of_a_test") != before


def test_what_was_read_is_kept_until_the_file_changes(plugin, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a cache"))
    code._cache.cache_clear()

    def digest_of_another_process():
        for cached in (code_digest, code._read, code._kept):
            cached.cache_clear()
        return code_digest("kept_law")

    plugin("kept_law", "STIFFNESS = 1\n")
    before = digest_of_another_process()
    with monkeypatch.context() as context:
        context.setattr(code, "_parsed", None)
        assert digest_of_another_process() == before
    (kept,) = (tmp_path / "a cache" / "knitstudy").iterdir()
    plugin("kept_law", "STIFFNESS = 20\n")
    assert digest_of_another_process() != before
    assert kept.read_text().count("kept_law.py") == 1
    kept.write_text("[")
    plugin("kept_law", "STIFFNESS = 1\n")
    assert digest_of_another_process() == before
    code._cache.cache_clear()
    code._kept.cache_clear()
