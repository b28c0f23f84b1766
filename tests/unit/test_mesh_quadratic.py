"""Quadratic hexahedra on the elements of a swept mesh."""

from dataclasses import replace

import numpy as np
import pytest
from curves import Helix, Straight

from knitstudy.errors import MeshError
from knitstudy.knit.mesh.quadratic import quadratic_mesh
from knitstudy.knit.mesh.section import Section, Spacing
from knitstudy.knit.mesh.sweep import sweep
from knitstudy.mechanics.elements.hexahedron import QuadraticHexahedron
from knitstudy.mechanics.materials.isotropic import Hencky

RADIUS = 0.9
CURVES = (Helix(3.0, 0.5, 0.5), Straight(6.0, (0, 20.0, 0)))


@pytest.fixture(scope="module")
def swept():
    return sweep(CURVES, Section.butterfly(3, 1), RADIUS, Spacing(0.5))


@pytest.fixture(scope="module")
def mesh(swept):
    return quadratic_mesh(swept, CURVES)


def test_surface_nodes_lie_on_the_true_tube(mesh):
    for grid, curve in zip(mesh.grids, CURVES, strict=True):
        s = np.linspace(0, curve.length, len(grid)) if isinstance(curve, Straight) else None
        # Nodes of a station share the plane of its section, whose centre the mean of opposite nodes is.
        ring = mesh.nodes[grid[:, ::2]]
        centre = ring.mean(axis=1)
        on_station = mesh.nodes[grid]
        real = ~np.isin(grid, mesh.face_centres)
        away = np.linalg.norm(on_station - centre[:, None], axis=-1)
        np.testing.assert_allclose(away[real], RADIUS, rtol=1e-12)
        np.testing.assert_allclose(away, RADIUS, rtol=2e-3)
        if s is not None:
            np.testing.assert_allclose(centre[:, 0], s, atol=1e-12)


def test_the_corners_are_those_of_the_swept_mesh_on_the_radius(swept, mesh):
    np.testing.assert_array_equal(mesh.corners.hexahedra, swept.hexahedra)
    np.testing.assert_array_equal(mesh.corner_nodes[swept.hexahedra], mesh.elements[:, :8])
    np.testing.assert_allclose(mesh.nodes[mesh.corner_nodes], mesh.corners.nodes)
    inside = np.setdiff1d(np.arange(swept.section.size), swept.section.ring)
    np.testing.assert_allclose(
        mesh.corners.nodes.reshape(swept.slices, -1, 3)[:, inside],
        swept.nodes.reshape(swept.slices, -1, 3)[:, inside],
    )


def test_the_volume_is_that_of_the_tube(mesh):
    elements = QuadraticHexahedron(mesh.nodes[mesh.elements], Hencky(1.0, 0.4))
    tube = np.pi * RADIUS**2 * sum(curve.length for curve in CURVES)
    assert elements.volume.sum() == pytest.approx(tube, rel=1e-3)


def test_folded_elements_are_refused(swept):
    with pytest.raises(MeshError, match=r"quadratic hexahedron \d+ of yarn 0 at s = .* folded"):
        quadratic_mesh(replace(swept, radius=4.0), CURVES)


def test_slices_between_corners_are_drawn_towards_crossings_as_their_neighbours():
    """Of a straight yarn whose sections are all drawn to one side, middle nodes lie halfway between corners."""
    straight = sweep(CURVES[1:], Section.butterfly(3, 1), RADIUS, Spacing(0.5))
    mesh = quadratic_mesh(replace(straight, pull=np.tile([0.2, -0.1], (straight.slices, 1))), CURVES[1:])
    corners = mesh.nodes[mesh.corner_nodes].reshape(straight.slices, -1, 3)
    halfway = 0.5 * (corners[1:] + corners[:-1]).reshape(-1, 3)
    apart = np.linalg.norm(mesh.nodes[:, None] - halfway, axis=-1).min(axis=0)
    np.testing.assert_allclose(apart, 0.0, atol=1e-12)
