"""What is known of modules is kept for the next process, and never longer than the modules are the same."""

import json
import sys

import pytest

from knitstudy.stages.trees import KeptTrees, Tree


@pytest.fixture
def reads(monkeypatch):
    """Paths that were read."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    return []


@pytest.fixture
def trees(tmp_path, reads):
    """Function that returns the trees as a new process has them."""

    def read(path):
        reads.append(path)
        return Tree(path.read_text(), ("knitstudy.mesh",))

    return lambda: KeptTrees(tmp_path / "cache", read)


@pytest.fixture
def module(tmp_path):
    path = tmp_path / "a.py"
    path.write_text("1")
    return path


def test_a_file_is_read_once_for_all_processes(trees, module, reads):
    first = trees()
    assert first.of(module) == first.of(module) == Tree("1", ("knitstudy.mesh",))
    first.keep()
    assert trees().of(module) == first.of(module)
    assert reads == [module]


def test_a_file_that_has_changed_is_read_again(trees, module, reads):
    first = trees()
    first.of(module)
    first.keep()
    module.write_text("22")
    assert trees().of(module).digest == "22"
    assert reads == [module, module]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"made by": 1, "trees": 2}', '{"trees": {"a": []}}'])
def test_what_is_damaged_is_made_anew(trees, module, text):
    first = trees()
    first.of(module)
    first.keep()
    (kept,) = (module.parent / "cache").iterdir()
    kept.write_text(text)
    assert trees().of(module).digest == "1"


def test_trees_of_another_version_of_the_code_are_of_no_use(trees, module, reads):
    first = trees()
    first.of(module)
    first.keep()
    (kept,) = (module.parent / "cache").iterdir()
    kept.write_text(json.dumps(json.loads(kept.read_text()) | {"made by": [0, 0]}))
    trees().of(module)
    assert reads == [module, module]


def test_nothing_is_kept_where_nothing_can_be_written(trees, module):
    (module.parent / "cache").write_text("a file")
    first = trees()
    first.of(module)
    first.keep()
    assert (module.parent / "cache").read_text() == "a file"
