"""Figures and tables from outside of the package: one file each, drawn, planned and reported like all others."""

from dataclasses import replace

import pytest
import study
from refusals import refusal

from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.stitch_mesh import endless_cell_of_stitches
from knitstudy.knit.scene.kinds import INTERACTIONS
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.stitches import STITCHES, wrong_stitches
from knitstudy.run.catalogue import FIGURES, TABLES, Displays, reference_files
from knitstudy.run.configuration import CONFIG, load_scenes
from knitstudy.run.plan import Plan

TOY = """
from knitstudy.run.catalogue import FIGURES, TABLES, one, several


@FIGURES.add(
    "toy_curve",
    "A toy",
    results={
        "dns": one("simulation", "yarns-tie-course", "dns-tie-course"),
        "beams": several("simulation", "beam-*-none", optional=True),
    },
)
def curve(dns, scenes, beams=None):
    return dns, scenes, beams


@TABLES.add(
    "toy_stiffness",
    "Another",
    results={
        "rom3d": one("simulation", "rom3d-tie-course"),
        "contacts": one("contacts", "yarns-tie-wale", "dns-tie-wale"),
    },
)
def stiffness(rom3d, contacts):
    return rom3d, contacts
"""


@pytest.fixture
def scenes(plain_scene):
    return list(study.scenes(plain_scene).values())


def displays(catalogue, scenes, reference=None):
    return Displays(catalogue, Plan({scene.name: scene for scene in scenes}), scenes, reference or {})


@pytest.mark.optional_packages
def test_they_are_planned_from_the_scenes_of_a_study(plugin, scenes):
    plugin(FIGURES, TABLES, toydisplays=TOY)
    made = FIGURES.find("toy_curve").make, TABLES.find("toy_stiffness").make
    assert {each.__module__ for each in made} == {"toydisplays"}
    assert (FIGURES.names()[0], FIGURES.names()[-1]) == ("fig15_force_strain", "toy_curve"), (
        "of no place: last"
    )
    figures, tables = (displays(catalogue, scenes) for catalogue in (FIGURES, TABLES))
    assert {role: str(step) for role, step in figures.sources_of("toy_curve").items()} == {
        "dns": "simulation dns-tie-course"
    }
    assert {role: str(step) for role, step in tables.sources_of("toy_stiffness").items()} == {
        "rom3d": "simulation rom3d-tie-course",
        "contacts": "contacts dns-tie-wale",
    }
    assert {role: scene.name for role, scene in figures.scenes("toy_curve").items()} == {
        "dns": "dns-tie-course"
    }
    assert tables.scenes("toy_stiffness") == {}
    alone = displays(TABLES, [scene for scene in scenes if "wale" not in scene.name])
    assert "toy_stiffness" not in alone.names()
    with refusal(r"'toy_stiffness' needs contacts of yarns-tie-wale or"):
        alone.sources_of("toy_stiffness")
    with refusal(r"'toy_stiffness' needs contacts of yarns-tie-wale or"):
        alone.digest("toy_stiffness")


@pytest.mark.optional_packages
def test_a_table_is_made_from_another_table(scenes):
    """Its file is a source, and its digest counts: one simulation less makes both again."""
    every, fewer = (displays(TABLES, each, reference_files(CONFIG)) for each in (scenes, scenes[:-1]))
    assert set(every.files("verdicts", "out")) == {"claims", "readings", "findings"}
    assert every.files("verdicts", "out")["findings"] == "out/tables/findings.csv"
    assert every.digest("verdicts") == displays(TABLES, scenes, reference_files(CONFIG)).digest("verdicts")
    assert every.digest("findings") != fewer.digest("findings")
    assert every.digest("verdicts") != fewer.digest("verdicts")
    with refusal(r"'verdicts' needs geometry of yarns-tie-course or"):
        displays(TABLES, [], reference_files(CONFIG)).files("verdicts", "out")


STICKY = '''
from knitstudy.knit.scene.keys import Section, key
from knitstudy.knit.scene.kinds import INTERACTIONS, Interaction


class Adhesion(Section):
    """Yarns that stick."""

    adhesion: float = key("physics", "assumed", unit="Pa", ge=0, le=1e9)
    "A test."


INTERACTIONS.register(
    Interaction("sticky", "contact that sticks", friction=lambda contact: 0.0, keys=Adhesion)
)
'''


LONG = """
import numpy as np
from knitstudy.knit.geometry.stitch_mesh import loop
from knitstudy.knit.scene.stitches import STITCHES, StitchKind


def long(drawing, stitch):
    return loop(drawing, stitch) * [1, 1, 1.5]


STITCHES.register(StitchKind("D", "a deep knit", 1, draw=long))
"""


def test_a_stitch_is_one_file(plugin):
    """Its letter, its meaning, and how it is drawn."""
    plugin(STITCHES, deep_stitch=LONG)
    target = LoopTarget(2.2e-3, 3.3e-3, 0.22e-3, 0.0)
    lengths = [
        endless_cell_of_stitches(replace(target, stitches=(row,)), 2, 1).centrelines[0].length
        for row in ("KD", "KK")
    ]
    assert lengths[0] > lengths[1]
    assert "D (a deep knit)" in wrong_stitches(("KX",))


def test_an_interaction_brings_its_keys(plugin, config, docs_script):
    scene = load_scenes(config)["dns-a"]
    plugin(INTERACTIONS, sticky_yarns=STICKY)
    sticky = scene.vary({"interaction": "sticky", "contact.adhesion": 1e5})
    assert sticky.contact.adhesion == 1e5
    assert sticky.contact.augmentations == scene.replace("interaction", "rough").contact.augmentations
    assert sticky.scaled(stiffness=1e-6).contact.adhesion == pytest.approx(0.1)
    assert Scene.from_dict(sticky.to_dict()) == sticky
    with refusal(r"contact\.adhesion is -1 but must be a number from 0 to"):
        sticky.replace("contact.adhesion", -1)
    with refusal(r"contact\.adhesion is not a key of a scene whose"):
        scene.vary({"interaction": "rough", "contact.adhesion": 1e5})
    page = docs_script("keys").keys_page()
    (row,) = (line for line in page.splitlines() if line.startswith("| `contact.adhesion`"))
    assert "(fidelity beam, hexahedra or spline_yarns; interaction sticky)" in row
    assert "| physics, assumed" in row
