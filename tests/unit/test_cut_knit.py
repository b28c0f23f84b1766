"""Cells cut out of a knit: pieces of its yarns, grips, and where yarns touch beside ties."""

import numpy as np
import pytest

from knitstudy.knit.geometry.specimens import cut_cells, middles_of_legs
from knitstudy.knit.simulate import build


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary({"specimen": "cut_knit", "fidelity": "spline_yarns", "mesh.spline_degree": 2})


@pytest.fixture(scope="module")
def pieces(knit):
    return cut_cells(knit.loop, *knit.cells)


def test_cuts_are_half_way_up_the_legs(knit):
    """Cuts of the first and of the last yarn lie as many rows apart as there are cells: strain is of the cells."""
    legs = middles_of_legs(knit).ravel()
    low, high = (knit.centrelines[yarn].position(legs) for yarn in (0, -1))
    np.testing.assert_allclose(high - low, np.tile([0, knit.height, 0], (len(legs), 1)), atol=1e-15)
    slope = knit.centrelines[0].tangent(legs)
    assert np.all(np.abs(slope[:, 1]) > 0.6)
    assert np.all(slope[::2, 1] > 0)


def test_no_crossing_is_lost(knit, pieces):
    crossings = pieces.crossings
    for side in range(2):
        for k, piece in enumerate(crossings.yarn[:, side]):
            place = pieces.centrelines[piece].position(crossings.arc_length[k : k + 1, side])[0]
            assert place == pytest.approx(knit.crossings.point[k, side], abs=1e-6 * knit.radius)


def test_sinker_that_is_free_across_the_load_is_led_to_its_first_contact(scene, knit_of):
    """The middle one of four cells has no tie; its driven ends leave it x, z and a turn about y."""
    size = {"pattern.loops": 4, "pattern.rows": 1, "load.direction": "wale"}
    wide = scene.vary({"interaction": "isotropic", **size})
    fabric = cut_cells(knit_of(wide).loop, 4, 1)
    for lateral, expected in (("fixed", False), ("free", [6])):
        yarns = build(wide.replace("load.lateral", lateral), fabric).observer.yarns
        drag = yarns.model.drag
        assert (drag is not None and np.unique(yarns.parts.yarn[drag[::3] > 0]).tolist()) == expected


def test_yarns_touch_beside_every_tie(scene, knit, pieces):
    """Several arches are tied to one yarn. One that is moved into its neighbour is pressed back, but not by the tie."""
    touching = scene.vary({"interaction": "isotropic", "contact.tied_edges": "outer"})
    yarns = build(touching, pieces).observer.yarns
    model, unity = yarns.model, yarns.parts.unity
    last_arch = yarns.parts.nodes_of(2)

    def points(height):
        moved = np.zeros((len(unity), 3))
        moved[last_arch, 2] = unity[last_arch] * height * knit.radius
        state = model.advance(model.start(), moved[yarns.retained].ravel())
        return model.contact_points(state)

    pressed = max((points(height) for height in (0.2, -0.2)), key=lambda actual: actual.pressure.sum())
    assert pressed.pressure.sum() > 0
    touches = pressed.pressure > 0
    place = model.contact.reference(pressed.history.point[touches])
    discs = yarns.ties.discs
    apart = np.linalg.norm(place[:, None] - discs.centre, axis=2).min(axis=1)
    assert 1.5 * discs.radius < apart.min() < knit.radius
    assert points(0.0).pressure.sum() == 0
