import numpy as np
import pytest
from refusals import refusal
from scipy.interpolate import BSpline

from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mechanics.spline_yarn.basis import Spline
from knitstudy.mechanics.spline_yarn.space import Space, locate, shape, yarn_space
from knitstudy.mechanics.spline_yarn.span import span_groups

BREAKS = np.array([0.0, 0.3, 1.0, 1.4, 2.0, 2.5])
INSIDE = np.random.default_rng(0).uniform(-0.7, 0.7, (20, 2))


@pytest.mark.parametrize("degree", [1, 4, 12])
def test_functions_on_the_disc_are_orthonormal(degree):
    points, weights = disc.quadrature(degree)
    phi = disc.values(degree, points)
    np.testing.assert_allclose(
        phi.T @ (weights[:, None] * phi) / np.pi, np.eye(disc.size(degree)), atol=1e-13
    )


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_splines_and_derivatives(degree):
    spline = Spline.on(BREAKS, degree, sharp=[2])
    s = np.linspace(-0.05, 2.55, 57)
    coefficients = np.random.default_rng(1).normal(size=spline.size)
    reference = BSpline(spline.knots, coefficients, degree)
    first, values = spline.basis(s, orders=2)
    np.testing.assert_allclose(values[0].sum(axis=1), 1.0, atol=1e-13)
    for order in range(3):
        mine = (values[order] * coefficients[first[:, None] + np.arange(degree + 1)]).sum(axis=1)
        np.testing.assert_allclose(mine, reference(s, order), rtol=1e-10, atol=1e-10)


def test_a_fit_meets_ends_and_polynomials():
    spline = Spline.on(BREAKS, 3)
    s = np.linspace(0, 2.5, 40)
    coefficients = spline.fit(s, np.column_stack([s**3 - s, np.sin(3 * s)]))
    fitted = spline.matrix(s) @ coefficients
    np.testing.assert_allclose(fitted[:, 0], s**3 - s, atol=1e-12)
    np.testing.assert_allclose(fitted[[0, -1], 1], np.sin(3 * s[[0, -1]]), atol=1e-14)


def two_yarns():
    """Two straight yarns of radius 1 that differ in degrees, the second one 5 to the side."""
    yarns = (yarn_space(BREAKS, [2, 2, 4, 3, 2]), yarn_space(BREAKS, 3, 2))
    nodes = []
    for number, yarn in enumerate(yarns):
        s = np.linspace(0, 2.5, 40)
        fixed = np.tile(np.eye(3)[None], (40, 1, 1))
        centre = np.column_stack([0 * s + 5 * number, 0 * s, s])
        c, d1, d2 = (yarn.spline.fit(s, each) for each in (centre, fixed[:, 0], fixed[:, 1]))
        nodes.append(yarn.coefficients(c, d1, d2, 1.0))
    return Space(yarns), np.concatenate(nodes)


def test_places_are_found_again():
    space, nodes = two_yarns()
    yarn, s = np.arange(20) % 2, np.linspace(0.1, 2.4, 20)
    places, _ = shape(space, nodes, yarn, 1.5 * INSIDE, s)
    np.testing.assert_allclose(
        places, np.column_stack([1.5 * INSIDE + [[5, 0]] * yarn[:, None], s]), atol=1e-12
    )
    x, along = locate(space, nodes, places, yarn)
    np.testing.assert_allclose(x, 1.5 * INSIDE, atol=1e-10)
    np.testing.assert_allclose(along, s, atol=1e-10)


@pytest.mark.parametrize(
    ("degree", "message"), [(1, "2.1 at nu = 0.4"), (0, "from 2 to 12"), (13, "from 2 to 12")]
)
def test_degrees_that_are_refused(degree, message):
    with refusal(message):
        yarn_space(BREAKS, degree)


def test_a_yarn_tighter_than_its_radius():
    yarn = yarn_space(np.linspace(0, 2, 9), 2)
    s = np.linspace(0, 2, 60)
    t = 1.2 * s
    centre = np.stack([1 - np.cos(t), 0 * t, np.sin(t)], axis=-1) / 1.2
    d1 = np.stack([np.cos(t), 0 * t, -np.sin(t)], axis=-1)
    d2 = np.tile([0.0, 1.0, 0.0], (60, 1))
    nodes = yarn.coefficients(*(yarn.spline.fit(s, each) for each in (centre, d1, d2)), 1.0)
    with refusal("bent tighter than its radius"):
        span_groups(Space((yarn,)), nodes, Hencky(1.0, 0.3))
