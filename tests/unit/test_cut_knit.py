"""Cells cut out of a knit: pieces of its yarns, grips, and where yarns touch beside ties."""

import numpy as np
import pytest

from knitstudy.knit.geometry.specimens import cut_cells, middles_of_legs
from knitstudy.knit.mesh.mesher import mesh_scene
from knitstudy.knit.models.rom2d.build import planar_network
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.joints import contacts_of_crossings


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


def moved(scene, pieces, way):
    """Return the displacement of all sections of all pieces when the driven nodes alone move."""
    parts = build(scene, pieces).observer.parts
    u = np.zeros(parts.nodes.shape)
    u[parts.ends.driven] = parts.unity[parts.ends.driven, None] * way
    u[parts.ends.held] = np.nan
    return parts, parts.sampled(u)


def ends_of(parts, moved):
    """Return the displacement (P, 2, 3) of the first and the last section of every piece, nan where it is held."""
    slices = np.column_stack([parts.mesh.first_slice[:-1], parts.mesh.first_slice[1:] - 1])
    return moved[parts.mesh.slice_nodes(slices.ravel())].mean(axis=1).reshape(-1, 2, 3)


def test_grips_in_course_tension_hold_no_arch(scene, pieces):
    """The first yarn has no end at a side; of the last one the outer halves of sinkers have."""
    ends = ends_of(*moved(scene, pieces, [1.0, 2.0, 3.0]))
    held = np.isnan(ends).any(axis=2)
    driven = np.all(np.isclose(ends, [1.0, 2.0, 3.0]), axis=2)
    assert held.nonzero()[0].tolist() == [3, 4, 5]
    assert held[:, 0].sum() == 3
    assert driven.nonzero()[0].tolist() == [3, 4, 8]
    assert driven[:, 1].sum() == 3


def test_grips_in_wale_tension_hold_the_cut_legs(scene, pieces):
    """All six of either side; the ends at the sides are free."""
    parts, values = moved(scene.replace("load.direction", "wale"), pieces, [0.0, 1.0, 0.0])
    ends = ends_of(parts, values)
    held = np.isnan(ends).any(axis=2)
    driven = np.isclose(ends[..., 1], 1.0)
    assert held[:3].all()
    assert not held[3:].any()
    assert driven.sum() == 6
    assert not driven[5, 0]
    assert not driven[8, 1]


def test_sinker_that_is_free_across_the_load_is_led_to_its_first_contact(scene, knit_of):
    """The middle one of four cells has no tie; its driven ends leave it x, z and a turn about y."""
    size = {"pattern.loops": 4, "pattern.rows": 1, "load.direction": "wale"}
    wide = scene.vary({"interaction": "isotropic", **size})
    fabric = cut_cells(knit_of(wide).loop, 4, 1)
    for lateral, expected in (("fixed", False), ("free", [6])):
        yarns = build(wide.replace("load.lateral", lateral), fabric).observer
        drag = yarns.model.drag
        assert (drag is not None and np.unique(yarns.parts.yarn[drag[::3] > 0]).tolist()) == expected


@pytest.mark.parametrize("fidelity", ["hexahedra", "spline_yarns", "rom3d", "beam"])
def test_stations_of_all_models_are_places_on_the_pieces(scene, pieces, fidelity):
    """Histories and contacts number yarns alike: as the fabric does."""
    changes = {"fidelity": fidelity, "interaction": "isotropic" if fidelity == "beam" else "tie"}
    one = scene.vary(changes)
    mesh = {"mesh": mesh_scene(one, pieces)} if fidelity == "hexahedra" else {}
    stations = build(one, pieces, **mesh).stations
    for yarn, line in enumerate(pieces.centrelines):
        here = stations.yarn == yarn
        place = line.position(stations.arc_length[here])
        np.testing.assert_allclose(stations.position[here], place, atol=1e-6 * pieces.radius)


def test_honeycomb_of_cut_cells_ends_half_way_up_its_legs(knit, pieces):
    """Cut legs have the slope of whole ones, end as many rows apart as there are, and yarns at the sides stay level."""
    network = planar_network(pieces, contacts_of_crossings(pieces))
    _, count = np.unique(network.ends, return_counts=True)
    last = count == 1
    y = network.nodes[last, 1]
    cut = np.isclose(y, y.min()) | np.isclose(y, y.max())
    assert cut.sum() == 12
    assert np.ptp(y) == pytest.approx(knit.height)
    along = np.diff(network.nodes[network.ends], axis=1)[:, 0, :2]
    ends = last[network.ends].any(axis=1)
    steep = np.abs(along[:, 1]) > 0.1 * knit.radius
    slope = np.abs(along[:, 1] / np.where(steep, along[:, 0], 1.0)).round(6)
    assert set(slope[ends & steep]) <= set(slope[~ends & steep])
    assert np.all(along[ends & ~steep, 1] == 0)


def test_yarns_touch_beside_every_tie(scene, knit, pieces):
    """Several arches are tied to one yarn. One that is moved into its neighbour is pressed back, but not by the tie."""
    touching = scene.vary({"interaction": "isotropic", "contact.tied_edges": "outer"})
    yarns = build(touching, pieces).observer
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
