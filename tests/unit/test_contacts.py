"""Extraction at the crossings against sums made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from half_spaces import hertz_ellipse
from refusals import refusal

from knitstudy.knit.contacts.contacts import extract, indented
from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.geometry.specimens import yarn_pair


@pytest.fixture
def pair():
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
def contacts(pair, history):
    return extract(pair, history)


def test_forces_of_both_sides_by_hand(contacts):
    """Half of 0.07 N and of 0.05 N press the lower yarn down; half of 5 mN and of -15 mN pull it sideways."""
    touching = contacts.isel(increment=1, crossing=0)
    np.testing.assert_allclose(touching["normal_resultant"], [0, 0, -0.06])
    np.testing.assert_allclose(touching["tangential_resultant"], [0.0025, -0.0075, 0], atol=1e-18)
    np.testing.assert_allclose(
        touching["normal_resultant"] + touching["tangential_resultant"], touching["force"]
    )


def test_means_over_the_points_by_hand(contacts):
    touching = contacts.isel(increment=1, crossing=0)
    assert float(touching["contact_area"]) == pytest.approx(0.5 * 4e-8)
    np.testing.assert_allclose(touching["contact_centroid"], [6e-3 / 12, 1e-2 / 12, 1e-3])
    np.testing.assert_allclose(touching["contact_normal"], [0, 0, 1])
    assert float(touching["slip"]) == pytest.approx(3e-6 / 4)
    assert float(touching["stick_share"]) == pytest.approx(0.75)
    assert float(touching["largest_pressure"]) == pytest.approx(2.5e6), (
        "of the upper yarn's facet, half touched"
    )
    assert int(touching["zones"]) == 1, "facets 0 and 11 of 12 meet"


def test_open_crossing_has_no_centroid_and_no_force(contacts):
    for increment in (0, 2):
        apart = contacts.isel(increment=increment, crossing=0)
        for name in ("contact_centroid", "contact_normal", "slip", "stick_share"):
            assert np.isnan(apart[name]).all()
        for name in ("zones", "contact_area", "normal_resultant", "tangential_resultant", "largest_pressure"):
            assert (apart[name] == 0).all()


def test_points_without_pressure_or_crossing_do_not_count(pair, history, contacts):
    of_points = history[[name for name in history.data_vars if "point" in history[name].dims]]
    far = of_points.isel(point=[0]).assign(contact_crossing=("point", [-1]))
    idle = of_points.isel(point=[0]).assign(contact_pressure=("point", [0.0]))
    more = history.drop_dims("point").merge(xr.concat([of_points, far, idle], "point"))
    xr.testing.assert_identical(extract(pair, more), contacts)


def test_ties_alone_keep_fractions_of_a_newton(pair, history):
    """Without a point in contact sums are of nothing, and of no kind of number."""
    nothing = history.isel(point=slice(0, 0))
    half = nothing.assign(crossing_force=0.3 * nothing["crossing_force"])
    actual = extract(pair, half).isel(crossing=1, increment=1)
    np.testing.assert_allclose(actual["normal_resultant"], [0, 0, 1.2])
    np.testing.assert_allclose(actual["tangential_resultant"], [0.9, 0, 0])
    assert float(actual["contact_area"]) == 7e-8


def test_tied_crossing(contacts):
    tied = contacts.isel(crossing=1)
    np.testing.assert_allclose(tied["centroid"], [1e-2, 0, 1e-3])
    np.testing.assert_allclose(tied["contact_centroid"][1], [1e-2, 2e-5, 1e-3])
    np.testing.assert_allclose(tied["normal_resultant"][1], [0, 0, 4.0])
    np.testing.assert_allclose(tied["tangential_resultant"][1], [3.0, 0, 0])
    assert (tied["zones"] == 1).all()
    assert (tied["stick_share"] == 1).all()
    assert float(tied["area"]) == 7e-8
    assert contacts["tied"].values.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda history: history.isel(crossing=[0]), "has 1 crossings and the fabric 2"),
        (lambda history: history.drop_vars("crossing_force"), "holds no crossing_force"),
        (lambda history: history.drop_attrs(), "no attribute facets_around"),
    ],
)
def test_other_histories_are_refused(pair, history, change, message):
    with refusal(message):
        extract(pair, change(history))


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
