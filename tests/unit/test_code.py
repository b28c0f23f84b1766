"""The code behind a result is found from import statements, and counts without its comments."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.stages.code import PACKAGE, modules_behind, tree_digest


def names(*modules):
    return {path.relative_to(PACKAGE).as_posix() for path in modules_behind(*modules)}


def test_modules_behind_the_simulation():
    found = names("knitstudy.models.solid_yarns")
    assert {
        "models/solid_yarns.py",
        "mechanics/newton.py",
        "mechanics/__init__.py",
        "models/ties.py",
    } <= found
    assert not {name for name in found if name.startswith(("figures/", "tables/", "cli/"))}


def test_carriers_of_data_are_no_code_behind_a_result():
    found = names("knitstudy.models.solid_yarns")
    assert not {name for name in found if name.startswith(("study/", "stages/"))}
    assert not {"errors.py", "registry.py", "__init__.py"} & found


def test_unknown_module():
    with pytest.raises(ConfigurationError, match=r"no module 'knitstudy\.nothing'"):
        modules_behind("knitstudy.nothing")


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


@pytest.fixture
def digest(tmp_path):
    """Function that returns the digest of some code."""

    def of(code):
        path = tmp_path / f"{abs(hash(code))}.py"
        path.write_text(code)
        return tree_digest(path)

    return of


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# Why.", "# A better reason,\n# at length."),
        ('"""What it is for."""', '"""Another purpose."""'),
        ('    """What it does."""\n', ""),
        ('"""What it is."""\n', ""),
        ("math.sin(x) + LARGEST", "(math.sin(x)\n            + LARGEST)"),
    ],
)
def test_comments_and_layout_do_not_count(digest, old, new):
    assert old in CODE
    assert digest(CODE.replace(old, new)) == digest(CODE)


@pytest.mark.parametrize(
    ("old", "new"), [("sin", "cos"), ("= 3", "= 3.0"), ("def f", "def g"), ("(x):", "(x=1):")]
)
def test_code_counts(digest, old, new):
    assert digest(CODE.replace(old, new)) != digest(CODE)


def test_text_that_is_computed_with_counts(digest):
    code = 'def f():\n    return "a"\n'
    assert digest(code.replace('"a"', '"b"')) != digest(code)
    assert digest('def f():\n    """Say it."""\n') == digest("def f():\n    pass\n")
