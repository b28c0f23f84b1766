"""The dictionary of models: one for every fidelity, and an entry for one from outside."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import endless_cell
from knitstudy.models import hexahedra, network_3d
from knitstudy.models.simulate import MODELS, build


def test_a_model_from_outside_is_an_entry_and_gets_the_data_that_are_given(
    plain_scene, knit, contacts, monkeypatch
):
    given = {}

    def own(scene, fabric, **data):
        given.update(data)
        return network_3d.build(scene, fabric, **data)

    monkeypatch.setitem(MODELS, "rom3d", own)
    problem = build(plain_scene.replace("mesh.beam_size", 1.2), knit, contacts=contacts, springs=None)
    assert list(given) == ["contacts"]
    assert problem.scene.fidelity == "rom3d"
    monkeypatch.delitem(MODELS, "rom3d")
    with pytest.raises(ConfigurationError, match="no model for fidelity 'rom3d'; known are hexahedra"):
        build(plain_scene, knit)


def test_hexahedra_refuse_endless_yarns(plain_scene, knit):
    cells = endless_cell(knit.loop, *knit.cells)
    with pytest.raises(ConfigurationError, match="which hexahedra cannot model; use spline_yarns"):
        hexahedra.build(plain_scene.replace("fidelity", "hexahedra"), cells, None)
