from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.mesh import quality
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import sweep

CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
CORNERS = np.arange(8)[None]


class Arc:
    """Circular arc in the x-z plane through the origin, from a centre above it."""

    def __init__(self, radius, angle, y=0.0):
        self.radius, self.length, self.y = radius, radius * angle, y

    def position(self, s):
        t = s / self.radius
        return np.stack([self.radius * np.sin(t), self.y + 0 * t, self.radius * (1 - np.cos(t))], axis=-1)

    def tangent(self, s):
        t = s / self.radius
        return np.stack([np.cos(t), 0 * t, np.sin(t)], axis=-1)

    def curvature(self, s):
        return np.full(s.shape, 1 / self.radius)


def test_scaled_jacobian_of_simple_shapes():
    assert quality.scaled_jacobian(CUBE, CORNERS)[0] == pytest.approx(1.0)
    assert quality.scaled_jacobian(CUBE * [3, 0.2, 1], CORNERS)[0] == pytest.approx(1.0)
    shear = np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1.0]])  # edges along z lean by 45 degrees
    assert quality.scaled_jacobian(CUBE @ shear.T, CORNERS)[0] == pytest.approx(np.sqrt(0.5))
    assert quality.scaled_jacobian(CUBE * [1, 1, -1], CORNERS)[0] == pytest.approx(-1.0)


def test_folded_element_is_refused_with_its_place():
    mesh = sweep([Arc(3.0, 2.0)], Section.butterfly(3, 1), 0.9, Spacing(0.5))
    layer = 5
    element = layer * mesh.section.quads.shape[0]
    nodes = mesh.nodes.copy()
    nodes[mesh.hexahedra[element, 0]] += 5 * mesh.frames[layer, 2]
    with pytest.raises(MeshError, match=rf"yarn 0 at s = {mesh.arc_length[layer]:.6g} m is folded"):
        quality.check_folding(replace(mesh, nodes=nodes))
    quality.check_folding(mesh)


def test_tight_bends_are_refused():
    quality.check_bending([Arc(0.91, 1.0)], radius=0.9)
    with pytest.raises(MeshError, match=r"yarn 1 bends .* radius of 0\.89 m; .* use a smaller yarn.diameter"):
        quality.check_bending([Arc(2.0, 1.0), Arc(0.89, 1.0)], radius=0.9)


@pytest.mark.parametrize(("gap", "overlap"), [(1.81, False), (1.79, False), (1.77, True)])
def test_overlap_of_two_yarns_beyond_the_tolerance(gap, overlap):
    curves = [Arc(5.0, 1.0), Arc(5.0, 1.0, y=gap)]
    if not overlap:
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)
        return
    with pytest.raises(
        MeshError,
        match=r"yarn 0 at .* yarn 1 at .* overlap: their centrelines are 1\.77 m .* smaller yarn.diameter",
    ):
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)


def test_a_yarn_may_not_meet_itself_but_may_turn_as_tight_as_its_radius():
    quality.check_overlap([Arc(0.905, np.pi)], radius=0.9)
    with pytest.raises(MeshError, match=r"yarn 0 at .* yarn 0 at .* overlap"):
        quality.check_overlap([Arc(3.0, 2 * np.pi)], radius=0.9)
