"""Swept yarns against the tube that they stand for: volume and bending stiffness."""

import numpy as np
import pytest
from curves import Arc

from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import sweep

RADIUS = 0.9


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


def test_volume_of_a_bent_yarn_converges_to_that_of_a_tube():
    curve = Arc(2.5, 1.92)  # 12 and 24 elements
    exact = np.pi * RADIUS**2 * curve.length  # Pappus
    meshes = [sweep([curve], Section.butterfly(4, 1), RADIUS, Spacing(h)) for h in (0.4, 0.2)]
    errors = [abs(volume(mesh) / exact - 1) for mesh in meshes]
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)  # chords of slices: second order
