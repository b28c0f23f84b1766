"""Which crossings are tied."""

import pytest

from knitstudy.knit.contacts.facets import tied_crossings


@pytest.fixture
def scene(plain_scene):
    return plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic"})


@pytest.mark.parametrize(("direction", "edge"), [("course", "row"), ("wale", "column")])
def test_edges_along_the_load_are_tied(scene, knit, direction, edge):
    tied = tied_crossings(scene.replace("load.direction", direction), knit.crossings)
    assert set(getattr(knit.crossings, edge)[tied]) == {0, 2}
    assert set(getattr(knit.crossings, edge)[~tied]) == {1}
