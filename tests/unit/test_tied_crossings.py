"""Which crossings are tied, and which pieces of yarn do not touch for that."""

import numpy as np
import pytest

from knitstudy.contacts.facets import tied_crossings, tied_pieces
from knitstudy.mesh.mesher import mesh_fabric


@pytest.fixture
def scene(plain_scene):
    return plain_scene.vary({"fidelity": "hexahedra", "interaction": "isotropic"})


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_fabric(knit, 1.0, 2.0)


@pytest.mark.parametrize(("direction", "edge"), [("course", "row"), ("wale", "column")])
def test_edges_along_the_load_are_tied(scene, knit, direction, edge):
    tied = tied_crossings(scene.replace("load.direction", direction), knit.crossings)
    assert set(getattr(knit.crossings, edge)[tied]) == {0, 2}
    assert set(getattr(knit.crossings, edge)[~tied]) == {1}


@pytest.mark.parametrize("direction", ["course", "wale"])
def test_both_yarns_of_a_tied_crossing_are_one_piece_there(scene, knit, mesh, direction):
    crossings = knit.crossings
    tied = tied_crossings(scene.replace("load.direction", direction), crossings)
    piece = tied_pieces(mesh.stations, crossings, tied, knit.radius)
    for k, yarns in enumerate(crossings.yarn):
        found = set()
        for side, yarn in enumerate(yarns):
            slices = np.flatnonzero(mesh.yarn_of_slice == yarn)
            nearest = slices[np.argmin(np.abs(mesh.arc_length[slices] - crossings.arc_length[k, side]))]
            found.add(int(piece[nearest]))
        assert found == {int(crossings.row[k]) if tied[k] else -1}


def test_yarns_may_touch_beyond_the_reach_of_a_tie(knit, mesh):
    crossings = knit.crossings
    every = np.ones(len(crossings.row), dtype=bool)
    held = tied_pieces(mesh.stations, crossings, every, knit.radius) >= 0
    place = zip(mesh.yarn_of_slice, mesh.arc_length, strict=True)
    apart = [np.abs(crossings.arc_length[crossings.yarn == yarn] - s).min() for yarn, s in place]
    np.testing.assert_array_equal(held, np.array(apart) < knit.radius)
