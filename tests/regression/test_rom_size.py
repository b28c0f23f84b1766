"""Size of the reduced models of the calibrated 3 x 3 knit, held against Table 5 of the paper."""

import pytest

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out as build_geometry
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.simulate import build
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module")
def knit():
    return Fabric.from_dataset(build_geometry(load_scene("rom3d-tie-course")))


def test_degrees_of_freedom_in_space(knit):
    """5,994 in Table 5; 5% for the yarn per loop, of which only that number speaks."""
    network = (
        build(load_scene("rom3d-tie-course"), knit, contacts=contacts_of_crossings(knit)).observers[0].network
    )
    assert 6 * network.beam_nodes == pytest.approx(5994, rel=0.05)


def test_degrees_of_freedom_in_the_plane(knit):
    """408, not the 432 of Table 5: 36 zones, 24 corners of free feet and heads, 8 ends are 68 nodes."""
    network = (
        build(load_scene("rom2d-tie-course"), knit, contacts=contacts_of_crossings(knit)).observers[0].network
    )
    assert 6 * network.beam_nodes == 408
