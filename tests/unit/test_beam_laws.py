"""Laws of contact of beams: a plugin adds one in a file, which figures, names of models and scenes know at once."""

import pytest

from knitstudy import simulate
from knitstudy.errors import ConfigurationError
from knitstudy.knit.models.beam import BeamKeys
from knitstudy.knit.models.beam.contact import contact_of
from knitstudy.knit.scene.keys import allowed_values
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.paper.cases import label_of
from knitstudy.run.configuration import load_scene
from knitstudy.use.style import Look

PLUGIN = """
from knitstudy.mechanics.beams.laws import LAWS, Law


@LAWS.register
class Foam(Law):
    name, meaning, label = "foam", "a soft power", "foamy"
    look = ("#333333", ":", "x")

    @classmethod
    def of(cls, yarn, beam):
        return cls(0.1 * yarn.youngs_modulus * yarn.radius**0.5, 1.5)
"""


def test_a_plugin_adds_a_law_in_one_file(plugin):
    plugin(LAWS, foam_of_a_test=PLUGIN)
    assert "foam (a soft power)" in allowed_values(BeamKeys, "section")
    changes = {"beam.section": "foam", "load.strain": 1e-3, "load.stops": [], "solver.increments": 1}
    scene = load_scene("beam-isotropic-course").vary(changes)
    assert contact_of(scene).law.coefficient == pytest.approx(0.1 * 1.3e9 * 0.9e-3**0.5)
    assert label_of(scene) == "beams, foamy"
    assert Look(label_of(scene), *LAWS.find("foam").look).marker == "x"
    assert simulate(scene).history.attrs["beam_section"] == "foam"


def test_a_law_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(
        ConfigurationError, match=r"hertz \(the approach of two crossed cylinders\) or rigid \(a penalty\)"
    ):
        load_scene("beam-isotropic-course").vary({"beam.section": "foam"})
