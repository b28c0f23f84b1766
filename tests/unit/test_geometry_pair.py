"""Two straight yarns cross in their middles, the wanted gap apart, at the wanted angle."""

import numpy as np
import pytest

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.files import read_dataset, write_dataset
from knitstudy.geometry.lay_out import lay_out, read_specimen
from knitstudy.geometry.pair import YarnPair

RADIUS, LENGTH, CLEARANCE = 0.9e-3, 10e-3, 0.02


@pytest.fixture(params=[90.0, 30.0])
def pair(request):
    return YarnPair(RADIUS, request.param, LENGTH, CLEARANCE)


def test_yarns_are_straight_and_as_long_as_wanted(pair):
    for yarn, direction in zip(pair.centrelines, pair.directions, strict=True):
        assert yarn.length == pytest.approx(LENGTH, rel=1e-12)
        s = np.linspace(0, yarn.length, 9)
        np.testing.assert_allclose(yarn.tangent(s), np.tile(direction, (9, 1)), atol=1e-12)
        np.testing.assert_allclose(
            np.diff(yarn.position(s[[0, -1]]), axis=0), [LENGTH * direction], atol=1e-15
        )
        np.testing.assert_allclose(yarn.curvature(s) * RADIUS, 0, atol=1e-12)


def test_angle_between_yarns(pair):
    lower, upper = pair.directions
    assert np.degrees(np.arccos(lower @ upper)) == pytest.approx(pair.angle)
    np.testing.assert_array_equal(lower, [1, 0, 0])


def test_crossing_is_where_the_centrelines_are_nearest(pair):
    crossings = pair.crossings
    s = np.linspace(0, LENGTH, 201)
    lower, upper = (yarn.position(s) for yarn in pair.centrelines)
    apart = np.linalg.norm(lower[:, None] - upper, axis=-1)
    assert np.unravel_index(apart.argmin(), apart.shape) == (100, 100)
    assert apart.min() == pytest.approx(crossings.distance[0], rel=1e-12)
    assert crossings.distance[0] - 2 * RADIUS == pytest.approx(CLEARANCE * RADIUS, rel=1e-9)
    for side, yarn in enumerate(pair.centrelines):
        np.testing.assert_allclose(
            yarn.position(crossings.arc_length[:, side]), crossings.point[:, side], atol=1e-15
        )
    assert crossings.point[0, 1, 2] > crossings.point[0, 0, 2], "side 0 is the lower yarn"
    assert crossings.yarn.tolist() == [[0, 1]]


def test_file_and_back(plain_scene, knit, tmp_path):
    scene = plain_scene.vary({"specimen": "pair", "fidelity": "hexahedra", "load.path": [[0, 0, -1e-5]]})
    path = tmp_path / "pair.nc"
    write_dataset(lay_out(scene), path, scene)
    again = read_specimen(read_dataset(path))
    assert again == YarnPair(scene.yarn.radius, scene.pair.angle, scene.pair.length, scene.pair.clearance)
    write_dataset(knit.to_dataset(), path, plain_scene)
    assert read_specimen(read_dataset(path)).to_dataset().equals(knit.to_dataset())


def test_file_of_something_else(pair):
    dataset = pair.to_dataset()
    with pytest.raises(DataFileError, match=r"specimen is None; allowed are knit, pair"):
        read_specimen(dataset.drop_attrs())
    with pytest.raises(
        DataFileError, match=r"\['angle'\] are missing; allowed is what YarnPair\.to_dataset makes"
    ):
        read_specimen(dataset.drop_vars("angle"))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"radius": 0.0}, r"yarn\.diameter = 0\.0 m"),
        ({"angle": 0.0}, r"pair\.angle = 0\.0 degrees: allowed is more than 0"),
        ({"angle": 91.0}, r"pair\.angle = 91\.0 degrees"),
        ({"length": 4 * RADIUS}, r"pair\.length = 0\.0036 m: allowed is more than twice"),
        ({"clearance": -0.01}, r"pair\.clearance = -0\.01 radii: allowed is zero or more"),
    ],
)
def test_pair_that_is_not_allowed(changed, message):
    with pytest.raises(GeometryError, match=message):
        YarnPair(**{"radius": RADIUS, "angle": 90.0, "length": LENGTH} | changed)
