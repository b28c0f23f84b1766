"""The code behind a result counts by the files of its rooms, and by those of plugins."""

import sys

import pytest

from knitstudy import registry
from knitstudy.run import stages as code
from knitstudy.run.stages import code_digest


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of two rooms in the place of this one."""
    for room, text in (("mesh", "SIZE = 1\n"), ("mechanics", "LAW = 1\n")):
        (tmp_path / room).mkdir()
        (tmp_path / room / "a.py").write_text(text)
    monkeypatch.setattr(code, "PACKAGE", tmp_path)
    code._digest.cache_clear()
    yield tmp_path
    code._digest.cache_clear()


def test_files_of_a_room_count_and_no_others(package):
    before = code_digest("mesh"), code_digest("mesh", "mechanics")
    (package / "mechanics" / "a.py").write_text("LAW = 1  # a comment\n")
    code._digest.cache_clear()
    assert code_digest("mesh") == before[0]
    assert code_digest("mesh", "mechanics") != before[1]


@pytest.mark.parametrize("path", ["law_of_a_test.py", "law_of_a_test/__init__.py"])
def test_files_of_a_plugin_count(package, tmp_path, monkeypatch, path):
    before, folder = code_digest("mesh"), tmp_path / "elsewhere"
    (folder / path).parent.mkdir(parents=True)
    (folder / path).write_text("STIFFNESS = 1\n")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(registry, "_imported", {})
    registry.load_plugins(["law_of_a_test"])
    first = code_digest("mesh")
    (folder / path).write_text("STIFFNESS = 2\n")
    code._digest.cache_clear()
    assert len({before, first, code_digest("mesh")}) == 3
    sys.modules.pop("law_of_a_test")
