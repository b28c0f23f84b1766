import numpy as np
import pytest
from tubes import tube

from knitstudy.knit.mesh.section import drawn_angles
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords
from knitstudy.mechanics.contact.surface import interpolate, project
from knitstudy.mechanics.contact.tangent import Quadrature

RNG = np.random.default_rng(0)


@pytest.fixture
def sheet():
    """An open grid with nodes anywhere near a plane."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    nodes = np.stack([y, x, 0 * x], axis=-1).reshape(-1, 3)
    return nodes, Grids([Grid(np.arange(30).reshape(5, 6), closed=False)])


def places(surfaces, count, number=0):
    """Places anywhere on a surface."""
    span = surfaces.cells[number]
    return np.full(count, number), RNG.uniform(0, 1, (count, 2)) * span


@pytest.mark.parametrize(("angles", "error"), [(12, 1e-6), (16, 1e-7)])
def test_stretched_tangents_follow_a_circle(angles, error):
    nodes, grid = tube(angles=angles)
    equal = np.tile(2 * np.pi * np.arange(angles) / angles, (len(grid.nodes), 1))
    surfaces = Grids([Grid(grid.nodes, chords=circular_chords(equal))])
    surface, xi = places(surfaces, 200)
    stencil = surfaces.stencil(surface, xi)
    place = interpolate(stencil.value, stencil.nodes, nodes)
    radius = np.linalg.norm(nodes[:, 1:], axis=1)
    assert np.ptp(radius) < 1e-12
    np.testing.assert_allclose(np.linalg.norm(place[:, 1:], axis=1), radius[0], rtol=error)


def test_open_grids_reproduce_linear_fields_up_to_their_edges(sheet):
    nodes, surfaces = sheet
    surface, xi = places(surfaces, 50)
    stencil = surfaces.stencil(surface, xi)
    actual = interpolate(stencil.value, stencil.nodes, nodes)
    np.testing.assert_allclose(actual[:, :2], xi[:, ::-1], atol=1e-13)
    slopes = interpolate(stencil.first, stencil.nodes, nodes)
    np.testing.assert_allclose(slopes, np.tile([[0, 1, 0], [1, 0, 0]], (50, 1, 1)), atol=1e-13)
    assert np.abs(interpolate(stencil.second, stencil.nodes, nodes)).max() < 1e-13


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_gauss_points_stand_for_the_area_of_the_contact_surface(offset):
    nodes, grid = tube(angles=24)
    quadrature = Quadrature.on(Grids([Grid(grid.nodes, offset=offset)]), nodes, points=3)
    assert len(quadrature.area) == 12 * 24 * 9
    assert quadrature.area.sum() == pytest.approx(2 * np.pi * (1 - offset) * 6, rel=2e-3)
    _, xi = quadrature.places(np.arange(len(quadrature.area)))
    np.testing.assert_array_equal(quadrature.row_and_column(np.arange(len(xi)) // 9)[1], np.floor(xi))


def test_closest_points_are_where_the_distance_is_normal():
    nodes, grid = tube()
    surfaces = Grids([grid])
    surface, xi = places(surfaces, 200)
    xi[:, 0] = 1 + xi[:, 0] * 10 / 12
    stencil = surfaces.stencil(surface, xi)
    on = interpolate(stencil.value, stencil.nodes, nodes)
    outward = on * [0, 1, 1] / np.linalg.norm(on[:, 1:], axis=1)[:, None]
    points = on + RNG.uniform(-0.2, 0.2, (200, 1)) * outward
    answer = project(surfaces, nodes, surface, points, xi + RNG.uniform(-0.8, 0.8, xi.shape))
    assert answer.found.all()
    stencil = surfaces.stencil(surface, answer.xi)
    apart = points - interpolate(stencil.value, stencil.nodes, nodes)
    np.testing.assert_allclose(apart, answer.distance[:, None] * answer.normal, atol=1e-9)
    assert np.all(np.einsum("ki,ki->k", answer.normal, outward) > 0.99)


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
