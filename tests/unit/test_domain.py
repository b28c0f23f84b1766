"""Square knits of rising size: series of sizes, growth of cost, and their tables."""

import numpy as np
import scipy.linalg

from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.knit.mesh.mesher import mesh_fabric, slices_of
from knitstudy.mechanics.membrane import StretchLaw, forces_per_width, strains
from knitstudy.paper.sweeps import law_of, nodes_2d, nodes_3d


def test_counts_of_a_cell_are_those_of_larger_knits(plain_scene, knit_of):
    """Of the meshes of 3 x 3 and 6 x 6 cells."""
    loop = knit_of(plain_scene).loop
    cell = cut_cells(loop, 1, 1)
    slices = law_of(lambda fabric: slices_of(fabric, 0.5, 1.2), cell)
    assert slices(3) == mesh_fabric(cut_cells(loop, 3, 3), 0.5, 1.2, load="course").slices
    assert slices(6) == slices_of(cut_cells(loop, 6, 6), 0.5, 1.2)
    spatial, planar = law_of(lambda fabric: nodes_3d(fabric, 5 / 9), cell), law_of(nodes_2d, cell)
    for n in (3, 6):
        fabric = cut_cells(loop, n, n)
        assert [spatial(n), planar(n)] == [nodes_3d(fabric, 5 / 9), nodes_2d(fabric)]
        assert planar(n) == 4 * n**2 + 6 * n, "zones, and the ends of 3 n pieces"


def test_a_law_of_stretches_has_those_of_the_polar_decomposition():
    law = StretchLaw(np.array([[3.0, 1.0, 0.2], [1.0, 5.0, 0.1], [0.2, 0.1, 0.8]]))
    for gradient in np.eye(2) + 0.2 * np.random.default_rng(0).normal(size=(20, 2, 2)):
        _, stretch = scipy.linalg.polar(gradient)
        expected = np.array([stretch[0, 0] - 1, stretch[1, 1] - 1, 2 * stretch[0, 1]])
        energy = law.energy(strains(gradient))
        np.testing.assert_allclose(energy, expected @ law.membrane @ expected / 2, atol=1e-12)
        np.testing.assert_allclose(forces_per_width(law, expected), law.membrane @ expected, atol=1e-12)
