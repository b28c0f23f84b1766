"""Contacts at crossings: facets, sums over points by hand, segments of a knit, ties."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from half_spaces import hertz_ellipse
from refusals import READ, refusal

from knitstudy.knit.contacts.contacts import extract, indented
from knitstudy.knit.contacts.facets import (
    REACH,
    CrossingFacets,
    Rings,
    count_zones,
    crossing_forces,
    touching_points,
)
from knitstudy.knit.contacts.segments import KINDS, NO_SEGMENT, segments
from knitstudy.knit.geometry.crossings import Crossings, tied_crossings
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.yarns.discretisation import yarn_surfaces
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact


@pytest.fixture
def crossed():
    """Two crossings of two yarns, one above the other: z = 0 and z = 2 mm, 10 mm apart along x."""
    point = np.array([[[0.0, 0, 0], [0, 0, 2e-3]], [[1e-2, 0, 0], [1e-2, 0, 2e-3]]])
    one = np.zeros(2, dtype=int)
    crossings = Crossings(
        row=one,
        column=one,
        zone=np.array([0, 1]),
        yarn=np.array([[0, 1], [0, 1]]),
        arc_length=np.array([[1e-3, 2e-3], [1.1e-2, 1.2e-2]]),
        point=point,
        distance=np.full(2, 2e-3),
    )
    return SimpleNamespace(crossings=crossings)


@pytest.fixture
def history():
    """Three increments; crossing 0 is in contact at the second only, crossing 1 is tied.

    At the lower yarn 2e-8 m2 at 3 MPa and 1e-8 m2 at 1 MPa, the latter sliding; at the upper one 1e-8 m2 at 5 MPa.
    """
    vector = ("point", "xyz")
    touching = {
        "contact_increment": [1, 1, 1],
        "contact_crossing": [0, 0, 0],
        "contact_side": [0, 0, 1],
        "contact_area": [2e-8, 1e-8, 1e-8],
        "contact_cell_area": [4e-8, 1e-8, 2e-8],
        "contact_pressure": [3e6, 1e6, 5e6],
        "contact_slip": [0.0, 3e-6, 0.0],
        "contact_sticks": [1, 0, 1],
    }
    displacement = np.zeros((3, 2, 2, 3))
    displacement[1:, 0, 1] = [1e-5, 0, 0]
    displacement[1:, 1] = [0, 2e-5, 0]
    force = np.zeros((3, 2, 3))
    force[1, 0] = [0.0025, -0.0075, -0.06]
    force[1, 1] = [3.0, 0.0, 4.0]
    return xr.Dataset(
        {
            "strain": ("increment", [0.0, 0.01, 0.02]),
            "crossing_force": (("increment", "crossing", "xyz"), force),
            "crossing_displacement": (("increment", "crossing", "side", "xyz"), displacement),
            "crossing_tied": ("crossing", [0, 1]),
            "tied_area": ("crossing", [np.nan, 7e-8]),
            "tied_centroid": (("crossing", "xyz"), [[np.nan] * 3, [1e-2, 0, 1e-3]]),
            "yarn_force": (("increment", "yarn_number", "xyz"), np.arange(18.0).reshape(3, 2, 3)),
            "contact_cell": (("point", "grid"), [[4, 0], [5, 11], [9, 3]]),
            "contact_position": (vector, [[1e-3, 0, 1e-3], [0, 0, 1e-3], [0, 2e-3, 1e-3]]),
            "contact_reference": (vector, [[1e-3, 0, 0], [0, 0, 0], [0, 1e-3, 0]]),
            "contact_normal": (vector, [[0, 0, -1.0], [0, 0, -1.0], [0, 0, 1.0]]),
            "contact_traction": (vector, [[0, 0, 0.0], [5e5, 0, 0], [0, 1.5e6, 0]]),
        }
        | {name: ("point", values) for name, values in touching.items()},
        attrs={"facets_around": 12, "scene": "pair", "digest": "ab"},
    )


@pytest.fixture
def extracted(crossed, history):
    return extract(crossed, history)


def test_forces_of_both_sides_by_hand(extracted):
    """Half of 0.07 N and of 0.05 N press the lower yarn down; half of 5 mN and of -15 mN pull it sideways."""
    touching = extracted.isel(increment=1, crossing=0)
    np.testing.assert_allclose(touching["normal_resultant"], [0, 0, -0.06])
    np.testing.assert_allclose(touching["tangential_resultant"], [0.0025, -0.0075, 0], atol=1e-18)
    np.testing.assert_allclose(
        touching["normal_resultant"] + touching["tangential_resultant"], touching["force"]
    )


def test_means_over_the_points_by_hand(extracted):
    touching = extracted.isel(increment=1, crossing=0)
    assert float(touching["contact_area"]) == pytest.approx(0.5 * 4e-8)
    np.testing.assert_allclose(touching["contact_centroid"], [6e-3 / 12, 1e-2 / 12, 1e-3])
    np.testing.assert_allclose(touching["contact_normal"], [0, 0, 1])
    assert float(touching["slip"]) == pytest.approx(3e-6 / 4)
    assert float(touching["stick_share"]) == pytest.approx(0.75)
    assert float(touching["largest_pressure"]) == pytest.approx(2.5e6), (
        "of the upper yarn's facet, half touched"
    )
    assert int(touching["zones"]) == 1, "facets 0 and 11 of 12 meet"


def test_open_crossing_has_no_centroid_and_no_force(extracted):
    for increment in (0, 2):
        apart = extracted.isel(increment=increment, crossing=0)
        for name in ("contact_centroid", "contact_normal", "slip", "stick_share"):
            assert np.isnan(apart[name]).all()
        for name in ("zones", "contact_area", "normal_resultant", "tangential_resultant", "largest_pressure"):
            assert (apart[name] == 0).all()


def test_points_without_pressure_or_crossing_do_not_count(crossed, history, extracted):
    of_points = history[[name for name in history.data_vars if "point" in history[name].dims]]
    far = of_points.isel(point=[0]).assign(contact_crossing=("point", [-1]))
    idle = of_points.isel(point=[0]).assign(contact_pressure=("point", [0.0]))
    more = history.drop_dims("point").merge(xr.concat([of_points, far, idle], "point"))
    xr.testing.assert_identical(extract(crossed, more), extracted)


def test_ties_alone_keep_fractions_of_a_newton(crossed, history):
    """Without a point in contact sums are of nothing, and of no kind of number."""
    nothing = history.isel(point=slice(0, 0))
    half = nothing.assign(crossing_force=0.3 * nothing["crossing_force"])
    actual = extract(crossed, half).isel(crossing=1, increment=1)
    np.testing.assert_allclose(actual["normal_resultant"], [0, 0, 1.2])
    np.testing.assert_allclose(actual["tangential_resultant"], [0.9, 0, 0])
    assert float(actual["contact_area"]) == 7e-8


def test_tied_crossing(extracted):
    tied = extracted.isel(crossing=1)
    np.testing.assert_allclose(tied["centroid"], [1e-2, 0, 1e-3])
    np.testing.assert_allclose(tied["contact_centroid"][1], [1e-2, 2e-5, 1e-3])
    np.testing.assert_allclose(tied["normal_resultant"][1], [0, 0, 4.0])
    np.testing.assert_allclose(tied["tangential_resultant"][1], [3.0, 0, 0])
    assert (tied["zones"] == 1).all()
    assert (tied["stick_share"] == 1).all()
    assert float(tied["area"]) == 7e-8
    assert extracted["tied"].values.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda history: history.isel(crossing=[0]), "has 1 crossings and the fabric 2"),
        (lambda history: history.drop_vars("crossing_force"), "holds no crossing_force"),
        (lambda history: history.drop_attrs(), "no attribute facets_around"),
    ],
)
def test_other_histories_are_refused(crossed, history, change, message):
    with refusal(message):
        extract(crossed, change(history))


@pytest.mark.parametrize("angle", [30, 60, 90])
def test_areas_and_pressures_follow_from_forces_by_hertz(angle):
    """Of cylinders whose gap is (1 - cos) x^2 + (1 + cos) y^2 over 2 R; nothing touches without a force."""
    radius, modulus, poisson, cosine = 0.4e-3, 1.3e9, 0.42, np.cos(np.radians(angle))
    force, a, b = hertz_ellipse((1 - cosine) / radius, (1 + cosine) / radius, 0.01 * radius, poisson)
    load = np.array([0.0, modulus * force])
    actual = indented(
        yarn_pair(radius, angle, 10 * radius),
        load[:, None, None] * [0.0, 0.6, 0.8],
        modulus / (2 * (1 - poisson**2)),
    )
    assert actual["contact_area"][:, 0] == pytest.approx([0.0, np.pi * a * b], rel=1e-4)
    assert actual["largest_pressure"][:, 0] == pytest.approx([0.0, 1.5 * load[1] / (np.pi * a * b)], rel=1e-4)


RADIUS, SIZE = 0.9e-3, 0.5


@pytest.fixture(scope="module")
def mesh(pair):
    return mesh_fabric(pair, SIZE, 1.2)


@pytest.fixture(scope="module")
def facets(pair, mesh):
    return CrossingFacets.of(pair.crossings, mesh)


@pytest.fixture(scope="module")
def knitted(plain_scene, knit_of):
    """Crossings of a knit of two rows on its mesh."""
    knit = knit_of(plain_scene.replace("pattern.loops", 1).replace("pattern.rows", 2))
    return CrossingFacets.of(knit.crossings, mesh_fabric(knit, SIZE))


def test_facets_face_each_other(facets, knitted):
    """The middles of the two facets of a crossing lie at the contact: nearer than half a facet."""
    for actual in (facets, knitted):
        middle = actual.mesh.nodes[actual.nodes].mean(axis=2)
        from_contact = np.linalg.norm(middle - actual.crossings.point.mean(axis=1, keepdims=True), axis=2)
        np.testing.assert_array_less(from_contact, 0.5 * SIZE * RADIUS)


def test_places_away_from_crossings_belong_to_none(facets, pair, mesh):
    along = np.linspace(0, mesh.stations[0][-1], 50)
    zero = np.zeros(50, dtype=int)
    crossing, side = facets.nearest(zero, zero + 1, along)
    near = np.abs(along - pair.centrelines[0].length / 2) <= REACH * RADIUS
    assert 0 < near.sum() < 50
    np.testing.assert_array_equal(crossing, np.where(near, 0, -1))
    assert not side.any()
    # Yarns without a crossing of their own.
    assert (facets.nearest(zero, zero, along)[0] == -1).all()


@pytest.fixture(scope="module")
def touching(mesh, facets):
    """The upper yarn pressed onto the lower one and slid, all its nodes alike: answer of contact, and columns."""
    law = Coulomb(1.3e9 / (SIZE * RADIUS), 1.3e9 / (SIZE * RADIUS), 0.3)
    contact = Contact(
        mesh.nodes, Grids(yarn_surfaces(mesh)), law, margin=0.3 * RADIUS, overlap=1e-2 * SIZE * RADIUS
    )
    upper = np.repeat(mesh.yarn_of_slice == 1, mesh.section.size)[:, None]
    pressed = mesh.nodes + upper * [0, 0, -1e-4]
    history = contact.commit(contact.points(pressed, mesh.nodes, ContactHistory.empty()))
    slid = pressed + upper * [2e-6, 1e-6, 0]
    answer = contact.forces(contact.points(slid, pressed, history), stiffness=False)
    committed = contact.points(slid, pressed, contact.commit(answer.points))
    return answer, touching_points(contact, committed, facets, Rings.of_rows(mesh.stations))


def test_force_of_a_crossing_is_that_on_the_lower_yarns_nodes(touching, mesh):
    answer, columns = touching
    on_lower = -answer.node_force[: mesh.first_slice[1] * mesh.section.size].sum(axis=0)
    assert on_lower[2] < -1.0
    assert on_lower[0] > 0.1, "friction draws the lower yarn along"
    np.testing.assert_allclose(crossing_forces(columns, 1)[0], on_lower, rtol=1e-9)
    assert not crossing_forces(columns | {"crossing": np.full(len(columns["side"]), -1)}, 1).any()


AROUND = 8


@pytest.mark.parametrize(("cells", "zones"), READ["zones of facets"])
def test_facets_that_share_an_edge_or_a_corner_are_one_zone(cells, zones):
    cells = np.array(cells)
    assert count_zones(np.zeros(len(cells), dtype=int), cells, AROUND, 1).tolist() == [zones]


@pytest.fixture(scope="module")
def cut(knit):
    return segments(knit.crossings, np.array([each.length for each in knit.centrelines]))


def pieces(cut, kind):
    return np.flatnonzero(np.isin(cut.of_piece, np.flatnonzero(cut.kind == KINDS.index(kind))))


def test_pieces_make_up_all_of_the_yarns(knit, cut):
    length = np.diff(cut.arc_length, axis=1)[:, 0]
    assert np.all(length > 0)
    for yarn, centreline in enumerate(knit.centrelines):
        assert length[cut.yarn == yarn].sum() == pytest.approx(centreline.length, rel=1e-12)


@pytest.mark.parametrize(("kind", "count", "yarns"), READ["segments"])
def test_segments_of_a_knit(cut, kind, count, yarns):
    assert (cut.kind == KINDS.index(kind)).sum() == count
    assert len(pieces(cut, kind)) == yarns * count


def test_a_piece_that_meets_no_other_yarn_is_no_segment(knit, cut):
    """Of the top yarn its heads, of the bottom yarn its feet, and of all yarns the cut ends."""
    ends = (cut.arc_length[:, 0] == 0) | (cut.arc_length[:, 1] == knit.centrelines[0].length)
    assert np.all(cut.of_piece[ends] == NO_SEGMENT)
    outside = (cut.of_piece == NO_SEGMENT) & ~ends
    assert {0: 2, 3: 3} == {yarn: int((outside & (cut.yarn == yarn)).sum()) for yarn in (0, 3)}
    assert not np.any(outside & np.isin(cut.yarn, (1, 2)))


@pytest.mark.parametrize(("direction", "edge"), [("course", "row"), ("wale", "column")])
def test_edges_along_the_load_are_tied(knit, direction, edge):
    tied = tied_crossings(knit.crossings, True, "outer", direction)
    assert set(getattr(knit.crossings, edge)[tied]) == {0, 2}
    assert set(getattr(knit.crossings, edge)[~tied]) == {1}
