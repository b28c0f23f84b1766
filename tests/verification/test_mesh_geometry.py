"""Swept yarns against the tube that they stand for: volume and bending stiffness."""

from itertools import product

import numpy as np
import pytest

from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import sweep

RADIUS = 0.9


class Arc:
    def __init__(self, radius, angle):
        self.radius, self.length = radius, radius * angle

    def position(self, s):
        t = s / self.radius
        return np.stack([self.radius * np.sin(t), 0 * t, self.radius * (1 - np.cos(t))], axis=-1)

    def tangent(self, s):
        t = s / self.radius
        return np.stack([np.cos(t), 0 * t, np.sin(t)], axis=-1)


def volume(mesh):
    """Volume of all hexahedra by an exact 2 x 2 x 2 rule."""
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    corner = np.vstack([corner, corner * [1, 1, -1]])
    total = 0.0
    for point in corner / np.sqrt(3):
        factor = 1 + corner * point
        gradient = corner * factor[:, [1, 0, 0]] * factor[:, [2, 2, 1]] / 8
        total += np.linalg.det(np.einsum("eci,cj->eij", mesh.nodes[mesh.hexahedra], gradient)).sum()
    return total


def second_moments(section):
    """Integrals of x^2, y^2 and x y over the section, by an exact 3 x 3 rule on each quad."""
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    total = np.zeros(3)
    points, weights = np.polynomial.legendre.leggauss(3)
    for (u, v), weight in zip(product(points, points), np.outer(weights, weights).ravel(), strict=True):
        shape = (1 + corner[:, 0] * u) * (1 + corner[:, 1] * v) / 4
        gradient = np.stack(
            [corner[:, 0] * (1 + corner[:, 1] * v), corner[:, 1] * (1 + corner[:, 0] * u)], axis=-1
        )
        jacobian = np.linalg.det(np.einsum("eci,cj->eij", section.points[section.quads], gradient / 4))
        x, y = (section.points[section.quads] * shape[:, None]).sum(axis=1).T
        total += weight * (jacobian * np.stack([x * x, y * y, x * y])).sum(axis=1)
    return total


def test_volume_of_a_bent_yarn_converges_to_that_of_a_tube():
    curve = Arc(2.5, 1.92)  # 12 and 24 elements
    exact = np.pi * RADIUS**2 * curve.length  # Pappus
    meshes = [sweep([curve], Section.butterfly(4, 1), RADIUS, Spacing(h)) for h in (0.4, 0.2)]
    errors = [abs(volume(mesh) / exact - 1) for mesh in meshes]
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)  # chords of slices: second order


@pytest.mark.parametrize(("core", "excess"), [(3, 1.6e-3), (4, 5e-4), (6, 1e-4)])
def test_inflated_polygons_keep_the_bending_stiffness(core, excess):
    moments = second_moments(Section.butterfly(core, 1))
    assert moments[0] == pytest.approx(moments[1], rel=1e-12)
    assert abs(moments[2]) < 1e-13
    # A polygon of the circle's area is the stiffer one, by about (2 pi / angles)^4 / 45.
    assert 0 < moments[0] / (np.pi / 4) - 1 < excess
