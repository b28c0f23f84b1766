"""The code behind a result is found from import statements."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.stages.imports import PACKAGE, modules_behind


def names(*modules):
    return {path.relative_to(PACKAGE).as_posix() for path in modules_behind(*modules)}


def test_modules_behind_the_simulation():
    found = names("knitstudy.solids.dns")
    assert {
        "solids/dns.py",
        "mechanics/newton.py",
        "mechanics/elements/one_point.py",
        "mechanics/__init__.py",
        "solids/tie.py",
    } <= found
    assert not {name for name in found if name.startswith(("figures/", "tables/", "rom/"))}


def test_carriers_of_data_are_no_code_behind_a_result():
    assert not {"scene.py", "io.py", "errors.py", "__init__.py"} & names("knitstudy.solids.dns")


def test_unknown_module():
    with pytest.raises(ConfigurationError, match=r"no module 'knitstudy\.nothing'"):
        modules_behind("knitstudy.nothing")
