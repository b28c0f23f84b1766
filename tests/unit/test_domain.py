"""Square knits of rising size: series of sizes, growth of cost, and their tables."""

from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.knit.mesh.mesher import mesh_fabric, slices_of
from knitstudy.paper.unknowns import law_of, nodes_2d, nodes_3d


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
