"""The scenes of the study are those that its results are known under.

Families make scenes by the dozen, so that an edit that means one of them can change others without a word. Every line
of ``scenes.json`` is a scene with its studies and what it sets over the defaults, and their order is the one in which
figures and tables were made up. What is meant to change a scene changes its line; new scenes need none.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest

from knitstudy.figures.catalogue import FIGURES
from knitstudy.measures.selection import roles_of
from knitstudy.study.configuration import CONFIG, load_scenes, load_study
from knitstudy.study.documents import read_yaml
from knitstudy.study.families import read_families
from knitstudy.tables.catalogue import TABLES

KNOWN = json.loads(Path(__file__).with_name("scenes.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def members():
    return read_families(CONFIG / "scenes")


@pytest.fixture(scope="module")
def defaults():
    return dict(leaves(read_yaml(CONFIG / "defaults.yaml")))


def leaves(document, prefix=""):
    for key, value in document.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


@pytest.mark.parametrize("name", KNOWN)
def test_scene_sets_what_it_did(members, defaults, name):
    member = members[name]
    assert defaults | member.keys == defaults | KNOWN[name]["keys"]
    assert list(member.studies) == KNOWN[name]["studies"]


@pytest.mark.parametrize("study", ["ci", "reduced", "full"])
def test_figures_and_tables_are_about_the_same_scenes(study):
    """The first scene that fits is taken: one of a role is the same, and so are several, in whatever order."""
    scenes = load_scenes()
    inside = [name for name in load_study(study) if name in KNOWN]
    assert sorted(inside) == sorted(name for name, known in KNOWN.items() if study in known["studies"])
    today = [scenes[name] for name in inside]
    before = [scenes[name] for name in KNOWN if name in inside]
    for name, entry in (FIGURES.all() | TABLES.all()).items():
        assert names(roles_of(today, entry.of)) == names(roles_of(before, entry.of)), name


def names(roles):
    return {
        role: sorted(scene.name for scene in found) if isinstance(found, list) else found.name
        for role, found in roles.items()
    }
