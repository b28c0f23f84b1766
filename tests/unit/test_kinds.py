"""A kind of scene from outside of the package: one file that registers it, and all that is said of keys knows it."""

import sys

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.registry import load_plugins
from knitstudy.study.configuration import load_scenes
from knitstudy.study.documentation import keys_page
from knitstudy.study.kinds import FIDELITIES, INTERACTIONS, SPECIMENS, all_kinds
from knitstudy.study.scene import Scene

STICKY = '''
from knitstudy.study.keys import Section, key
from knitstudy.study.kinds import Interaction, register


class Adhesion(Section):
    """Yarns that stick."""

    adhesion: float = key(
        "physics", "assumed", unit="Pa", source="a test", ge=0, le=1e9
    )


register(Interaction("sticky", "contact that sticks", friction=lambda scene: 0.0, keys=Adhesion))
'''

RODS = """
from knitstudy.study.kinds import Fidelity, register
from knitstudy.study.model_sections import BeamMesh
from knitstudy.study.model_sections import Newton

register(
    Fidelity(
        name="rods", meaning="rods without torsion", specimens=("knit", "pair"),
        sections={"mesh": BeamMesh, "solver": Newton},
    )
)
"""


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Function that imports a module written for it; what it registers is forgotten afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = [dict(kinds) for kinds in (SPECIMENS, INTERACTIONS, FIDELITIES)]
    written = []

    def load(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        written.append(name)
        load_plugins([name])

    yield load
    for kinds, known in zip((SPECIMENS, INTERACTIONS, FIDELITIES), before, strict=True):
        for name in kinds.keys() - known:
            del kinds[name]
    for name in written:
        sys.modules.pop(name, None)


def test_an_interaction_brings_its_keys(plugin, config):
    scene = load_scenes(config)["dns-a"]
    plugin("sticky_yarns", STICKY)
    sticky = scene.vary({"interaction": "sticky", "contact.adhesion": 1e5})
    assert sticky.contact.adhesion == 1e5
    assert sticky.contact.points == scene.replace("interaction", "rough").contact.points
    assert sticky.scaled(stiffness=1e-6).contact.adhesion == pytest.approx(0.1)
    assert Scene.from_dict(sticky.to_dict()) == sticky
    with pytest.raises(
        ConfigurationError, match=r"contact\.adhesion is -1 but must be a number from 0 to 1e9, in Pa"
    ):
        sticky.replace("contact.adhesion", -1)
    with pytest.raises(
        ConfigurationError, match=r"contact\.adhesion is no key of a scene whose .* interaction rough"
    ):
        scene.vary({"interaction": "rough", "contact.adhesion": 1e5})
    assert (
        "| hexahedra with sticky; spline_yarns with sticky; beam with sticky; window with sticky | physics | assumed |"
        in keys_page()
    )


def test_a_fidelity_says_which_sections_it_has(plugin, config):
    scene = load_scenes(config)["dns-a"]
    plugin("rods", RODS)
    rods = scene.replace("fidelity", "rods")
    assert set(rods.sections) == {"pattern", "geometry", "load", "yarn", "mesh", "solver"}
    assert rods.outputs == ()
    assert len([kind for kind in all_kinds() if kind.fidelity.name == "rods"]) == 2 * len(INTERACTIONS)
    with pytest.raises(ConfigurationError, match=r"unknown fidelity 'rids' \(did you mean 'rods'\?\)"):
        scene.replace("fidelity", "rids")
