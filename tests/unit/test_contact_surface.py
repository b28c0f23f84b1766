import numpy as np
import pytest
from tubes import tube

from knitstudy.knit.mesh.spacing import drawn_angles
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords
from knitstudy.mechanics.contact.tangent import Quadrature

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_gauss_points_stand_for_the_area_of_the_contact_surface(offset):
    nodes, grid = tube(angles=24)
    quadrature = Quadrature.on(Grids([Grid(grid.nodes, offset=offset)]), nodes, points=3)
    assert len(quadrature.area) == 12 * 24 * 9
    assert quadrature.area.sum() == pytest.approx(2 * np.pi * (1 - offset) * 6, rel=2e-3)
    _, xi = quadrature.places(np.arange(len(quadrature.area)))
    np.testing.assert_array_equal(quadrature.row_and_column(np.arange(len(xi)) // 9)[1], np.floor(xi))


@pytest.mark.parametrize("refinement", [1.5, 3.0])
def test_graded_angles_keep_the_radius(refinement):
    """Tangents touch the circle where steps differ: the error falls with the fourth power of the step."""
    errors = []
    for count in (24, 48):
        pull = np.array([[(refinement - 1) / (refinement + 1), 0.0]])
        angles = drawn_angles(2 * np.pi * (np.arange(count) + 0.5) / count, np.repeat(pull, 4, axis=0))
        s = np.repeat(np.arange(4.0), count)
        nodes = np.stack([np.cos(angles).ravel(), np.sin(angles).ravel(), -s], axis=-1)
        grid = Grid(np.arange(4 * count).reshape(4, count), chords=circular_chords(angles))
        xi = np.random.default_rng(1).uniform([0, 0], [3, count], (2000, 2))
        place = Grids([grid]).stencil(np.zeros(len(xi), int), xi).places(nodes)[0]
        errors.append(np.abs(np.hypot(place[:, 0], place[:, 1]) - 1).max())
    assert errors[1] < 3e-3
    assert np.log2(errors[0] / errors[1]) > 3.5
