"""Quadratic hexahedra on the elements of a swept mesh."""

from dataclasses import replace

import numpy as np
import pytest
from curves import Helix, Straight
from refusals import refusal

from knitstudy.knit.mesh.quadratic import quadratic_mesh
from knitstudy.knit.mesh.section import Section
from knitstudy.knit.mesh.spacing import Spacing
from knitstudy.knit.mesh.sweep import sweep
from knitstudy.mechanics.elements.quadratic import QuadraticHexahedron
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


def test_the_volume_is_that_of_the_tube(mesh):
    elements = QuadraticHexahedron(mesh.nodes[mesh.elements], Hencky(1.0, 0.4))
    tube = np.pi * RADIUS**2 * sum(curve.length for curve in CURVES)
    assert elements.volume.sum() == pytest.approx(tube, rel=1e-3)


def test_folded_elements_are_refused(swept):
    with refusal(r"quadratic hexahedron \d+ of yarn 0 at s = .* folded"):
        quadratic_mesh(replace(swept, radius=4.0), CURVES)
